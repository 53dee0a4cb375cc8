// Colours of scattered pixels that a ramp coloured: pixels at similar heights in the room have similar colours, even if
// they lie far apart. A known colour predicts the next one at about its height.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/codec/entropy.h"
#include "common/codec/room_axes.h"

namespace telesplat::codec::detail {

/// A pixel's height is floor((a x + b y + c) 2^shift / depth code) - low, limited to 0 to kMost; x and y are counted
/// from the tile's centre. A coordinate of room space has this form.
struct RampAxis {
  static constexpr int kMost = 16383, kMostShift = 23;
  static constexpr int64_t kMostSum = int64_t{1} << 39;  ///< largest |a| width + |b| height + |c|
  int32_t a = 0, b = 0, c = 0, low = 0;
  int shift = 0;

  int height(int x, int y, uint32_t depth) const {
    const int64_t sum = (int64_t{a} * x + int64_t{b} * y + c) * (int64_t{1} << shift), code = depth;
    const int64_t above = (sum >= 0 ? sum / code : -((code - 1 - sum) / code)) - low;
    return static_cast<int>(above < 0 ? 0 : above > kMost ? kMost : above);
  }
};

/// A pixel with known depth and colour; x and y from the tile's centre.
struct RampSample {
  double x, y, code;
  uint32_t colour;
};

/// The axis of the room, counted from the tile's centre, along which colours of samples change least; nothing if no
/// axis explains them. width, height: of the tile.
std::optional<RampAxis> fit_ramp(const RoomAxes& axes, const std::vector<RampSample>& samples, int width, int height);
void put_ramp(std::vector<uint8_t>& out, const RampAxis& axis);
/// Nothing: the stream is damaged. width, height: of the tile.
std::optional<RampAxis> get_ramp(Reader& in, int width, int height);

/// The known colours of a tile, by height.
class Ramp {
 public:
  /// width, height: of the tile.
  void start(const RampAxis& axis, int width, int height) {
    axis_ = axis;
    x0_ = width / 2, y0_ = height / 2;
    taken_.fill(0);
  }
  /// x, y: from the tile's upper left. Precondition: depth > 0.
  int height(int x, int y, uint32_t depth) const { return axis_.height(x - x0_, y - y0_, depth); }

  static constexpr uint32_t kNothing = 11;
  struct Said {
    uint32_t colour = 0;
    /// Bits of the distance in heights between the two colours used; kNothing: no colour is known.
    uint32_t gap = kNothing;
  };
  /// Interpolates between the known colours below and above.
  Said at(int height) const;
  void add(int height, uint32_t colour) {
    const auto cell = static_cast<size_t>(height >> kCellBits);
    known_[cell] = {height, colour};
    taken_[cell / 64] |= uint64_t{1} << cell % 64;
  }

 private:
  static constexpr int kCellBits = 3, kCells = (RampAxis::kMost + 1) >> kCellBits;
  struct Known {
    int height;
    uint32_t colour;
  };
  int last_until(int cell) const;
  int first_after(int cell) const;

  RampAxis axis_;
  int x0_ = 0, y0_ = 0;
  std::array<Known, kCells> known_;  // the last colour of each cell
  std::array<uint64_t, kCells / 64> taken_{};
};

}  // namespace telesplat::codec::detail
