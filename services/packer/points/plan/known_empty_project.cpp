// KnownEmpty::project: for each tile, descends the octree only where a node can still set pixels.
#include <tbb/task_arena.h>

#include <array>
#include <limits>
#include <vector>

#include "common/core/check.h"
#include "common/parallel/in_parallel.h"
#include "services/packer/points/plan/known_empty.h"
#include "services/packer/points/plan/node_view.h"

namespace telesplat::packer {
namespace {

constexpr int kTile = 256;                                  // pixels a side: 256 KiB of depths; a multiple of 64
constexpr int kSquareBits = 3, kSquare = 1 << kSquareBits;  // pixels a side of the finest squares of a tile's pyramid
constexpr int kTileLevels = 6;                              // squares of 8, 16, ..., 256 pixels
constexpr float kSet = -1;                                  // replaces the depth of a pixel that is set

constexpr int kSmall = 6;  // pixels: up to this size, a node's bounding rectangle stands for the node

struct Span {
  int first = 0, last = -1;
};

// Depths of a tile's pixels that are not set yet, and the greatest one of each square. Positions are pixels within the
// tile.
class TileDepths {
 public:
  TileDepths(const geometry::Camera& camera, std::span<const float> shown_m, const geometry::Rect& rect)
      : width_(rect.width), height_(rect.height), depth_(size_t{kTile} * kTile) {
    for (int y = 0; y < height_; ++y) {
      const float* from = shown_m.data() + static_cast<size_t>(rect.y + y) * camera.width + rect.x;
      float* to = depth_.data() + static_cast<size_t>(y) * kTile;
      for (int x = 0; x < width_; ++x) to[x] = from[x] > 0 ? from[x] : 0.0f;
    }
    for (int level = 0; level < kTileLevels; ++level)
      greatest_[static_cast<size_t>(level)].resize(static_cast<size_t>(side(level)) * side(level));
    refresh(0, 0, kTile - 1, kTile - 1);
  }

  int width() const { return width_; }
  int height() const { return height_; }

  /// True if an unset pixel here shows a surface behind depth_m. Large rectangles include some pixels around.
  bool any_behind(float depth_m, int x0, int y0, int x1, int y1) const {
    const int longest = std::max(x1 - x0, y1 - y0) + 1;
    int level = 0;
    while (level + 1 < kTileLevels && (kSquare << (level + 1)) < longest) ++level;
    const int down = kSquareBits + level;
    for (int y = y0 >> down; y <= y1 >> down; ++y)
      for (int x = x0 >> down; x <= x1 >> down; ++x)
        if (greatest_[static_cast<size_t>(level)][static_cast<size_t>(y) * side(level) + x] > depth_m)
          return longest > kSquare || any_pixel_behind(depth_m, x0, y0, x1, y1);
    return false;
  }
  /// Sets those pixels of a row, first to last, that show a surface behind depth_m. True if it set any.
  bool set(int y, Span span, float depth_m) {
    float* row = depth_.data() + static_cast<size_t>(y) * kTile;
    bool any = false;
    for (int x = span.first; x <= span.last; ++x) {
      const bool hidden = row[x] > depth_m;
      any |= hidden;
      row[x] = hidden ? kSet : row[x];
    }
    any_set_ |= any;
    return any;
  }
  /// Updates the squares of this rectangle after set().
  void refresh(int x0, int y0, int x1, int y1) {
    for (int y = y0 / kSquare; y <= y1 / kSquare; ++y)
      for (int x = x0 / kSquare; x <= x1 / kSquare; ++x)
        greatest_[0][static_cast<size_t>(y) * side(0) + x] = greatest_of_pixels(x, y);
    for (int level = 1; level < kTileLevels; ++level) {
      const int down = kSquareBits + level;
      for (int y = y0 >> down; y <= y1 >> down; ++y)
        for (int x = x0 >> down; x <= x1 >> down; ++x) {
          const float* finer = greatest_[static_cast<size_t>(level) - 1].data() +
                               static_cast<size_t>(2 * y) * side(level - 1) + size_t{2} * static_cast<size_t>(x);
          greatest_[static_cast<size_t>(level)][static_cast<size_t>(y) * side(level) + x] =
              std::max(std::max(finer[0], finer[1]), std::max(finer[side(level - 1)], finer[side(level - 1) + 1]));
        }
    }
  }
  void write(const geometry::Rect& rect, image::PixelMask& out) const {
    if (!any_set_) return;
    for (int y = 0; y < height_; ++y) {
      const float* row = depth_.data() + static_cast<size_t>(y) * kTile;
      uint64_t* words = out.row(rect.y + y) + rect.x / 64;
      for (int x0 = 0; x0 < width_; x0 += 64) {
        uint64_t word = 0;
        for (int x = 0; x < std::min(64, width_ - x0); ++x) word |= static_cast<uint64_t>(row[x0 + x] == kSet) << x;
        words[x0 / 64] = word;
      }
    }
  }

 private:
  bool any_pixel_behind(float depth_m, int x0, int y0, int x1, int y1) const {
    float greatest = 0;
    for (int y = y0; y <= y1; ++y) {
      const float* row = depth_.data() + static_cast<size_t>(y) * kTile;
      for (int x = x0; x <= x1; ++x) greatest = std::max(greatest, row[x]);
    }
    return greatest > depth_m;
  }
  static constexpr int side(int level) { return kTile / kSquare >> level; }
  float greatest_of_pixels(int square_x, int square_y) const {
    std::array<float, kSquare> columns{};
    for (int y = 0; y < kSquare; ++y) {
      const float* row = depth_.data() + static_cast<size_t>(square_y * kSquare + y) * kTile + square_x * kSquare;
      for (size_t x = 0; x < kSquare; ++x) columns[x] = std::max(columns[x], row[x]);
    }
    return *std::max_element(columns.begin(), columns.end());
  }

  int width_, height_;
  bool any_set_ = false;
  std::vector<float> depth_;
  std::array<std::vector<float>, kTileLevels> greatest_;
};

// Rows of pixels, within a tile, that the convex hull of a node's corners touches.
class HullRows {
 public:
  HullRows(const NodeCorners& corners, int width, int height) : width_(width) {
    const auto [top, bottom] = std::minmax_element(corners.y.begin(), corners.y.end());
    if (!(*bottom >= 0 && *top < static_cast<float>(height))) return;
    first_ = to_pixel(*top, height - 1), last_ = to_pixel(*bottom, height - 1);
    std::fill(rows_.begin() + first_, rows_.begin() + last_ + 1, Span{width, -1});
    for (int from = 0; from < 8; ++from)
      for (int bit = 1; bit < 8; bit <<= 1)
        if (!(from & bit)) add_edge(corners, static_cast<size_t>(from), static_cast<size_t>(from | bit));
  }
  int first() const { return first_; }
  int last() const { return last_; }  ///< before first(): no row
  Span row(int y) const { return rows_[static_cast<size_t>(y)]; }

 private:
  void add_edge(const NodeCorners& corners, size_t a, size_t b) {
    if (corners.y[a] > corners.y[b]) std::swap(a, b);
    const float x0 = corners.x[a], y0 = corners.y[a], x1 = corners.x[b], y1 = corners.y[b];
    if (y1 < static_cast<float>(first_) || y0 >= static_cast<float>(last_ + 1)) return;
    const float slope = y1 - y0 > 1e-3f ? (x1 - x0) / (y1 - y0) : 0;
    for (int y = std::max(first_, to_pixel(y0, last_)); y <= std::min(last_, to_pixel(y1, last_)); ++y) {
      float from = x0, to = x1;
      if (slope != 0) {
        from = x0 + (std::max(y0, static_cast<float>(y)) - y0) * slope;
        to = x0 + (std::min(y1, static_cast<float>(y + 1)) - y0) * slope;
      }
      if (from > to) std::swap(from, to);
      // Parts beyond the left or right border count, too: the hull's other side may lie inside or beyond.
      Span& row = rows_[static_cast<size_t>(y)];
      if (from < static_cast<float>(width_)) row.first = std::min(row.first, to_pixel(from, width_ - 1));
      if (to >= 0) row.last = std::max(row.last, to_pixel(to, width_ - 1));
    }
  }

  int width_, first_ = 0, last_ = -1;
  std::array<Span, kTile> rows_;
};

}  // namespace

class EmptyProjector {
 public:
  EmptyProjector(const KnownEmpty& space, const NodeProjection& projection, const geometry::Rect& rect,
                 TileDepths& depths)
      : space_(space), projection_(projection), rect_(rect), depths_(depths) {}

  void visit(int level, uint32_t node, const glm::vec3& corner) {
    NodeView view = projection_.look(level, corner);
    if (view.behind) return;
    move(view);
    const int width = depths_.width(), height = depths_.height();
    if (!(view.right > 0 && view.left < static_cast<float>(width) && view.bottom > 0 &&
          view.top < static_cast<float>(height)))
      return;
    const int x0 = to_pixel(view.left, width - 1), x1 = to_pixel(view.right, width - 1),
              y0 = to_pixel(view.top, height - 1), y1 = to_pixel(view.bottom, height - 1);
    if (!depths_.any_behind(view.nearest_m, x0, y0, x1, y1)) return;
    const auto l = static_cast<size_t>(level);
    // A part cut off by the near plane is too thin to matter.
    if (!view.crosses_near && (space_.all_[l][node >> 3] >> (node & 7) & 1)) fill(level, corner, view.farthest_m);
    if (level == KnownEmpty::kBlockLevel || view.small()) return;
    const uint8_t children = space_.hides_[l + 1][node];
    for (int child = 0; child < 8; ++child)
      if (children >> child & 1)
        visit(level + 1, node << 3 | static_cast<uint32_t>(child), projection_.child(corner, level + 1, child));
  }

 private:
  // Converts from the frame's pixels to the tile's.
  void move(NodeView& view) const {
    const auto dx = static_cast<float>(rect_.x), dy = static_cast<float>(rect_.y);
    view.left -= dx, view.right -= dx, view.top -= dy, view.bottom -= dy;
  }

  // Rays that pass only the outer quarter of a block do not count: beside each edge of a shown surface there are blocks
  // that some rays pass and others do not reach.
  void fill(int level, const glm::vec3& corner, float farthest_m) {
    NodeView inside = projection_.look_inside(level, corner);
    move(inside);
    const int width = depths_.width(), height = depths_.height();
    if (!(inside.right > 0 && inside.left < static_cast<float>(width) && inside.bottom > 0 &&
          inside.top < static_cast<float>(height)))
      return;
    const int x0 = to_pixel(inside.left, width - 1), x1 = to_pixel(inside.right, width - 1),
              y0 = to_pixel(inside.top, height - 1), y1 = to_pixel(inside.bottom, height - 1);
    if (!depths_.any_behind(farthest_m, x0, y0, x1, y1)) return;
    bool any = false;
    if (x1 - x0 < kSmall && y1 - y0 < kSmall) {
      for (int y = y0; y <= y1; ++y) any |= depths_.set(y, {x0, x1}, farthest_m);
    } else {
      NodeCorners corners = projection_.corners_inside(level, corner);
      for (float& x : corners.x) x -= static_cast<float>(rect_.x);
      for (float& y : corners.y) y -= static_cast<float>(rect_.y);
      const HullRows hull(corners, width, height);
      for (int y = hull.first(); y <= hull.last(); ++y) any |= depths_.set(y, hull.row(y), farthest_m);
    }
    if (any) depths_.refresh(x0, y0, x1, y1);
  }

  const KnownEmpty& space_;
  const NodeProjection& projection_;
  const geometry::Rect rect_;
  TileDepths& depths_;
};

void KnownEmpty::project(const geometry::Camera& camera, std::span<const float> shown_m, int threads,
                         image::PixelMask& may_hold) const {
  CHECK(shown_m.size() == static_cast<size_t>(camera.width) * camera.height);
  may_hold.reset(camera.width, camera.height);
  const NodeProjection projection(camera, grid_);
  if (!projection.usable()) return;
  const int columns = (camera.width + kTile - 1) / kTile, rows = (camera.height + kTile - 1) / kTile;
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    in_parallel(0, columns * rows, [&](int tile) {
      const int x = tile % columns * kTile, y = tile / columns * kTile;
      const geometry::Rect rect{x, y, std::min(kTile, camera.width - x), std::min(kTile, camera.height - y)};
      TileDepths depths(camera, shown_m, rect);
      EmptyProjector projector(*this, projection, rect, depths);
      if (hides_[0][0] & 1) projector.visit(0, 0, projection.root());
      depths.write(rect, may_hold);
    });
  });
}

}  // namespace telesplat::packer
