#include "tools/lab/simulation/scenes/surface_parts.h"

#include <optional>

#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"

namespace telesplat::simulation {
namespace {

constexpr double kMargin_m = 1e-6;  // margin of boxes, which are rounded to float

geometry::Box box_about(const glm::dvec3& lo, const glm::dvec3& hi) {
  return {glm::vec3(lo - kMargin_m), glm::vec3(hi + kMargin_m)};
}

SurfacePart sphere(size_t chunk, const glm::dvec3& centre, double radius, uint32_t colour, uint32_t other) {
  return {.centre = centre,
          .square = glm::dvec3(1),
          .linear = glm::dvec3(0),
          .constant = radius * radius,
          .box_room = box_about(centre - radius, centre + radius),
          .colours = {colour, other},
          .chunk = chunk};
}

// The part lo..hi of a plane across an axis; on that axis lo and hi are equal.
SurfacePart plane(size_t chunk, int axis, const glm::dvec3& lo, const glm::dvec3& hi, uint32_t colour, uint32_t other) {
  SurfacePart out{.centre = lo,
                  .square = glm::dvec3(0),
                  .linear = glm::dvec3(0),
                  .box_room = box_about(lo, hi),
                  .colours = {colour, other},
                  .chunk = chunk};
  out.linear[axis] = 1;
  return out;
}

std::vector<SurfacePart> spheres() {
  return {
      sphere(0, {-0.10, -0.05, 0.25}, 0.12, 0xd8a040, 0x8a5a20),
      sphere(1, {0.18, 0.10, 0.20}, 0.10, 0x4090d0, 0x205a90),
      sphere(2, {0.05, -0.20, 0.05}, 0.15, 0x60b060, 0x2a7030),
      sphere(3, {-0.20, 0.18, 0.00}, 0.16, 0xc05050, 0x802828),
      sphere(4, {0.22, -0.05, -0.10}, 0.17, 0xb080d0, 0x704a90),
      sphere(5, {-0.22, -0.22, -0.15}, 0.17, 0xe0e0d0, 0x909088),
      sphere(6, {0.00, 0.05, -0.22}, 0.18, 0x40b0a0, 0x1a6a60),
      sphere(7, {0.20, 0.22, -0.25}, 0.14, 0xd0c050, 0x807020),
  };
}

constexpr double kGround_m = -0.12;

// y = height (1 - (distance / radius)^2) above the ground, about (x, z).
SurfacePart hill(double x, double z, double height, double radius, uint32_t colour) {
  const double bend = height / (radius * radius);
  const size_t column = x < -0.4 / 3 ? 0 : x < 0.4 / 3 ? 1 : 2, row = z < 0 ? 0 : 1;
  return {.centre = {x, kGround_m, z},
          .square = {bend, 0, bend},
          .linear = {0, 1, 0},
          .constant = height,
          .box_room = box_about({x - radius, kGround_m, z - radius}, {x + radius, kGround_m + height, z + radius}),
          .colours = {colour, colour - 0x202020},
          .chunk = 3 * row + column};
}

std::vector<SurfacePart> terrain() {
  std::vector<SurfacePart> out;
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 3; ++column)
      out.push_back(plane(size_t(3 * row + column), 1, {-0.4 + column * 0.8 / 3, kGround_m, -0.4 + row * 0.4},
                          {-0.4 + (column + 1) * 0.8 / 3, kGround_m, row * 0.4}, 0x6a8a48, 0x5a7a3c));
  for (const SurfacePart& h : {hill(-0.25, -0.22, 0.22, 0.14, 0x9a8a70), hill(0.02, -0.20, 0.12, 0.18, 0x8a9a60),
                               hill(0.26, -0.24, 0.26, 0.13, 0xa09080), hill(-0.18, 0.10, 0.08, 0.16, 0x7a9a50),
                               hill(0.10, 0.16, 0.15, 0.12, 0x94846a), hill(0.28, 0.24, 0.05, 0.10, 0x8aa058),
                               hill(-0.05, -0.02, 0.05, 0.09, 0x82925c)})
    out.push_back(h);
  return out;
}

std::vector<SurfacePart> fence() {
  constexpr double kPitch_m = 0.02, kWidth_m = 0.0015, kCable_m = 0.0005;
  constexpr uint32_t kColours[] = {0xe0d0b0, 0xc0a070, 0xb08050, 0x907048};
  std::vector<SurfacePart> out;
  for (size_t row = 0; row < 4; ++row) {
    const double z = 0.3 - 0.17 * double(row);
    out.push_back(plane(row, 2, {-0.4, -0.3, z}, {0.4, 0.3, z}, kColours[row], kColours[row] - 0x202020));
    out.back().pitch = kPitch_m, out.back().width = kWidth_m;
  }
  for (const double y : {-0.11, 0.13})
    out.push_back({.centre = {0, y, 0.2},
                   .square = {0, 1, 1},
                   .linear = glm::dvec3(0),
                   .constant = kCable_m * kCable_m,
                   .box_room = box_about({-0.4, y - kCable_m, 0.2 - kCable_m}, {0.4, y + kCable_m, 0.2 + kCable_m}),
                   .colours = {0xf0f0f0, 0x303030},
                   .chunk = 4});
  out.push_back(plane(5, 2, {-0.4, -0.35, -0.4}, {0.4, 0.35, -0.4}, 0x5070a0, 0x405880));
  return out;
}

// A rectangle from edge to edge of each part's box.
// chunk: nullopt: all of them.
std::vector<std::byte> chunk_bytes_of(const std::vector<SurfacePart>& parts, std::optional<size_t> chunk) {
  std::vector<float> positions;
  std::vector<uint32_t> normals, colours, indices;
  for (const SurfacePart& part : parts) {
    if (chunk && part.chunk != *chunk) continue;
    const auto& [lo, hi] = part.box_room;
    const auto first = uint32_t(normals.size());
    for (const glm::vec3& corner : {lo, glm::vec3(hi.x, lo.y, hi.z), hi, glm::vec3(lo.x, hi.y, lo.z)})
      positions.insert(positions.end(), {corner.x, corner.y, corner.z});
    normals.insert(normals.end(), 4, image::encode_normal32({0, 0, 1}));
    colours.insert(colours.end(), 4, part.colours[0]);
    for (const uint32_t corner : {0, 1, 2, 0, 2, 3}) indices.push_back(first + corner);
  }
  const auto laid_out = geometry::build_chunk(positions, normals, colours, indices);
  return geometry::encode_chunk(*geometry::MeshChunkView::validate(laid_out));
}

SurfaceParts make(std::vector<SurfacePart> parts) {
  SurfaceParts out{.parts = std::move(parts)};
  for (const SurfacePart& part : out.parts) {
    while (out.chunks.size() <= part.chunk) out.chunks.push_back({.id = {out.chunks.size()}});
    geometry::ChunkInfo& chunk = out.chunks[part.chunk];
    chunk.box_room.extend(part.box_room);
    chunk.triangles += 2;
    out.box_room.extend(part.box_room);
    out.triangles += 2;
  }
  for (geometry::ChunkInfo& chunk : out.chunks) {
    out.bytes.push_back(chunk_bytes_of(out.parts, size_t(chunk.id.value)));
    chunk.bytes = out.bytes.back().size();
  }
  // The root stands in for chunks that have not come, and never belongs into a view.
  const auto leaves = static_cast<uint32_t>(out.chunks.size());
  out.bytes.push_back(chunk_bytes_of(out.parts, std::nullopt));
  out.chunks.push_back({.id = {leaves},
                        .box_room = out.box_room,
                        .triangles = out.triangles,
                        .bytes = out.bytes.back().size(),
                        .spacing_m = 1000,
                        .first_child = 0,
                        .children = leaves});
  return out;
}

}  // namespace

const SurfaceParts& parts_of(Surface surface) {
  static const SurfaceParts all[] = {make(spheres()), make(terrain()), make(fence())};
  return all[size_t(surface)];
}

}  // namespace telesplat::simulation
