#include "services/data/mesh/placing/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <unordered_map>

#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/placement_options.h"
#include "services/data/cloud/cloud.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

// True for a surface over the plane of x and y: flat on the whole, and seen from one side.
bool is_height_field(const Mesh& mesh, const glm::dvec3& size) {
  if (!(size.z < 0.35 * size.x && size.z < 0.35 * size.y)) return false;
  glm::dvec3 sum(0);
  double area = 0;
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    const glm::dvec3 a = mesh.positions[mesh.indices[i]];
    const glm::dvec3 n = glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a);
    sum += n;
    area += glm::length(n);
  }
  const double length = glm::length(sum);
  return length >= 0.4 * area && std::abs(sum.z) >= 0.87 * length;
}

// Returns for each sampled coordinate whether its value occurs at least kRepeats times among them.
std::vector<bool> repeated(const std::vector<double>& values) {
  constexpr size_t kRepeats = 6;
  std::vector<uint32_t> order(values.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<uint32_t>(i);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return values[a] < values[b]; });
  std::vector<bool> out(values.size());
  for (size_t first = 0, last = 0; first < order.size(); first = last) {
    while (last < order.size() && values[order[last]] == values[order[first]]) ++last;
    for (size_t i = first; i < last; ++i) out[order[i]] = last - first >= kRepeats;
  }
  return out;
}

constexpr size_t kGrain = 1 << 16;
constexpr double kNoCrease_deg = 180;

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

// Removes triangles without area, keeping the order of the others.
void drop_degenerate(PlacedMesh& mesh) {
  size_t kept = 0;
  const size_t triangles = mesh.indices.size() / 3;
  for (size_t t = 0; t < triangles; ++t) {
    const uint32_t a = mesh.indices[3 * t], b = mesh.indices[3 * t + 1], c = mesh.indices[3 * t + 2];
    if (area_vector(mesh.positions_room, &mesh.indices[3 * t]) == glm::dvec3(0)) continue;
    if (!mesh.face_colours.empty()) mesh.face_colours[kept] = mesh.face_colours[t];
    mesh.indices[3 * kept] = a, mesh.indices[3 * kept + 1] = b, mesh.indices[3 * kept + 2] = c;
    ++kept;
  }
  mesh.degenerate_dropped += triangles - kept;
  mesh.indices.resize(3 * kept);
  if (!mesh.face_colours.empty()) mesh.face_colours.resize(kept);
}

bool has_direction(const glm::vec3& n) {
  return std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z) &&
         std::abs(n.x) + std::abs(n.y) + std::abs(n.z) > 1e-20f;
}

// Normals of any length keep their precision in float if their largest component is near 1.
uint32_t encode(const glm::vec3& n) {
  const float largest = std::max({std::abs(n.x), std::abs(n.y), std::abs(n.z)});
  return largest > 0 ? image::encode_normal32(n / largest) : image::encode_normal32({0, 1, 0});
}

void set_normals(PlacedMesh& placed, const std::vector<glm::vec3>& from_file, const glm::mat3& rotation) {
  placed.normals.resize(placed.positions_room.size());
  std::vector<glm::vec3> computed;
  if (!std::all_of(from_file.begin(), from_file.end(), has_direction)) {
    std::vector<uint32_t> indices = placed.indices;
    computed = smooth_normals(placed.positions_room, kNoCrease_deg, indices).normals;
  }
  parallel(placed.normals.size(), [&](size_t i) {
    placed.normals[i] = encode(has_direction(from_file[i]) ? rotation * from_file[i] : computed[i]);
  });
}

uint32_t append_copy(PlacedMesh& placed, uint32_t vertex) {
  placed.positions_room.push_back(glm::vec3(placed.positions_room[vertex]));
  if (!placed.colours.empty()) placed.colours.push_back(uint32_t(placed.colours[vertex]));
  return uint32_t(placed.positions_room.size() - 1);
}

// Makes normals where the file has none: splits vertices at creases. copy_of: as in Mesh.
void make_normals(PlacedMesh& placed, double crease_deg, const std::vector<uint32_t>& copy_of) {
  const size_t originals = placed.positions_room.size() - copy_of.size();
  const std::vector<uint32_t> looks = copy_of.empty() ? std::vector<uint32_t>() : placed.indices;
  for (uint32_t& index : placed.indices)
    if (index >= originals) index = copy_of[index - originals];
  SmoothNormals smooth = smooth_normals(placed.positions_room, crease_deg, placed.indices);
  for (const uint32_t vertex : smooth.copies) append_copy(placed, vertex);
  std::unordered_map<uint64_t, uint32_t> of_look;  // copies by normal and colour
  for (size_t corner = 0; corner < looks.size(); ++corner) {
    uint32_t& index = placed.indices[corner];
    const uint32_t normal = index, colour = placed.colours[looks[corner]];
    if (placed.colours[index] == colour) continue;
    const auto [found, is_new] =
        of_look.try_emplace(uint64_t{normal} << 32 | colour, uint32_t(placed.positions_room.size()));
    if (is_new) {
      placed.colours[append_copy(placed, normal)] = colour;
      smooth.normals.push_back(glm::vec3(smooth.normals[normal]));
    }
    index = found->second;
  }
  placed.normals.resize(smooth.normals.size());
  parallel(placed.normals.size(), [&](size_t i) { placed.normals[i] = encode(smooth.normals[i]); });
}

// Takes the array that colours the mesh, if any.
void take_scalars(Mesh& mesh, PlacedMesh& placed) {
  placed.scalars = !mesh.scalars.empty();
  std::vector<uint32_t>& bits = mesh.scalars_of_faces ? placed.face_colours : placed.colours;
  bits.resize(mesh.scalars.size());
  parallel(bits.size(), [&](size_t i) { bits[i] = std::bit_cast<uint32_t>(mesh.scalars[i]); });
  mesh.scalars = {};
}

}  // namespace

// Marching cubes puts its vertices on the edges of the voxel grid: two coordinates are those of grid planes and so
// shared with many other vertices, the third lies in between and is shared with few. Scans share no coordinates, CAD
// models mostly all three.
bool is_isosurface(const Mesh& mesh) {
  constexpr size_t kSamples = 1 << 16, kFewest = 2000;
  const size_t vertices = mesh.positions.size(), step = std::max<size_t>(vertices / kSamples, 1);
  if (vertices < kFewest) return false;
  std::vector<double> values[3];
  for (size_t v = 0; v < vertices; v += step)
    for (int a = 0; a < 3; ++a) values[a].push_back(mesh.positions[v][a]);
  const std::vector<bool> shared[3] = {repeated(values[0]), repeated(values[1]), repeated(values[2])};
  size_t two_or_more = 0, exactly_two = 0;
  for (size_t i = 0; i < values[0].size(); ++i) {
    const int count = shared[0][i] + shared[1][i] + shared[2][i];
    two_or_more += count >= 2;
    exactly_two += count == 2;
  }
  return 10 * two_or_more >= 9 * values[0].size() && 2 * exactly_two >= values[0].size();
}

UpGuess guess_up(const Mesh& mesh) {
  if (mesh.format == "raster") return {"z", "an elevation raster"};
  if (mesh.format == "iso") return {"z", "the surface of a volume"};
  const scene::Space space = mesh.coordinates.space;
  if (space == scene::Space::kProjected || space == scene::Space::kGeographic) return {"z", "heights over a map"};
  if (is_cloud(mesh.format) && !mesh.format.starts_with("PLY")) return {"z", "a survey or laser scan"};
  geometry::DBox box;
  for (uint32_t i : mesh.indices) box.extend(mesh.positions[i]);
  if (vtk::is_mesh_kind(mesh.format)) return {"z", "VTK's formats hold scans and simulations"};
  if (is_height_field(mesh, box.size())) return {"z", "shaped like a terrain"};
  if (is_isosurface(mesh)) return {"z", "its vertices lie on a voxel grid, as a scan's surface does"};
  return {"y", "nothing tells of a terrain or a scan"};
}

Result<Placing> find_placing(const Mesh& mesh, const geometry::DBox& used, const PlacementOptions& options,
                             const std::string& name) {
  Placing out;
  const UpGuess guess = options.up == "auto" ? guess_up(mesh) : UpGuess{options.up, "--up"};
  out.up = guess.axis, out.up_reason = guess.reason;
  const auto rotation = rotation_for_up(out.up, mesh.coordinates.space);
  if (!rotation) return rotation.error();
  out.rotation = *rotation;
  out.smooth = mesh.smooth || (mesh.normals.empty() && is_isosurface(mesh));
  const geometry::DBox frame = mesh.frame.value_or(used);
  const glm::dvec3 size = frame.size();
  const double largest = std::max({size.x, size.y, size.z});
  if (!(largest >= 1e-30 && largest <= 1e30))
    return Error{fmt::format("{}: its largest extent is {}, outside [1e-30, 1e30]", name, largest)};
  out.centre = frame.lo + size * 0.5;
  out.scale = options.room_size_m / largest;
  return out;
}

PlacedMesh place(Mesh&& mesh, const Placing& placing, double crease_deg) {
  PlacedMesh placed;
  placed.placing = placing;
  placed.box_data = box_of_used(mesh);
  // Vertices without triangles may lie anywhere; they are not kept, so their placement does not matter.
  placed.positions_room.resize(mesh.positions.size());
  parallel(mesh.positions.size(), [&](size_t i) { placed.positions_room[i] = placing.room(mesh.positions[i]); });
  mesh.positions = {};
  placed.indices = std::move(mesh.indices);
  placed.degenerate_dropped = mesh.degenerate_dropped;
  take_scalars(mesh, placed);
  drop_degenerate(placed);
  if (placed.indices.empty()) return placed;
  for (uint32_t i : placed.indices) placed.box_room.extend(placed.positions_room[i]);

  if (!placed.scalars) placed.colours = std::move(mesh.colours);
  if (mesh.normals.empty())
    make_normals(placed, placing.smooth ? kNoCrease_deg : crease_deg,
                 placed.colours.empty() ? std::vector<uint32_t>() : mesh.copy_of);
  else
    set_normals(placed, mesh.normals, glm::mat3(placing.rotation));
  if (placed.colours.empty() && placed.face_colours.empty())
    placed.colours.assign(placed.positions_room.size(), kNeutralAlbedo);
  return placed;
}

Result<PlacedMesh> place_mesh(Mesh&& mesh, const PlacementOptions& options, const std::string& name) {
  const auto placing = find_placing(mesh, box_of_used(mesh), options, name);
  if (!placing) return placing.error();
  PlacedMesh placed = place(std::move(mesh), *placing, options.crease_deg);
  if (placed.indices.empty())
    return Error{fmt::format("{}: all its {} triangles are degenerate (no area)", name, placed.degenerate_dropped)};
  return placed;
}

}  // namespace telesplat::data
