#include "client/displays/xr/texture_rows.h"

#include <algorithm>
#include <type_traits>

namespace telesplat::viewer {
namespace {

// Without branches, so that the compiler makes vectors of it.
template <class T>
void half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, T* out) {
  const auto near = float(1 / range.near_m), scale = float(1 / (1 / range.near_m - 1 / range.far_m));
  for (size_t x = 0; x < pixels; ++x) {
    const float nearest = std::min(std::min(above[2 * x], above[2 * x + 1]), std::min(below[2 * x], below[2 * x + 1]));
    const float value = std::min(std::max((near - 1 / nearest) * scale, 0.0f), 1.0f);
    out[x] = std::is_same_v<T, float> ? T(value) : T(int(value * 65535.0f + 0.5f));
  }
}

}  // namespace

void to_rgba(const uint32_t* colour, size_t pixels, uint32_t* out) {
  for (size_t x = 0; x < pixels; ++x)
    out[x] = (colour[x] & 0xff00ff00u) | (colour[x] >> 16 & 0xffu) | (colour[x] & 0xffu) << 16;
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, float* out) {
  half_depth(above, below, range, pixels, out);
}

void to_half_depth(const float* above, const float* below, const DepthRange& range, size_t pixels, uint16_t* out) {
  half_depth(above, below, range, pixels, out);
}

}  // namespace telesplat::viewer
