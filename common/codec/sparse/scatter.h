// Sparse tiles: the order in which scattered pixels are coded, and the prediction of each from earlier ones.
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

  /// Calls f(x, y, neighbours) -> bool for every pixel until one returns false; returns true if none did. neighbours:
  /// indices, in the order of the walk, of earlier pixels around it.
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
  // The first coded pixel in each cell, with a border of empty cells all around.
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
  std::array<uint16_t, kMostNeighbours + 9> found_;  // the last ring appended may be cut off
  size_t found_count_ = 0;
};

/// Sizes of prediction errors: error_log() for depth and the normal's bytes, bits of its largest residual for colour.
struct Magnitudes {
  uint8_t depth = 0, normal[2] = {0, 0}, colour = 0;
};

struct Guess {
  int depth = 0, normal[2] = {0, 0};  ///< in 16ths of a code
  uint32_t colour = 0;
  Magnitudes expected;        ///< means of the neighbours' magnitudes
  uint32_t plain_colour = 0;  ///< 0..3: share of neighbours whose colours were as predicted, from none to all
  uint32_t distance = 1;      ///< square of the distance to the nearest neighbour, at most kMostDistance
  bool few = true;            ///< there are fewer than three neighbours
  int spread[3] = {0, 0, 0};  ///< standard deviation of the neighbours' depths and normals' bytes; 16ths
  int slope = 0;              ///< distance of the plane from the neighbours' mean depth; 16ths
  static constexpr uint32_t kMostDistance = 1u << 20;
};

/// Predicts pixels from those that were coded before, in the order of the walk.
class ScatterPredictor {
 public:
  void start(const Pixel& base) {
    known_.clear();
    base_ = base;
  }
  Guess predict(int x, int y, std::span<const uint16_t> neighbours);
  void add(int x, int y, const Pixel& pixel, const Magnitudes& magnitudes);

 private:
  // All numbers are whole; floats hold them exactly.
  struct alignas(64) Known {
    float depth, normal[2], plain;  // the normal's bytes; 1 if the colour was as predicted
    float colour[3], none;          // blue, green, red
    float sizes[4];                 // Magnitudes: depth, normal, colour
    int x, y;
    uint32_t unused[2];
  };

  std::vector<Known> known_;
  Pixel base_;
};

}  // namespace telesplat::codec::detail
