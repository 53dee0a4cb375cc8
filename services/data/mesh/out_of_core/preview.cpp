#include "services/data/mesh/out_of_core/preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>

#include "common/core/clock.h"
#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"
#include "common/parallel/in_parallel.h"
#include "services/data/base/mesh.h"
#include "services/data/cloud/square.h"
#include "services/data/mesh/out_of_core/build.h"
#include "services/data/mesh/out_of_core/surfels.h"

namespace telesplat::data {
namespace {

bool is_finite(const glm::vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Box of all vertices: it is that of the triangles unless the file has vertices without one.
geometry::DBox box_of(const RandomMesh& mesh) {
  const auto turn = [&](const tbb::blocked_range<uint64_t>& range, geometry::DBox box) {
    for (uint64_t v = range.begin(); v < range.end(); ++v)
      if (const glm::dvec3 p = mesh.position(v); std::isfinite(p.x + p.y + p.z)) box.extend(p);
    return box;
  };
  const auto join = [](geometry::DBox a, const geometry::DBox& b) {
    a.extend(b);
    return a;
  };
  return sum_in_parallel(tbb::blocked_range<uint64_t>(0, mesh.vertices(), 1 << 16), geometry::DBox(), turn, join);
}

// Triangles without common vertices, in the room.
class Soup {
 public:
  Soup(const RandomMesh& mesh, const Placing& placing) : mesh_(mesh), placing_(placing) {}

  /// Adds a triangle; damaged ones are left out.
  void add(uint64_t triangle) {
    uint32_t corners[3];
    if (!mesh_.corners(triangle, 1, corners)) return;
    glm::vec3 p[3];
    for (int k = 0; k < 3; ++k) {
      if (corners[k] >= mesh_.vertices()) return;
      p[k] = placing_.room(mesh_.position(corners[k]));
      if (!is_finite(p[k])) return;
    }
    const glm::vec3 across = glm::cross(p[1] - p[0], p[2] - p[0]);
    if (!(glm::length(across) > 0)) return;
    const uint32_t flat = image::encode_normal32(glm::normalize(across));
    for (int k = 0; k < 3; ++k) {
      positions_.insert(positions_.end(), {p[k].x, p[k].y, p[k].z});
      normals_.push_back(normal_of(corners[k], flat));
      colours_.push_back(colour_of(corners[k]));
    }
  }
  size_t triangles() const { return normals_.size() / 3; }
  /// The triangles in chunks of at most this number.
  std::vector<std::vector<std::byte>> chunks(size_t most) const {
    std::vector<std::vector<std::byte>> out;
    std::vector<uint32_t> indices(3 * most);
    for (uint32_t i = 0; i < indices.size(); ++i) indices[i] = i;
    for (size_t first = 0; first < normals_.size(); first += 3 * most) {
      const size_t count = std::min(3 * most, normals_.size() - first);
      out.push_back(geometry::build_chunk(
          std::span(positions_).subspan(3 * first, 3 * count), std::span(normals_).subspan(first, count),
          std::span(colours_).subspan(first, count), std::span(indices).first(count), mesh_.facts().scalars));
    }
    return out;
  }

 private:
  uint32_t normal_of(uint32_t vertex, uint32_t flat) const {
    if (!mesh_.facts().normals) return flat;
    const glm::vec3 n = glm::mat3(placing_.rotation) * mesh_.normal(vertex);
    return is_finite(n) && glm::length(n) > 1e-20f ? image::encode_normal32(glm::normalize(n)) : flat;
  }
  uint32_t colour_of(uint32_t vertex) const {
    if (mesh_.facts().scalars) return std::bit_cast<uint32_t>(mesh_.scalar(vertex));
    return mesh_.facts().colours ? mesh_.colour(vertex) : kNeutralAlbedo;
  }

  const RandomMesh& mesh_;
  const Placing& placing_;
  std::vector<float> positions_;
  std::vector<uint32_t> normals_, colours_;
};

// Reads every 4096th triangle, then those between them, and so on, until there are enough or time is up.
void read_spread(const RandomMesh& mesh, const PreviewOptions& options, Soup& out) {
  constexpr uint32_t kBits = 12, kStep = 1 << kBits;
  const double end_s = monotonic_s() + options.most_s;
  for (uint32_t round = 0; round < kStep; ++round) {
    uint32_t offset = 0;
    for (uint32_t bit = 0; bit < kBits; ++bit) offset |= (round >> bit & 1) << (kBits - 1 - bit);
    for (uint64_t t = offset; t < mesh.triangles(); t += kStep) out.add(t);
    if (out.triangles() >= options.most_triangles || monotonic_s() > end_s) return;
  }
}

// A square for each surfel, so wide that those of neighbouring cells overlap.
PlacedMesh squares(const Surfels& surfels, bool scalars) {
  PlacedMesh out;
  out.scalars = scalars;
  const float half = 0.75f * surfels.spacing_m;
  for (size_t i = 0; i < surfels.positions.size(); ++i) {
    const auto first = static_cast<uint32_t>(out.positions_room.size());
    for (const glm::vec3& corner : square_around(image::decode_normal32(surfels.normals[i]), half)) {
      out.positions_room.push_back(surfels.positions[i] + corner);
      out.normals.push_back(surfels.normals[i]);
      out.colours.push_back(surfels.colours[i]);
    }
    for (const uint32_t corner : kSquare) out.indices.push_back(first + corner);
  }
  return out;
}

}  // namespace

Result<std::shared_ptr<MeshStore>> make_preview(const std::string& path, const RandomMesh& mesh,
                                                const PreviewOptions& options) {
  MeshStoreInfo info;
  info.box_data = box_of(mesh);
  const auto placing = find_placing(spread_sample(mesh), info.box_data, options.store, path);
  if (!placing) return placing.error();
  Soup soup(mesh, *placing);
  read_spread(mesh, options, soup);
  mesh.drop_pages();
  if (soup.triangles() == 0) return Error{fmt::format("{}: none of the triangles that were looked at is whole", path)};
  const auto chunks = soup.chunks(1 << 16);
  std::vector<geometry::MeshChunkView> views;
  for (const auto& chunk : chunks) views.push_back(*geometry::MeshChunkView::validate(chunk));
  const glm::dvec3 half = info.box_data.size() * 0.5;
  const glm::vec3 lo = placing->room(placing->centre - half), hi = placing->room(placing->centre + half);
  info.box_room = {glm::min(lo, hi), glm::max(lo, hi)};
  const auto surfels = make_surfels(views, info.box_room, std::clamp<size_t>(soup.triangles() / 6, 1000, 1 << 17));
  const PlacedMesh placed = squares(surfels, mesh.facts().scalars);
  const RandomMesh::Facts& facts = mesh.facts();
  info.format = facts.format, info.arrays = facts.arrays, info.array = options.array;
  info.coordinates = facts.coordinates;
  info.vertices = mesh.vertices(), info.triangles = mesh.triangles();
  info.had_normals = facts.normals, info.had_colours = facts.colours;
  info.up = placing->up, info.up_reason = placing->up_reason;
  info.content_hash = mesh.vertices() ^ mesh.triangles() << 32;  // no file's content: another one follows it
  return MeshStore::keep(path, placed, info);
}

Result<std::shared_ptr<MeshStore>> keep_preview(const std::string& path, Mesh&& mesh, const StoreOptions& options) {
  MeshStoreInfo info;
  info.format = mesh.format, info.coordinates = mesh.coordinates;
  info.vertices = mesh.positions.size(), info.had_colours = !mesh.colours.empty();
  const auto placed = place_mesh(std::move(mesh), options, path);
  if (!placed) return placed.error();
  info.triangles = info.content_hash = placed->indices.size() / 3;
  info.box_data = placed->box_data, info.box_room = placed->box_room;
  info.up = placed->placing.up, info.up_reason = placed->placing.up_reason;
  return MeshStore::keep(path, *placed, info);
}

}  // namespace telesplat::data
