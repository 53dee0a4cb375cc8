// Sparse tiles: the order in which scattered pixels are coded, and what predicts each from those before it.
//
// Order: from coarse to fine. On the way from cells of 128 x 128 pixels down to single pixels, a cell without a coded
// pixel has its first one coded. So most pixels have coded ones on all sides, as near as the mask allows, and are
// interpolated; a scan would have to extrapolate.
// Prediction: the plane through the neighbours by least squares, weighted by distance (moving least squares,
// P. Lancaster, K. Salkauskas 1981). Reciprocal depth is linear in screen space, so that a plane of depth codes is a
// plane in space. Normals and colours are interpolated by the same weights.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/mask.h"
#include "common/codec/tile_rect.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// Walks a tile's covered pixels, fewer than 65536, from coarse to fine.
class ScatterWalk {
 public:
  static constexpr size_t kMostNeighbours = 16;

  /// Calls f(x, y, neighbours) -> bool for every pixel until one is false; returns whether none was. neighbours: which
  /// of the pixels before, counted in the order of the walk, lie around it.
  template <class F>
  bool operator()(const Mask& mask, F f) {
    start(mask);
    for (int level = kLevels - 1; level >= 0; --level) {
      size_t later = 0;
      for (const Place p : left_) {
        if (cell(level, p) != kNone) {
          left_[later++] = p;
          continue;
        }
        look_around(level, p);
        if (!f(p.x, p.y, std::span<const uint16_t>(found_.data(), found_count_))) return false;
        enter(level, p);
      }
      left_.resize(later);
    }
    return true;
  }

 private:
  static constexpr int kLevels = 8;
  static constexpr uint16_t kNone = 0xFFFF;

  struct Place {
    uint16_t x, y;
  };
  // Which pixel stands for each cell; a border of empty cells all around. It is the first that was coded there.
  struct Grid {
    size_t stride = 0;
    std::vector<uint16_t> pixels;
  };
  uint16_t& cell(int level, Place p) {
    Grid& grid = grids_[static_cast<size_t>(level)];
    return grid.pixels[static_cast<size_t>((p.y >> level) + 1) * grid.stride + static_cast<size_t>((p.x >> level) + 1)];
  }
  void start(const Mask& mask);
  void add_ring(int level, Place p);
  void add_outer_ring(int level, int inner, Place p);
  void look_around(int level, Place p);
  void enter(int level, Place p);

  std::array<Grid, kLevels> grids_;
  std::vector<Place> coded_, left_;
  std::array<uint16_t, kMostNeighbours + 9> found_;  // what a ring appends may have to be cut off
  size_t found_count_ = 0;
};

/// How wrong predictions were: of depth and of the normal's bytes by error_log(), of the colour the bits of its largest
/// residual.
struct Magnitudes {
  uint8_t depth = 0, normal[2] = {0, 0}, colour = 0;
};

struct Guess {
  int depth = 0, normal[2] = {0, 0};  ///< in 16ths of a code
  uint32_t colour = 0;
  Magnitudes expected;        ///< as those of the neighbours were
  uint32_t plain_colour = 0;  ///< 0..3: how many neighbours had colours as predicted, from none to all
  uint32_t distance = 1;      ///< the square of that to the nearest neighbour, at most kMostDistance
  bool few = true;            ///< there are fewer than three neighbours
  int spread[3] = {0, 0, 0};  ///< of the neighbours' depths and normals' bytes, the standard deviation; 16ths
  int slope = 0;              ///< how far the plane lies from the neighbours' mean depth; 16ths
  static constexpr uint32_t kMostDistance = 1u << 20;
};

/// What is known of the pixels that were coded, in the order of the walk.
class ScatterPredictor {
 public:
  void start(const Pixel& base) {
    known_.clear();
    base_ = base;
  }
  Guess predict(int x, int y, std::span<const uint16_t> neighbours);
  void add(int x, int y, const Pixel& pixel, const Magnitudes& magnitudes);

 private:
  // All numbers are whole ones, which floats hold exactly.
  struct alignas(64) Known {
    float depth, normal[2], plain;  // the normal's bytes; 1 where the colour was as predicted
    float colour[3], none;          // blue, green, red
    float sizes[4];                 // Magnitudes: depth, normal, colour
    int x, y;
    uint32_t unused[2];
  };

  std::vector<Known> known_;
  Pixel base_;
};

}  // namespace telesplat::codec::detail
