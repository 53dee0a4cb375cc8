// Inside services/data/cloud/laz: decodes the numbers of points, each from those of points before it. Sources: M.
// Isenburg, "LASzip: lossless compression of LiDAR data", PE&RS 79, 2013; LASzip, "Specification for LAS 1.4".
#pragma once

#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "services/data/cloud/laz/entropy.h"

namespace telesplat::data::laz {

/// Numbers of a point beside those that all have, in the order of a LAS record.
struct Items {
  bool layered = false;  ///< points of formats 6 and later: one stream of bytes for each attribute of a chunk
  bool time = false, colours = false, infrared = false;
  size_t extra = 0;  ///< bytes without a meaning
  bool each_has_its_channel =
      true;  ///< layered: false: version 3, where colours follow their point's channel only where
             ///< it changes

  size_t bytes() const {
    return (layered ? 30 : 20) + (time && !layered ? 8 : 0) + (colours ? 6 : 0) + (infrared ? 2 : 0) + extra;
  }
};

/// Decodes the points of one chunk in order.
class PointDecoder {
 public:
  virtual ~PointDecoder() = default;
  /// Writes the next point as a LAS record of Items::bytes(). Throws Damaged.
  virtual void next(char* out) = 0;
};

/// chunk: all its bytes; points: their number. Throws Damaged.
std::unique_ptr<PointDecoder> decode_together(const Items& items, std::string_view chunk);
std::unique_ptr<PointDecoder> decode_layers(const Items& items, std::string_view chunk, uint64_t points);

/// Decodes places: plans as steps from the last point, near the middle one of five such steps; heights near others.
class Places {
 public:
  void begin(int32_t height) { heights_.fill(height); }
  /// context: below 16, has its own last steps; single: the point is the only return of its pulse.
  void next_plan(Decoder& decoder, size_t context, bool single, int32_t& x, int32_t& y);
  /// level: below 8, has its own last height.
  int32_t next_height(Decoder& decoder, size_t level, bool single);

 private:
  std::array<Median, 16> x_steps_, y_steps_;
  std::array<int32_t, 8> heights_{};
  Numbers dx_{32, 2}, dy_{32, 22}, z_{32, 20};
};

/// Decodes times as whole numbers, in up to four sequences with a step each.
class Times {
 public:
  explicit Times(bool layered) : layered_(layered), no_step_(layered ? 5 : 6), steps_(layered ? 515 : 516) {}
  void begin(uint64_t first) { sequences_[0].time = first; }
  uint64_t next(Decoder& decoder);

 private:
  struct Sequence {
    uint64_t time = 0;
    int32_t step = 0;
    int extremes = 0;  // steps that followed each other and were far from `step`
  };
  uint64_t begin_sequence(Decoder& decoder);

  bool layered_;
  std::array<Sequence, 4> sequences_;
  size_t now_ = 0, newest_ = 0;
  SymbolModel no_step_, steps_;
  Numbers numbers_{32, 9};
};

/// Decodes colours, byte by byte.
class Colours {
 public:
  using Rgb = std::array<uint16_t, 3>;
  Rgb next(Decoder& decoder, const Rgb& last);

 private:
  SymbolModel changed_{128};
  std::array<SymbolModel, 6> bytes_;
};

}  // namespace telesplat::data::laz
