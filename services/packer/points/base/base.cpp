#include "services/packer/points/base/base.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/codec/surfel_codec.h"
#include "common/image/normal.h"
#include "common/wire/limits.h"

namespace telesplat::packer {
namespace {

// Rays hide surfels where they lie at most this many of the surfels' spacings apart, at the surfels' depth.
constexpr double kFineness = 1.0;
// A ray that ends at most this part of the spacing before a surfel counts as having reached it.
constexpr float kReach = 0.5f;
// Radius around a surfel in which rays are looked at, in spacings; and in pixels, at least.
constexpr float kAround = 0.75f, kAround_px = 1.5f;
// A ray has passed a surfel's plane if it ends this part of its depth, and of the spacing, behind it.
constexpr float kBehind = 0.02f, kBehindSpacings = 0.5f;

struct Placed {
  uint32_t key, place;  // leaf, and place in it
  uint32_t surfel;      // number in the set
  codec::LeafSurfel coded;
};

std::vector<Placed> placed(const geometry::SurfelView& set, const points::OctreeGrid& grid,
                           const scene::ColourTable* colours) {
  std::vector<Placed> out;
  out.reserve(set.size());
  const double last = (1 << grid.depth) - 1;
  for (uint32_t i = 0; i < set.size(); ++i) {
    const float* p = &set.positions_room[3 * size_t{i}];
    const glm::dvec3 at = (glm::dvec3(double(p[0]), double(p[1]), double(p[2])) - grid.lo) / grid.leaf_size;
    uint32_t key = 0;
    uint8_t steps[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double leaf = std::clamp(std::floor(at[axis]), 0.0, last);
      key |= static_cast<uint32_t>(leaf) << (10 * axis);
      steps[axis] = static_cast<uint8_t>(std::clamp((at[axis] - leaf) * 256, 0.0, 255.0));
    }
    const uint32_t colour = colours ? colours->at(std::bit_cast<float>(set.colours[i])) : set.colours[i] & 0xffffff;
    codec::LeafSurfel coded{steps[0], steps[1], steps[2],
                            image::encode_normal16(image::decode_normal32(set.normals[i])), colour};
    out.push_back({key, coded.place(), i, coded});
  }
  std::ranges::sort(out, {}, [](const Placed& s) { return std::tuple(s.key, s.place, s.surfel); });
  const auto doubles = std::ranges::unique(out, {}, [](const Placed& s) { return std::pair(s.key, s.place); });
  out.erase(doubles.begin(), doubles.end());
  return out;
}

// Codes every stride-th surfel of [first, last). Each leaf's number is that of its first surfel.
std::vector<uint8_t> coded(std::span<const Placed> all, size_t first, size_t last, size_t stride) {
  std::vector<codec::SurfelLeaf> leaves;
  for (size_t i = first; i < last; i += stride) {
    if (leaves.empty() || leaves.back().key != all[i].key) leaves.push_back({all[i].key, uint32_t(i), {}});
    leaves.back().surfels.push_back(all[i].coded);
  }
  return codec::encode_surfels(leaves);
}

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
  /// The farthest of the rays at a pixel and beside it.
  float farthest(int x, int y) const {
    float out = kNotCast;
    for (int j = y - 1; j <= y + 1; ++j)
      for (int i = x - 1; i <= x + 1; ++i) out = std::max(out, at(i, j));
    return out;
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

Base::Base(const geometry::SurfelView& set, const points::ModelConfig& model, const scene::ColourTable* colours)
    : config_{model.box_room, std::min(model.depth, kDepth), false}, spacing_m_(set.spacing_m) {
  const auto all = placed(set, points::octree_grid(config_), colours);
  for (const Placed& s : all) {
    const float* p = &set.positions_room[3 * size_t{s.surfel}];
    const glm::vec3 position(p[0], p[1], p[2]);
    if (leaves_.empty() || leaves_.back().key != s.key)
      leaves_.push_back({s.key, {}, static_cast<uint32_t>(positions_.size()), 0, 0});
    Leaf& leaf = leaves_.back();
    leaf.box.extend(position);
    ++leaf.count, ++leaf.shown;
    positions_.push_back(position);
    normals_.push_back(s.coded.normal);
  }
  hidden_.assign((all.size() + 63) / 64, 0);
  told_ = hidden_;
  parts_.push_back(coded(all, 0, all.size(), wire::kBaseStride));
  // A part has whole leaves.
  for (size_t i = 0; i < leaves_.size();) {
    const size_t first = leaves_[i].first;
    size_t last = first;
    for (; i < leaves_.size() && (last == first || last - first + leaves_[i].count <= kPart); ++i)
      last += leaves_[i].count;
    parts_.push_back(coded(all, first, last, 1));
  }
}

wire::BasePart Base::part(size_t part) const {
  return {.part = part,
          .parts = parts_.size(),
          .surfels = surfels(),
          .depth = static_cast<uint64_t>(config_.depth),
          .box_room = config_.box_room,
          .spacing_m = double{spacing_m_},
          .surfel_data = std::as_bytes(std::span(parts_[part]))};
}

void Base::flip(Leaf& leaf, size_t i) {
  hidden_[i / 64] ^= uint64_t{1} << i % 64;
  leaf.shown = is_hidden(i) ? leaf.shown - 1 : leaf.shown + 1;
}

// A tile as its rays look at surfels.
struct Base::Look {
  Look(const SampledTile& tile, const image::PixelMask* cast)
      : camera(geometry::crop(tile.camera, tile.rect)), eye(tile.camera.pose.position_room), rays(tile, cast) {
    const auto t = camera.room_to_pixel();
    x = glm::vec4(t.x), y = glm::vec4(t.y), w = glm::vec4(t.w);
  }
  geometry::Camera camera;
  glm::vec3 eye;
  Rays rays;
  glm::vec4 x, y, w;  // camera.room_to_pixel()
};

bool Base::is_passed(const Look& look, const glm::vec3& position, uint16_t normal, float farthest_m) const {
  static constexpr float kRing[][2] = {{0, 0},       {1, 0},        {-1, 0},       {0, 1},        {0, -1},
                                       {0.7f, 0.7f}, {-0.7f, 0.7f}, {0.7f, -0.7f}, {-0.7f, -0.7f}};
  const glm::vec4 p(position, 1);
  const float depth = glm::dot(look.w, p);
  if (depth < static_cast<float>(look.camera.near_m) || depth > farthest_m) return false;
  const float x = glm::dot(look.x, p) / depth, y = glm::dot(look.y, p) / depth;
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(look.camera.width) && y < static_cast<float>(look.camera.height)))
    return false;
  const auto pixel = [](float at) { return static_cast<int>(std::floor(at)); };
  if (look.rays.farthest(pixel(x), pixel(y)) < depth - kReach * spacing_m_) return false;
  const glm::vec3 n = image::octahedral16(normal);
  const float plane = glm::dot(n, position - look.eye);
  const float radius = std::max(kAround * spacing_m_ * static_cast<float>(look.camera.focal_x()) / depth, kAround_px);
  for (const auto& ring : kRing) {
    const int i = pixel(x + radius * ring[0]), j = pixel(y + radius * ring[1]);
    const float ended = look.rays.at(i, j);
    if (ended <= depth) continue;
    // The surfel's plane along that ray; of one that is seen edge-on, its own depth.
    const float along = glm::dot(n, glm::vec3(look.camera.unproject(i + 0.5, j + 0.5, 1)) - look.eye);
    const float met = along != 0 ? plane / along : depth;
    const float surface = met > depth && met < 2 * depth ? met : depth;
    if (ended > (1 + kBehind) * surface + kBehindSpacings * spacing_m_) return true;
  }
  return false;
}

void Base::hide(const SampledTile& tile, const image::PixelMask* cast) {
  const Look look(tile, cast);
  const geometry::Frustum frustum(look.camera);
  const double focal = std::min(look.camera.focal_x(), look.camera.focal_y());
  const double farthest = kFineness * static_cast<double>(spacing_m_) * focal;
  for (Leaf& leaf : leaves_) {
    if (leaf.shown == 0 || !frustum.may_contain(leaf.box)) continue;
    if (distance(leaf.box, tile.camera.pose.position_room) > farthest) continue;
    for (size_t i = leaf.first; i < leaf.first + leaf.count; ++i)
      if (!is_hidden(i) && is_passed(look, positions_[i], normals_[i], static_cast<float>(farthest))) flip(leaf, i);
  }
}

void Base::show(const geometry::Box& box) {
  for (Leaf& leaf : leaves_) {
    const bool apart = glm::any(glm::lessThan(leaf.box.hi, box.lo)) || glm::any(glm::lessThan(box.hi, leaf.box.lo));
    if (leaf.shown == leaf.count || apart) continue;
    for (size_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
      const glm::vec3& p = positions_[i];
      if (is_hidden(i) && glm::all(glm::lessThanEqual(box.lo, p)) && glm::all(glm::lessThanEqual(p, box.hi)))
        flip(leaf, i);
    }
  }
}

void Base::show_all() {
  hidden_.assign(hidden_.size(), 0);
  for (Leaf& leaf : leaves_) leaf.shown = leaf.count;
}

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
