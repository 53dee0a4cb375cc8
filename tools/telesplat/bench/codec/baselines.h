// What other coders need for the same tile. One row a coder.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"

namespace telesplat::launcher {

/// 0: the coder has no such plane.
struct PlaneBits {
  size_t depth = 0, colour = 0, normal = 0;
  size_t all() const { return depth + colour + normal; }
};

struct Baseline {
  std::string name;   ///< of --coders
  std::string title;  ///< of its row
  bool depth_only = false;
  std::function<Result<PlaneBits>(const image::DepthImage&)> bits;
  std::function<std::string()> missing;  ///< why it is not here; empty: it is
};

/// - lzw: its codes alone (lzw.h).
/// - tiff: files with LZW and differences, as telesplat-bench has them; depth as three bytes or one number.
/// - png: depth and colours as RGB, normals as two channels.
/// - zstd: level 3, one byte plane after the other, a frame for depth, colours and normals each.
/// - rvl: depth alone (rvl.h).
/// - jxl: `cjxl -d 0 -e 3`; depth as RGB, or as a picture of its upper 16 bits and one of the lower 8, whichever is
///   less; normals as RGB without blue.
const std::vector<Baseline>& baselines();

/// One byte plane interleaved with the other: depth and colours 3 bytes a pixel, the highest first, normals 2.
std::vector<uint8_t> depth_bytes(const image::DepthImage& image);
std::vector<uint8_t> colour_bytes(const image::DepthImage& image);
std::vector<uint8_t> normal_bytes(const image::DepthImage& image);

}  // namespace telesplat::launcher
