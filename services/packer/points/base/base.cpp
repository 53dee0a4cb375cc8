#include "services/packer/points/base/base.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <utility>

#include "common/geometry/camera.h"
#include "common/geometry/chunk_code.h"
#include "common/splat/base_mesh.h"
#include "common/wire/limits.h"

namespace telesplat::packer {
namespace {

// Steps of positions along the largest side of the mesh.
constexpr float kSteps = 1 << 16;
// Upper bits of both coordinates of a normal: half a degree.
constexpr uint32_t kNormalBits = 0xff00ff00;
// A ray has passed a triangle if it ends this part of its depth behind it, and farther from its plane than the error.
constexpr float kBehind = 0.02f;
// Triangles with smaller sides are not looked at: rays beside them would count.
constexpr double kLeastSide_px = 4;

void put_word(uint64_t index, uint64_t word, std::vector<uint32_t>& out) {
  for (const uint64_t number : {index, word & 0xffffffff, word >> 32}) out.push_back(static_cast<uint32_t>(number));
}

// Rays of a tile.
class Rays {
 public:
  static constexpr float kNotCast = -1;  ///< in place of a depth

  Rays(const SampledTile& tile, const image::PixelMask* cast)
      : tile_(tile), cast_(cast), scale_(static_cast<float>(tile.camera.near_m * image::kMaxDepthCode)) {}

  /// Depth at which a pixel's ray ended, metres; +infinity: it met nothing.
  float at(int x, int y) const {
    if (x < 0 || y < 0 || x >= tile_.rect.width || y >= tile_.rect.height || (cast_ && !cast_->at(x, y)))
      return kNotCast;
    const uint32_t code = tile_.image.depth[static_cast<size_t>(y) * static_cast<size_t>(tile_.rect.width) + x];
    return code == 0 ? std::numeric_limits<float>::infinity() : scale_ / static_cast<float>(code);
  }

 private:
  const SampledTile& tile_;
  const image::PixelMask* cast_;
  float scale_;
};

// Returns the corners of a chunk's triangles, three each, in an order in which neighbours follow each other: along a
// Z curve through their centroids.
std::vector<uint32_t> in_order(const geometry::MeshChunkView& chunk) {
  constexpr float kCells = 1023;
  const glm::vec3 size = chunk.box_room.size();
  const float side = std::max({size.x, size.y, size.z, std::numeric_limits<float>::min()});
  std::vector<std::pair<uint32_t, uint32_t>> order;  // place on the curve, triangle
  for (uint32_t t = 0; t < chunk.triangles(); ++t) {
    glm::vec3 middle(0);
    for (size_t k = 0; k < 3; ++k) {
      const float* p = &chunk.positions_room[3 * size_t{chunk.indices[3 * size_t{t} + k]}];
      middle += glm::vec3(p[0], p[1], p[2]) / 3.0f;
    }
    const glm::uvec3 cell(glm::clamp((middle - chunk.box_room.lo) / side, 0.0f, 1.0f) * kCells);
    uint32_t place = 0;
    for (uint32_t bit = 0; bit < 10; ++bit)
      for (int axis = 0; axis < 3; ++axis) place |= (cell[axis] >> bit & 1) << (3 * bit + static_cast<uint32_t>(axis));
    order.emplace_back(place, t);
  }
  std::ranges::sort(order);
  std::vector<uint32_t> out;
  for (const auto& [place, t] : order)
    for (size_t k = 0; k < 3; ++k) out.push_back(chunk.indices[3 * size_t{t} + k]);
  return out;
}

}  // namespace

Base::Base(std::vector<geometry::ChunkInfo> nodes, float largest_m, const scene::ColourTable* colours)
    : nodes_(std::move(nodes)),
      first_part_(wire::first_base_parts(nodes_)),
      step_m_(std::exp2(std::ceil(std::log2(largest_m / kSteps)))),
      colours_(colours) {}

uint32_t Base::node_of(uint64_t part) const {
  return static_cast<uint32_t>(std::ranges::upper_bound(first_part_, part) - first_part_.begin() - 1);
}

bool Base::add(uint32_t node, const geometry::MeshChunkView& chunk) {
  if (chunk.triangles() != nodes_[node].triangles || chunk.scalars != (colours_ != nullptr)) return false;
  if (has(node)) return true;
  Held& held = held_[node];
  const auto corners = in_order(chunk);
  for (size_t first = 0; first < corners.size(); first += 3 * wire::kBasePart) {
    const size_t count = std::min<size_t>(3 * wire::kBasePart, corners.size() - first);
    held.parts.push_back(make_part(chunk, std::span(corners).subspan(first, count), nodes_[node].is_leaf()));
  }
  held.used = ++uses_;
  triangles_ += chunk.triangles();
  return true;
}

void Base::keep_within(uint64_t most) {
  while (triangles_ > most && held_.size() > 1) {
    const auto oldest = std::ranges::min_element(held_, {}, [](const auto& h) { return h.second.used; });
    const uint32_t node = oldest->first;
    triangles_ -= nodes_[node].triangles;
    held_.erase(oldest);
    for (uint64_t part = first_part_[node]; part < first_part_[node + 1]; ++part)
      if (const auto hidden = hidden_.find(part); hidden != hidden_.end()) {
        for (size_t word = 0; word < kWords; ++word) set_word(part, hidden->second, word, 0);
        hidden_.erase(hidden);
      }
  }
}

wire::BasePart Base::part(uint64_t part) {
  const uint32_t node = node_of(part);
  Held& held = held_.at(node);
  held.used = ++uses_;
  return {{}, 0, part, held.parts[part - first_part_[node]].code};
}

Base::Part Base::make_part(const geometry::MeshChunkView& chunk, std::span<const uint32_t> corners, bool leaf) const {
  Part part;
  std::vector<float> positions;
  std::vector<uint32_t> normals, colours, indices;
  std::vector<uint32_t> used(corners.begin(), corners.end());
  std::ranges::sort(used);
  used.erase(std::ranges::unique(used).begin(), used.end());
  for (const uint32_t v : used) {
    for (size_t axis = 0; axis < 3; ++axis)
      positions.push_back(std::round(chunk.positions_room[3 * size_t{v} + axis] / step_m_) * step_m_);
    normals.push_back(chunk.normals[v] & kNormalBits);
    colours.push_back(colours_ ? colours_->at(std::bit_cast<float>(chunk.colours[v])) : chunk.colours[v] & 0xffffff);
  }
  for (const uint32_t v : corners) {
    const auto i = static_cast<size_t>(std::ranges::lower_bound(used, v) - used.begin());
    indices.push_back(static_cast<uint32_t>(i));
    part.corners.emplace_back(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
  }
  float area_m2 = 0;
  for (size_t i = 0; i < part.corners.size(); i += 3) {
    const glm::vec3* p = &part.corners[i];
    area_m2 += 0.5f * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  }
  part.side_m = std::sqrt(2 * area_m2 / static_cast<float>(corners.size() / 3));
  if (leaf) part.corners = {};
  const auto laid_out = geometry::build_chunk(positions, normals, colours, indices);
  const auto view = *geometry::MeshChunkView::validate(laid_out);
  part.box = view.box_room;
  part.code = geometry::encode_chunk(view);
  return part;
}

void Base::set_word(uint64_t part, Bits& bits, size_t word, uint64_t to) {
  if (std::exchange(bits[word], to) != to) changed_.insert(part * kWords + word);
}

// A tile as its rays look at triangles.
struct Base::Look {
  Look(const SampledTile& tile, const image::PixelMask* cast)
      : camera(geometry::crop(tile.camera, tile.rect)), eye(tile.camera.pose.position_room), rays(tile, cast) {
    const auto t = camera.room_to_pixel();
    x = glm::vec4(t.x), y = glm::vec4(t.y), w = glm::vec4(t.w);
    pixel = static_cast<float>(1 / std::min(camera.focal_x(), camera.focal_y()));
  }
  bool is_passed(const glm::vec3* corners, float error_m) const;

  geometry::Camera camera;
  glm::vec3 eye;
  Rays rays;
  glm::vec4 x, y, w;  // camera.room_to_pixel()
  float pixel;        // side of a pixel at a depth of 1 m
};

// Looks at rays through four places inside the triangle. True: more of them passed it than ended at it.
bool Base::Look::is_passed(const glm::vec3* c, float error_m) const {
  constexpr float kMost = 0.6f, kLeast = 0.2f;  // parts of the corners
  const glm::vec3 middle = (c[0] + c[1] + c[2]) / 3.0f;
  const glm::vec3 across = glm::cross(c[1] - c[0], c[2] - c[0]);
  const float length = glm::length(across), away = std::abs(glm::dot(across, middle - eye));
  if (!(away > 0)) return false;
  int passed = 0;
  const auto look_at = [&](const glm::vec3& p) {
    const float depth = glm::dot(glm::vec3(w), p) + w.w;
    if (!(depth >= static_cast<float>(camera.near_m))) return;
    const float u = (glm::dot(glm::vec3(x), p) + x.w) / depth, v = (glm::dot(glm::vec3(y), p) + y.w) / depth;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(camera.width) && v < static_cast<float>(camera.height))) return;
    // Depths of a plane that lies farther away are greater by the same factor everywhere.
    const float error = error_m + depth * pixel;
    const float behind = (1 + kBehind) * (away + error * length) / away, ended = rays.at(int(u), int(v));
    if (ended > behind * depth)
      ++passed;
    else if (ended > depth / behind)
      --passed;
  };
  look_at(middle);
  for (int k = 0; k < 3; ++k) look_at(kMost * c[k] + kLeast * (c[(k + 1) % 3] + c[(k + 2) % 3]));
  return passed > 0;
}

void Base::hide(const SampledTile& tile, const image::PixelMask* cast) {
  const Look look(tile, cast);
  const geometry::Frustum frustum(look.camera);
  for (auto& [node, held] : held_) {
    if (!frustum.may_contain(nodes_[node].box_room)) continue;
    held.used = ++uses_;
    if (nodes_[node].is_leaf()) continue;
    for (size_t n = 0; n < held.parts.size(); ++n) {
      const Part& part = held.parts[n];
      if (!frustum.may_contain(part.box)) continue;
      const double side_px = double{part.side_m} / double{look.pixel};  // at a depth of 1 m
      if (kLeastSide_px * splat::distance_m(part.box, tile.camera.pose.position_room) <= side_px)
        hide(first_part_[node] + n, part, nodes_[node].spacing_m + step_m_, look);
    }
  }
}

void Base::hide(uint64_t number, const Part& part, float error_m, const Look& look) {
  const auto known = hidden_.find(number);
  Bits bits = known == hidden_.end() ? Bits{} : known->second;
  bool any = false;
  for (size_t i = 0; i < part.corners.size() / 3; ++i) {
    const uint64_t bit = uint64_t{1} << i % 64;
    if (bits[i / 64] & bit || !look.is_passed(&part.corners[3 * i], error_m)) continue;
    set_word(number, bits, i / 64, bits[i / 64] | bit);
    any = true;
  }
  if (any) hidden_[number] = bits;
}

void Base::show(const geometry::Box& box) {
  for (auto& [number, bits] : hidden_) {
    const uint32_t node = node_of(number);
    const geometry::Box& around = nodes_[node].box_room;
    if (glm::any(glm::lessThan(around.hi, box.lo)) || glm::any(glm::lessThan(box.hi, around.lo))) continue;
    const Part& part = held_.at(node).parts[number - first_part_[node]];
    for (size_t i = 0; i < part.corners.size() / 3; ++i) {
      const uint64_t bit = uint64_t{1} << i % 64;
      if (!(bits[i / 64] & bit)) continue;
      const glm::vec3 middle = (part.corners[3 * i] + part.corners[3 * i + 1] + part.corners[3 * i + 2]) / 3.0f;
      if (glm::all(glm::lessThanEqual(box.lo, middle)) && glm::all(glm::lessThanEqual(middle, box.hi)))
        set_word(number, bits, i / 64, bits[i / 64] & ~bit);
    }
  }
  std::erase_if(hidden_, [](const auto& part) { return part.second == Bits{}; });
}

void Base::show_all() {
  for (auto& [number, bits] : hidden_)
    for (size_t word = 0; word < kWords; ++word) set_word(number, bits, word, 0);
  hidden_.clear();
}

std::vector<uint32_t> Base::take_changes() {
  std::vector<uint32_t> out;
  for (const uint64_t index : changed_) {
    const auto part = hidden_.find(index / kWords);
    put_word(index, part == hidden_.end() ? 0 : part->second[index % kWords], out);
  }
  changed_.clear();
  return out;
}

std::vector<uint32_t> Base::hidden() const {
  std::vector<uint32_t> out;
  for (const auto& [number, bits] : hidden_)
    for (size_t word = 0; word < kWords; ++word)
      if (bits[word] != 0) put_word(number * kWords + word, bits[word], out);
  return out;
}

}  // namespace telesplat::packer
