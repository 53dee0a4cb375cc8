#include "services/packer/points/base/base.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <queue>

#include "common/geometry/camera.h"
#include "common/geometry/chunk_code.h"
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

void put_word(size_t index, uint64_t word, std::vector<uint32_t>& out) {
  for (const uint64_t number : {uint64_t{index}, word & 0xffffffff, word >> 32})
    out.push_back(static_cast<uint32_t>(number));
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

double distance(const geometry::Box& box, const glm::dvec3& from) {
  const glm::dvec3 nearest = glm::clamp(from, glm::dvec3(box.lo), glm::dvec3(box.hi));
  return glm::length(from - nearest);
}

}  // namespace

BaseChunks choose_base(const std::vector<geometry::ChunkInfo>& tree, uint64_t most) {
  std::vector<bool> is_child(tree.size());
  for (const auto& node : tree)
    for (size_t i = node.first_child; i < std::min<size_t>(node.first_child + node.children, tree.size()); ++i)
      is_child[i] = true;
  const auto finer = [&](size_t a, size_t b) { return tree[a].spacing_m < tree[b].spacing_m; };
  std::priority_queue<size_t, std::vector<size_t>, decltype(finer)> open(finer);
  BaseChunks out;
  uint64_t triangles = 0;
  for (size_t i = 0; i < tree.size(); ++i) {
    if (is_child[i]) continue;
    open.push(i);
    triangles += tree[i].triangles;
    out.coarse.push_back(tree[i].id);
  }
  while (!open.empty()) {
    const geometry::ChunkInfo& node = tree[open.top()];
    open.pop();
    uint64_t below = 0;
    for (uint32_t i = 0; i < node.children; ++i) below += tree[node.first_child + i].triangles;
    if (below <= node.triangles || triangles - node.triangles + below > most) {
      out.fine.push_back(node.id);
      continue;
    }
    triangles += below - node.triangles;
    for (uint32_t i = 0; i < node.children; ++i) open.push(node.first_child + i);
  }
  std::ranges::sort(out.fine);
  if (out.fine == out.coarse) out.coarse.clear();
  return out;
}

Base::Base(float largest_m, const scene::ColourTable* colours)
    : step_m_(std::exp2(std::ceil(std::log2(largest_m / kSteps)))), colours_(colours) {}

void Base::add(const geometry::MeshChunkView& chunk, float spacing_m, bool coarse) {
  for (size_t first = 0; first < chunk.triangles(); first += wire::kBasePart)
    add_part(chunk, first, std::min<size_t>(wire::kBasePart, chunk.triangles() - first), spacing_m);
  if (coarse)
    coarse_ = parts_.size();
  else
    triangles_ += chunk.triangles();
  hidden_.resize(parts_.size() * (wire::kBasePart / 64));
  told_.resize(hidden_.size());
}

void Base::add_part(const geometry::MeshChunkView& chunk, size_t first, size_t count, float spacing_m) {
  Part& part = parts_.emplace_back();
  part.error_m = spacing_m + step_m_;
  std::vector<float> positions;
  std::vector<uint32_t> normals, colours, indices;
  const auto corners = chunk.indices.subspan(3 * first, 3 * count);
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
  part.side_m = std::sqrt(2 * area_m2 / static_cast<float>(count));
  if (spacing_m == 0) part.corners.clear();
  const auto laid_out = geometry::build_chunk(positions, normals, colours, indices);
  const auto view = *geometry::MeshChunkView::validate(laid_out);
  part.box = view.box_room;
  part.code = geometry::encode_chunk(view);
}

void Base::set_hidden(size_t i, bool hidden) {
  const uint64_t bit = uint64_t{1} << i % 64;
  hidden_[i / 64] = hidden ? hidden_[i / 64] | bit : hidden_[i / 64] & ~bit;
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
  for (size_t n = coarse_; n < parts_.size(); ++n) {
    const Part& part = parts_[n];
    if (!frustum.may_contain(part.box)) continue;
    const double side_px = double{part.side_m} / double{look.pixel};  // at a depth of 1 m
    if (kLeastSide_px * distance(part.box, tile.camera.pose.position_room) > side_px) continue;
    for (size_t i = 0; i < part.corners.size() / 3; ++i)
      if (const size_t number = n * wire::kBasePart + i; !is_hidden(number))
        if (look.is_passed(&part.corners[3 * i], part.error_m)) set_hidden(number, true);
  }
}

void Base::show(const geometry::Box& box) {
  for (size_t n = coarse_; n < parts_.size(); ++n) {
    const Part& part = parts_[n];
    if (glm::any(glm::lessThan(part.box.hi, box.lo)) || glm::any(glm::lessThan(box.hi, part.box.lo))) continue;
    for (size_t i = 0; i < part.corners.size() / 3; ++i) {
      const glm::vec3 middle = (part.corners[3 * i] + part.corners[3 * i + 1] + part.corners[3 * i + 2]) / 3.0f;
      if (glm::all(glm::lessThanEqual(box.lo, middle)) && glm::all(glm::lessThanEqual(middle, box.hi)))
        set_hidden(n * wire::kBasePart + i, false);
    }
  }
}

void Base::show_all() { hidden_.assign(hidden_.size(), 0); }

std::vector<uint32_t> Base::take_changes() {
  std::vector<uint32_t> out;
  for (size_t i = 0; i < hidden_.size(); ++i)
    if (hidden_[i] != told_[i]) put_word(i, told_[i] = hidden_[i], out);
  return out;
}

std::vector<uint32_t> Base::hidden() const {
  std::vector<uint32_t> out;
  for (size_t i = 0; i < hidden_.size(); ++i)
    if (hidden_[i] != 0) put_word(i, hidden_[i], out);
  return out;
}

}  // namespace telesplat::packer
