// The warp of one pixel, without vectors: every instruction set's kernel (kernels.cpp) gives the same bits, and
// machines without such a set use this.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "common/volume/warp/kernels.h"

namespace telesplat::volume {

/// a b / 32768, rounded to nearest.
inline int32_t times_15(int32_t a, int32_t b) { return (a * b + 16384) >> 15; }

struct WarpedPixel {
  uint32_t colour = 0;  ///< 0xAARRGGBB, AA: the volume's coverage
  float depth_m = std::numeric_limits<float>::infinity();
};

/// layers: bits, as in WarpTile::parts. (x, y) is counted from the tile's corner.
inline WarpedPixel warp_pixel(const WarpTile& tile, uint64_t layers, int x, int y, uint64_t& samples) {
  WarpedPixel out;
  const auto px = static_cast<float>(x), py = static_cast<float>(y);
  int32_t sum[4] = {};  // blue, green, red, opacity
  const auto transparency = [&] { return kWarpOpaque - sum[3]; };
  const auto add_behind = [&](int channel, int32_t value) {
    const int32_t left = transparency(), factor = left < kWarpDone ? 0 : left + (left >> 8);
    return std::min(sum[channel] + times_15(value, factor), 32767);
  };
  for (uint64_t rest = layers; rest; rest &= rest - 1) {
    const WarpLayer& layer = tile.layers[std::countr_zero(rest)];
    ++samples;
    const float w = (layer.w0 + py * layer.wy) + px * layer.wx;
    const float inverse = 1.0f / std::max(w, kWarpNearestW);
    const auto place = [](float at, float least, float most, float shift) {
      return std::bit_cast<int32_t>(std::min(std::max(at, least), most) + shift);
    };
    const float near_x = ((layer.x0 + py * layer.xy) + px * layer.xx) * inverse;
    const float near_y = ((layer.y0 + py * layer.yy) + px * layer.yx) * inverse;
    // Rays that do not meet the plane look at texel column 0, which is empty.
    const int32_t cx = place(w >= kWarpNearestW ? near_x : layer.least_x, layer.least_x, layer.most_x, layer.shift_x);
    const int32_t cy = place(near_y, layer.least_y, layer.most_y, layer.shift_y);
    const int32_t fx = cx & 127, fy = cy & 127;
    const uint32_t* texel = layer.texels + (cy >> 7 & kWarpMagicTexels) * layer.pitch + (cx >> 7 & kWarpMagicTexels);
    int32_t next[4];
    for (int c = 0; c < 4; ++c) {
      const auto row = [&](const uint32_t* t) {
        return (128 - fx) * static_cast<int32_t>(t[0] >> 8 * c & 255) + fx * static_cast<int32_t>(t[1] >> 8 * c & 255);
      };
      const int32_t upper = row(texel), lower = row(texel + layer.pitch);
      next[c] = add_behind(c, upper + times_15(lower - upper, fy << 8));
    }
    std::copy_n(next, 4, sum);
    if (transparency() <= kWarpSolid && out.depth_m == std::numeric_limits<float>::infinity())
      out.depth_m = inverse * layer.depth;
    if (transparency() < kWarpDone) break;
  }
  out.colour = 0;
  for (int c = 0; c < 4; ++c) {
    const int32_t whole = add_behind(c, static_cast<int32_t>(tile.background >> 8 * c & 255) << 7);
    out.colour |= static_cast<uint32_t>((std::min(whole, kWarpOpaque) + 64) >> 7) << 8 * c;
  }
  return out;
}

}  // namespace telesplat::volume
