// KnownEmpty::carve: descends the octree, down to cells only where seen and unseen space meet.
#include <tbb/task_arena.h>

#include <cstring>
#include <limits>

#include "common/core/check.h"
#include "common/parallel/in_parallel.h"
#include "services/packer/points/plan/known_empty.h"
#include "services/packer/points/plan/node_view.h"

namespace telesplat::packer {
namespace {

constexpr int kFirstBits = 2, kFirstSide = 1 << kFirstBits;  // pixels a side of the finest squares of the pyramid
constexpr int kMostRays = 16;  // pixels a side: for larger nodes single rays are not compared
constexpr float kFarthest = std::numeric_limits<float>::infinity();

// Depths of some pixels: the least of all rays, and the greatest of new rays.
struct Range {
  float lo = kFarthest, hi = 0;
  void add(float v) {  // NaN counts as 0
    const float depth = std::abs(v);
    lo = std::min(lo, depth > 0 ? depth : 0.0f);
    hi = std::max(hi, v > 0 ? v : 0.0f);
  }
  void add(const Range& r) { lo = std::min(lo, r.lo), hi = std::max(hi, r.hi); }
};

// Last column and row included.
struct PixelRect {
  int x0, y0, x1, y1;
};

// Least and greatest depth of squares of 4, 8, 16, ... pixels.
class DepthRanges {
 public:
  DepthRanges(const geometry::Camera& camera, std::span<const float> depth_m)
      : width_(camera.width), height_(camera.height), depth_m_(depth_m) {
    const auto squares = [](int pixels, int side) { return (pixels + side - 1) / side; };
    Level level{squares(width_, kFirstSide), squares(height_, kFirstSide), {}};
    level.ranges.resize(static_cast<size_t>(level.width) * level.height);
    in_parallel(0, level.height, [&](int y) { reduce_pixels(level, y); });
    while (level.width > 1 || level.height > 1) {
      Level next{squares(level.width, 2), squares(level.height, 2), {}};
      next.ranges.resize(static_cast<size_t>(next.width) * next.height);
      for (int y = 0; y < level.height; ++y)
        for (int x = 0; x < level.width; ++x) next.at(x / 2, y / 2).add(level.at(x, y));
      levels_.push_back(std::move(level));
      level = std::move(next);
    }
    levels_.push_back(std::move(level));
  }

  int width() const { return width_; }
  int height() const { return height_; }

  /// True if the pixel that holds the point (homogeneous pixels) is clear beyond it; false outside the image.
  bool behind(const glm::vec3& point) const {
    const float inverse = 1 / point.z, x = point.x * inverse, y = point.y * inverse;
    if (!(x >= 0 && x < static_cast<float>(width_) && y >= 0 && y < static_cast<float>(height_))) return false;
    return std::abs(depth_m_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)]) > point.z;
  }
  /// True if all of these pixels are clear beyond depth_m.
  bool all_behind(float depth_m, const PixelRect& r) const {
    for (int y = r.y0; y <= r.y1; ++y) {
      const float* row = depth_m_.data() + static_cast<size_t>(y) * width_;
      for (int x = r.x0; x <= r.x1; ++x)
        if (!(std::abs(row[x]) > depth_m)) return false;
    }
    return true;
  }
  static int longest(const PixelRect& r) { return std::max(r.x1 - r.x0, r.y1 - r.y0) + 1; }
  /// Returns the range of these pixels; for large rectangles it includes some around.
  Range of(const PixelRect& r) const {
    const auto [x0, y0, x1, y1] = r;
    Range out;
    if (longest(r) <= kFirstSide) {
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) out.add(depth_m_[static_cast<size_t>(y) * width_ + x]);
      return out;
    }
    size_t l = 0;
    while (l + 1 < levels_.size() && (kFirstSide << (l + 1)) < longest(r)) ++l;
    const Level& level = levels_[l];
    const int down = kFirstBits + static_cast<int>(l);
    for (int y = y0 >> down; y <= y1 >> down; ++y)
      for (int x = x0 >> down; x <= x1 >> down; ++x) out.add(level.at(x, y));
    return out;
  }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Range> ranges;
    Range& at(int x, int y) { return ranges[static_cast<size_t>(y) * width + x]; }
    const Range& at(int x, int y) const { return ranges[static_cast<size_t>(y) * width + x]; }
  };

  void reduce_pixels(Level& level, int row) const {
    for (int y = row * kFirstSide; y < std::min((row + 1) * kFirstSide, height_); ++y) {
      const float* depth = depth_m_.data() + static_cast<size_t>(y) * width_;
      for (int square = 0; square < level.width; ++square) {
        const int first = square * kFirstSide, last = std::min(first + kFirstSide, width_);
        Range range;
        for (int x = first; x < last; ++x) range.add(depth[x]);
        level.at(square, row).add(range);
      }
    }
  }

  int width_, height_;
  std::span<const float> depth_m_;
  std::vector<Level> levels_;
};

}  // namespace

class EmptyCarver {
 public:
  EmptyCarver(KnownEmpty& space, const NodeProjection& projection, const DepthRanges& clear)
      : space_(space), projection_(projection), clear_(clear) {}

  void visit(int level, uint32_t node, const glm::vec3& corner) const {
    if (level == KnownEmpty::kCellLevel && !clear_.behind(projection_.middle(level, corner))) return;
    const NodeView view = projection_.look(level, corner);
    if (view.behind) return;
    const auto width = static_cast<float>(clear_.width()), height = static_cast<float>(clear_.height());
    if (!(view.right > 0 && view.left < width && view.bottom > 0 && view.top < height)) return;
    const PixelRect touched{to_pixel(view.left, clear_.width() - 1), to_pixel(view.top, clear_.height() - 1),
                            to_pixel(view.right, clear_.width() - 1), to_pixel(view.bottom, clear_.height() - 1)};
    const bool whole = view.left >= 0 && view.right <= width && view.top >= 0 && view.bottom <= height;
    // A short block or cell at the image's border is judged by its part inside. A long one, as near the eye, is not:
    // the view did not see its part beyond the image.
    const bool decides =
        whole || view.small() || (level >= KnownEmpty::kBlockLevel && view.length() <= KnownEmpty::kFewPixels);
    if (level == KnownEmpty::kCellLevel) {
      if (decides && passed(view, touched)) see(level, node);
      return;
    }
    const Range range = clear_.of(touched);
    if (!(range.hi > view.nearest_m)) return;  // no new ray reached it
    if (decides && (range.lo > view.farthest_m || passed(view, touched)))
      see(level, node);
    else if (!view.small())
      descend(level, node, corner);
  }

  void descend(int level, uint32_t node, const glm::vec3& corner) const {
    const uint8_t children = space_.any_[static_cast<size_t>(level) + 1][node];
    for (int child = 0; child < 8; ++child)
      if (children >> child & 1)
        visit(level + 1, node << 3 | static_cast<uint32_t>(child), projection_.child(corner, level + 1, child));
  }

 private:
  // True if all rays through a small node go on behind it; without such rays, the one nearest its middle decides.
  bool passed(const NodeView& view, const PixelRect& touched) const {
    if (DepthRanges::longest(touched) > kMostRays) return clear_.of(touched).lo > view.farthest_m;
    PixelRect rays{to_pixel(view.left + 0.5f, clear_.width()), to_pixel(view.top + 0.5f, clear_.height()),
                   to_pixel(view.right + 0.5f, clear_.width()) - 1, to_pixel(view.bottom + 0.5f, clear_.height()) - 1};
    const float x = 0.5f * (view.left + view.right), y = 0.5f * (view.top + view.bottom);
    if (rays.x0 > rays.x1) rays.x0 = rays.x1 = to_pixel(x, clear_.width() - 1);
    if (rays.y0 > rays.y1) rays.y0 = rays.y1 = to_pixel(y, clear_.height() - 1);
    return clear_.all_behind(view.farthest_m, rays);
  }

  // Threads visit different nodes, whose cells lie in different bytes.
  void see(int level, uint32_t node) const {
    auto& cells = space_.any_[KnownEmpty::kCellLevel];
    if (level == KnownEmpty::kCellLevel) {
      cells[node >> 3] &= static_cast<uint8_t>(~(1u << (node & 7)));
      space_.dirty_[node >> (KnownEmpty::kDirtyShift + 3)] = 1;
      return;
    }
    const int down = 3 * (KnownEmpty::kBlockLevel - level);
    std::memset(cells.data() + (size_t{node} << down), 0, size_t{1} << down);
    const size_t first = (size_t{node} << down) >> KnownEmpty::kDirtyShift,
                 last = (((size_t{node} + 1) << down) - 1) >> KnownEmpty::kDirtyShift;
    std::memset(space_.dirty_.data() + first, 1, last - first + 1);
  }

  KnownEmpty& space_;
  const NodeProjection& projection_;
  const DepthRanges& clear_;
};

void KnownEmpty::carve(const geometry::Camera& camera, std::span<const float> clear_m, int threads) {
  CHECK(clear_m.size() == static_cast<size_t>(camera.width) * camera.height);
  const NodeProjection projection(camera, grid_);
  if (!projection.usable()) return;
  constexpr int kTaskLevel = 3;
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    const DepthRanges clear(camera, clear_m);
    const EmptyCarver carver(*this, projection, clear);
    in_parallel(uint32_t{0}, 1u << (3 * kTaskLevel), [&](uint32_t node) {
      if (!(any_[kTaskLevel][node >> 3] >> (node & 7) & 1)) return;
      glm::vec3 corner = projection.root();
      for (int level = 1; level <= kTaskLevel; ++level)
        corner = projection.child(corner, level, static_cast<int>(node >> (3 * (kTaskLevel - level)) & 7));
      carver.visit(kTaskLevel, node, corner);
    });
  });
  any_dirty_ = true;
  settle();
}

}  // namespace telesplat::packer
