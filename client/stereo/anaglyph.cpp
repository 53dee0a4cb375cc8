#include "client/stereo/anaglyph.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/image/srgb.h"

namespace telesplat::stereo {
namespace {

constexpr AnaglyphMatrices kGrey{
    {0.299f, 0.587f, 0.114f, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0.299f, 0.587f, 0.114f, 0.299f, 0.587f, 0.114f}, false};
constexpr AnaglyphMatrices kColour{{1, 0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 1, 0, 0, 0, 1}, false};
constexpr AnaglyphMatrices kDubois{{0.437f, 0.449f, 0.164f, -0.062f, -0.062f, -0.024f, -0.048f, -0.050f, -0.017f},
                                   {-0.011f, -0.032f, -0.007f, 0.377f, 0.761f, 0.009f, -0.026f, -0.093f, 1.234f},
                                   true};

// Values that channels stand for, and channels of values, in steps so fine that no two channels share one.
struct Curve {
  static constexpr int kSteps = 1 << 14;
  std::array<float, 256> value;
  std::vector<uint8_t> channel = std::vector<uint8_t>(kSteps + 1);

  explicit Curve(bool linear) {
    for (size_t i = 0; i < 256; ++i) value[i] = linear ? image::linear_of_srgb()[i] : float(i) / 255;
    for (int i = 0; i <= kSteps; ++i) {
      const float v = float(i) / kSteps;
      channel[size_t(i)] = linear ? uint8_t(image::srgb_of_linear(v)) : uint8_t(std::lround(255 * v));
    }
  }
  uint32_t of(float v) const { return channel[size_t(std::clamp(v, 0.0f, 1.0f) * kSteps + 0.5f)]; }
};

const Curve& curve(bool linear) {
  static const Curve plain(false), srgb(true);
  return linear ? srgb : plain;
}

}  // namespace

const AnaglyphMatrices& anaglyph_matrices(Mode mode) {
  return mode == Mode::kAnaglyphGrey ? kGrey : mode == Mode::kAnaglyphDubois ? kDubois : kColour;
}

void anaglyph(Mode mode, const uint32_t* left, const uint32_t* right, size_t count, uint32_t* out) {
  if (mode == Mode::kAnaglyphColour) {
    for (size_t i = 0; i < count; ++i)
      out[i] = std::max(left[i] & 0xff000000u, right[i] & 0xff000000u) | (left[i] & 0xff0000) | (right[i] & 0xffff);
    return;
  }
  const AnaglyphMatrices& m = anaglyph_matrices(mode);
  const Curve& c = curve(m.linear);
  for (size_t i = 0; i < count; ++i) {
    const uint32_t l = left[i], r = right[i];
    const std::array<float, 6> v{c.value[l >> 16 & 255], c.value[l >> 8 & 255], c.value[l & 255],
                                 c.value[r >> 16 & 255], c.value[r >> 8 & 255], c.value[r & 255]};
    uint32_t pixel = std::max(l & 0xff000000u, r & 0xff000000u);
    for (size_t row = 0; row < 3; ++row) {
      const float* a = &m.left[3 * row];
      const float* b = &m.right[3 * row];
      pixel |= c.of(a[0] * v[0] + a[1] * v[1] + a[2] * v[2] + b[0] * v[3] + b[1] * v[4] + b[2] * v[5])
               << (16 - 8 * row);
    }
    out[i] = pixel;
  }
}

}  // namespace telesplat::stereo
