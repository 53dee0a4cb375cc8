// Prediction where few pixels are covered: from the nearest covered pixels that came before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/codec/predict.h"

namespace telesplat::codec::detail {

struct Pixel {
  uint32_t depth = 0, colour = 0;
  uint16_t normal = 0;
};

/// The covered pixels of a tile seen so far, in scan order. A grid of cells of kCell x kCell pixels keeps the last
/// pixel in each.
class Neighbours {
 public:
  /// `base` predicts the first pixel.
  void reset(int width, int height, const Pixel& base);
  /// The prediction for a pixel after all that were added.
  Pixel predict(int x, int y) const;
  void add(int x, int y, const Pixel& pixel);

 private:
  static constexpr int kCell = 8;
  struct Entry {
    int x = 0, y = 0;
    Pixel pixel;
  };
  std::vector<Entry> cells_;  // a border of empty cells left, right and above
  int cells_per_row_ = 0;
  Entry last_;
};

}  // namespace telesplat::codec::detail
