#include "services/data/mesh/placement.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/placement_options.h"

namespace telesplat::data {
namespace {

constexpr size_t kGrain = 1 << 16;

template <class Body>
void parallel(size_t count, const Body& body) {
  in_parallel(tbb::blocked_range<size_t>(0, count, kGrain), [&](const auto& range) {
    for (size_t i = range.begin(); i < range.end(); ++i) body(i);
  });
}

geometry::DBox box_of_used(const Mesh& mesh) {
  geometry::DBox box;
  for (uint32_t i : mesh.indices) box.extend(mesh.positions[i]);
  return box;
}

// Twice the triangle's area times its normal; double, so that no triangle that has an area in float coordinates loses
// it.
glm::dvec3 area_vector(const PlacedMesh& mesh, size_t triangle) {
  const uint32_t* t = &mesh.indices[3 * triangle];
  const glm::dvec3 a(mesh.positions_room[t[0]]), b(mesh.positions_room[t[1]]), c(mesh.positions_room[t[2]]);
  return glm::cross(b - a, c - a);
}

// Removes triangles without area, keeping the order of the others.
void drop_degenerate(PlacedMesh& mesh) {
  size_t kept = 0;
  const size_t triangles = mesh.indices.size() / 3;
  for (size_t t = 0; t < triangles; ++t) {
    const uint32_t a = mesh.indices[3 * t], b = mesh.indices[3 * t + 1], c = mesh.indices[3 * t + 2];
    if (area_vector(mesh, t) == glm::dvec3(0)) continue;
    if (!mesh.face_colours.empty()) mesh.face_colours[kept] = mesh.face_colours[t];
    mesh.indices[3 * kept] = a, mesh.indices[3 * kept + 1] = b, mesh.indices[3 * kept + 2] = c;
    ++kept;
  }
  mesh.degenerate_dropped += triangles - kept;
  mesh.indices.resize(3 * kept);
  if (!mesh.face_colours.empty()) mesh.face_colours.resize(kept);
}

// Area-weighted vertex normals, not normalised. Scaled up so that small triangles do not vanish in float.
std::vector<glm::vec3> vertex_normals(const PlacedMesh& mesh) {
  std::vector<glm::vec3> normals(mesh.positions_room.size(), glm::vec3(0));
  for (size_t t = 0; t < mesh.indices.size() / 3; ++t) {
    const glm::vec3 n(area_vector(mesh, t) * 1e12);
    for (int k = 0; k < 3; ++k) normals[mesh.indices[3 * t + k]] += n;
  }
  return normals;
}

bool has_direction(const glm::vec3& n) {
  return std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z) &&
         std::abs(n.x) + std::abs(n.y) + std::abs(n.z) > 1e-20f;
}

// Normals of any length lose nothing in float if their largest component is near 1.
uint32_t encode(const glm::vec3& n) {
  const float largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  return largest > 0 ? image::encode_normal32(n / largest) : image::encode_normal32({0, 1, 0});
}

void set_normals(PlacedMesh& placed, const std::vector<glm::vec3>& from_file, const glm::mat3& rotation) {
  placed.normals.resize(placed.positions_room.size());
  bool complete = !from_file.empty();
  if (complete)
    for (const glm::vec3& n : from_file) complete &= has_direction(n);
  const std::vector<glm::vec3> computed = complete ? std::vector<glm::vec3>() : vertex_normals(placed);
  parallel(placed.normals.size(), [&](size_t i) {
    const bool use_file = !from_file.empty() && has_direction(from_file[i]);
    placed.normals[i] = encode(use_file ? rotation * from_file[i] : computed[i]);
  });
}

// The array that colours the mesh, if any.
void take_scalars(Mesh& mesh, PlacedMesh& placed) {
  placed.scalars = !mesh.scalars.empty();
  std::vector<uint32_t>& bits = mesh.scalars_of_faces ? placed.face_colours : placed.colours;
  bits.resize(mesh.scalars.size());
  parallel(bits.size(), [&](size_t i) { bits[i] = std::bit_cast<uint32_t>(mesh.scalars[i]); });
  mesh.scalars = {};
}

}  // namespace

Result<PlacedMesh> place_mesh(Mesh&& mesh, double room_size_m, const std::string& up, const std::string& name) {
  PlacedMesh placed;
  const UpGuess guess = up == "auto" ? guess_up(mesh) : UpGuess{up, "--up"};
  placed.up = guess.axis, placed.up_reason = guess.reason;
  const auto rotation = rotation_for_up(placed.up);
  if (!rotation) return rotation.error();

  placed.box_data = box_of_used(mesh);
  const geometry::DBox frame = mesh.frame.value_or(placed.box_data);
  const glm::dvec3 size = frame.size();
  const double largest = std::max({size.x, size.y, size.z});
  if (!(largest >= 1e-30 && largest <= 1e30))
    return Error{fmt::format("{}: its largest extent is {}, outside [1e-30, 1e30]", name, largest)};
  const glm::dvec3 centre = frame.lo + size * 0.5;
  const double scale = room_size_m / largest;

  // Vertices that no triangle uses may lie anywhere; they are not kept, so they need not be placed well.
  placed.positions_room.resize(mesh.positions.size());
  parallel(mesh.positions.size(),
           [&](size_t i) { placed.positions_room[i] = glm::vec3(*rotation * ((mesh.positions[i] - centre) * scale)); });
  mesh.positions = {};
  placed.indices = std::move(mesh.indices);
  placed.degenerate_dropped = mesh.degenerate_dropped;
  take_scalars(mesh, placed);
  drop_degenerate(placed);
  if (placed.indices.empty())
    return Error{fmt::format("{}: all its {} triangles are degenerate (no area)", name, placed.degenerate_dropped)};
  for (uint32_t i : placed.indices) placed.box_room.extend(placed.positions_room[i]);

  set_normals(placed, mesh.normals, glm::mat3(*rotation));
  if (!placed.scalars) placed.colours = std::move(mesh.colours);
  if (placed.colours.empty() && placed.face_colours.empty())
    placed.colours.assign(placed.positions_room.size(), kNeutralAlbedo);
  return placed;
}

}  // namespace telesplat::data
