// What the depth-image codec needs, how fast it is and what it changes, over a set of images.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/core/result.h"
#include "tools/telesplat/bench/codec/baselines.h"
#include "tools/telesplat/bench/codec/errors.h"
#include "tools/telesplat/bench/codec/frames.h"
#include "tools/telesplat/bench/codec/speed.h"

namespace telesplat::launcher {

/// Bits of the parts of streams.
struct StreamBits {
  size_t depth = 0, normal = 0, colour = 0, mask = 0;
  size_t sparse = 0;  ///< tiles of few pixels, whose parts are coded in one
  size_t header = 0;  ///< what is left
  size_t all() const { return depth + normal + colour + mask + sparse + header; }
};

struct BaselineReport {
  const Baseline* coder = nullptr;
  PlaneBits bits;
  std::string missing;  ///< why it was not measured
};

/// How far decoded images may be from the encoded ones.
struct ErrorWish {
  double depth_px = 0;  ///< of a pixel's footprint at that depth
  int normal = 0, colour = 0;
  codec::ErrorBounds bounds(double focal_px) const {
    return codec::error_bounds(depth_px, 1 / focal_px, normal, colour);
  }
  bool exact() const { return depth_px <= 0 && normal == 0 && colour == 0; }
};

struct CodecReport {
  std::string name;
  size_t frames = 0, tiles = 0, full_tiles = 0, pixels = 0, covered = 0;
  StreamBits bits;
  ErrorWish wish;
  StreamBits bounded;     ///< within bounds of error, unless the wish is exact
  size_t refinement = 0;  ///< bits of what makes that exact
  std::vector<BaselineReport> baselines;
  size_t timed_tiles = 0;    ///< speeds are of these: full tiles, or where few are, those of which half is covered
  double timed_covered = 0;  ///< part of their pixels; speeds are of covered pixels
  std::vector<TargetSpeed> speeds, bounded_speeds, refinement_speeds;
  CodecErrors errors;  ///< within bounds, if there are any
};

struct MeasureOptions {
  std::vector<const Baseline*> coders;
  double seconds = 0.5;     ///< of each instruction set and direction; 0: speeds are not measured
  bool error_maps = false;  ///< keep those of the worst image
  ErrorWish wish;
};

class CodecMeasure {
 public:
  explicit CodecMeasure(MeasureOptions options) : options_(std::move(options)) {}

  /// Images of a set come one at a time.
  Status add(const DepthFrame& frame);
  /// Measures speeds, which takes most of the time, and ends the set.
  CodecReport finish(std::string name);

  /// Of the set that was finished last.
  const std::optional<image::View>& worst_maps() const { return worst_; }

 private:
  Status add_tile(const DepthFrame& tile, CodecErrors& errors);

  MeasureOptions options_;
  CodecReport report_;
  struct Timed {
    size_t covered = 0;
    DepthFrame frame;
    codec::ErrorBounds bounds;
  };
  Status add_bounded(const DepthFrame& tile, const codec::ErrorBounds& bounds, CodecErrors& errors);
  void keep_to_time(const DepthFrame& tile, size_t covered, const codec::ErrorBounds& bounds);
  void measure_speeds_of_kept();
  void measure_bounded_speeds(size_t covered);

  std::vector<Timed> timed_;  // the fullest first
  std::optional<image::View> worst_;
  double worst_error_ = -1;
};

}  // namespace telesplat::launcher
