// The depths, normals and colours that a decoder can return within bounds of error. Integers alone, the same on every
// machine.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// Depth codes that represent those around them, in equal steps of their logarithm. Code m represents codes at most
/// reach(m) = floor(m * depth / 2^32) away. If a is the first code of an interval, m is the largest one with m -
/// reach(m) <= a, which is floor(a * 2^32 / (2^32 - depth)); the next interval begins after m + reach(m). Code 0 is an
/// interval of its own; so is each small code.
class DepthLattice {
 public:
  /// ErrorBounds::kLeastDepth <= depth <= kMostDepth. Up to 1.2 million codes, fewer for larger bounds.
  explicit DepthLattice(uint32_t depth);
  /// The same lattice, shared by several images: each thread keeps its last two.
  static std::shared_ptr<const DepthLattice> of(uint32_t depth);

  uint32_t depth() const { return depth_; }
  uint32_t last() const { return static_cast<uint32_t>(codes_.size() - 1); }
  /// The code of interval `index`, or of the last one.
  uint32_t code(uint32_t index) const { return codes_[std::min(index, last())]; }
  const uint32_t* codes() const { return codes_.data(); }
  uint32_t reach(uint32_t code) const { return static_cast<uint32_t>(uint64_t{code} * depth_ >> 32); }
  /// The interval that `code` lies in. Precondition: code <= kMaxDepthCode.
  uint32_t index(uint32_t code) const {
    const Line& line = lines_[place(code)];
    const uint32_t* end = ends_.data() + line.index + (uint64_t{code - line.code} * line.slope >> 32);
    end += *end < code;  // the line lies below, nearly always by less than 2: two steps without branches
    end += *end < code;
    while (*end < code) ++end;
    while (end != ends_.data() && end[-1] >= code) --end;
    return static_cast<uint32_t>(end - ends_.data());
  }

 private:
  // Indices of codes whose logarithms have the upper bits in common lie nearly on a line.
  struct Line {
    uint32_t code = 0, index = 0;  // the line's first point
    uint32_t slope = 0;            // in 2^-32 indices a code
  };
  static constexpr unsigned kFraction = 7;  // bits
  static size_t place(uint32_t code) {
    return (std::bit_cast<uint32_t>(static_cast<float>(code + 1)) >> (23 - kFraction)) - (127u << kFraction);
  }

  uint32_t depth_;
  std::vector<uint32_t> codes_, ends_;  // for each interval: the code that represents it, and its last code
  std::vector<Line> lines_;
};

/// Bounds of error in the form that the coders of tiles take.
struct TileBounds {
  explicit TileBounds(const ErrorBounds& bounds)
      : kept(bounds.depth != 0 ? DepthLattice::of(bounds.depth) : nullptr),
        depth(kept.get()),
        normal(bounds.normal),
        colour(bounds.colour) {}
  std::shared_ptr<const DepthLattice> kept;
  const DepthLattice* depth;  ///< null: depths are exact
  int normal, colour;
};

/// Coordinates on a normal's map, 0 to 254, in steps of 2 * reach + 1 around its centre: all inside the map's rim,
/// unless reach is 0. 0 <= reach <= 3.
class NormalLattice {
 public:
  explicit NormalLattice(int reach)
      : step_(2 * reach + 1),
        half_(reach == 0 ? 127 : (126 + reach) / step_),
        share_((1u << kShare) / static_cast<uint32_t>(step_) + 1) {}
  int step() const { return step_; }
  int most() const { return 2 * half_; }  ///< the largest index
  int value(int index) const { return 127 + (std::min(index, most()) - half_) * step_; }
  int index(int value) const { return divided(value - 127 + step_ * half_ + step_ / 2); }
  int nearest(int v) const { return value(index(v)); }
  /// 64ths of a coordinate, 0 to 254 * 64 -> 64ths of a step.
  int16_t index64(int v) const { return static_cast<int16_t>(divided(v + offset64())); }
  /// index64() of many numbers is max(v + offset64(), 0) * share() >> kShare.
  int offset64() const { return 64 * half_ * step_ + step_ / 2 - 64 * 127; }
  uint32_t share() const { return share_; }
  static constexpr int kShare = 18;

 private:
  // Divides by the step, rounds down, and returns at least 0. A multiplication: exact for all coordinates.
  int divided(int v) const { return static_cast<int>(static_cast<uint32_t>(std::max(v, 0)) * share_ >> kShare); }

  int step_, half_;
  uint32_t share_;
};

/// Values of a channel in steps of 2 * reach + 1, from 0; the last one is 255.
class ColourLattice {
 public:
  explicit ColourLattice(int reach) : reach_(reach), step_(2 * reach + 1) {}
  int step() const { return step_; }
  int index(int value) const { return (value + reach_) / step_; }
  int value(int index) const { return std::min(index * step_, 255); }

 private:
  int reach_, step_;
};

}  // namespace telesplat::codec::detail
