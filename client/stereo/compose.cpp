#include "client/stereo/compose.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "common/core/check.h"
#include "common/image/srgb.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::stereo {
namespace {

constexpr AnaglyphMatrices kGrey{
    {0.299f, 0.587f, 0.114f, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0.299f, 0.587f, 0.114f, 0.299f, 0.587f, 0.114f}, false};
constexpr AnaglyphMatrices kColour{{1, 0, 0, 0, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 1, 0, 0, 0, 1}, false};
constexpr AnaglyphMatrices kDubois{{0.437f, 0.449f, 0.164f, -0.062f, -0.062f, -0.024f, -0.048f, -0.050f, -0.017f},
                                   {-0.011f, -0.032f, -0.007f, 0.377f, 0.761f, 0.009f, -0.026f, -0.093f, 1.234f},
                                   true};

// Maps channels to values, and values back to channels, in steps so fine that no two channels share one.
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

constexpr int kRowsAtOnce = 32;

void for_rows(int rows, const std::function<void(int)>& draw) {
  in_parallel(tbb::blocked_range<int>(0, rows, kRowsAtOnce), [&](const tbb::blocked_range<int>& r) {
    for (int y = r.begin(); y < r.end(); ++y) draw(y);
  });
}

template <class T>
const T* row_of(const std::vector<T>& pixels, int width, int y) {
  return pixels.data() + size_t(y) * size_t(width);
}

// The mean of colours is taken for each channel, rounded; that of depths is the nearer one.
uint32_t mean(uint32_t a, uint32_t b) { return (a | b) - ((a ^ b) >> 1 & 0x7f7f7f7fu); }
float mean(float a, float b) { return std::min(a, b); }

// The value of pixels that get no picture because a side is odd.
template <class T>
constexpr T kNothing = T(0xff000000u);
template <>
constexpr float kNothing<float> = std::numeric_limits<float>::infinity();

// The code below works on colours and depths alike.
template <class T>
struct Pictures {
  const std::vector<T>&left, &right;
  std::vector<T>& out;
  int width, height;  // size of an eye's picture

  void side_by_side() const {
    for_rows(height, [&](int y) {
      T* to = out.data() + 2 * size_t(width) * size_t(y);
      std::copy_n(row_of(left, width, y), width, to);
      std::copy_n(row_of(right, width, y), width, to + width);
    });
  }
  void top_bottom() const {
    for_rows(height, [&](int y) {
      std::copy_n(row_of(left, width, y), width, out.data() + size_t(width) * size_t(y));
      std::copy_n(row_of(right, width, y), width, out.data() + size_t(width) * size_t(y + height));
    });
  }
  void side_by_side_half() const {
    const int half = width / 2;
    for_rows(height, [&](int y) {
      T* to = out.data() + size_t(width) * size_t(y);
      const T *l = row_of(left, width, y), *r = row_of(right, width, y);
      for (int x = 0; x < half; ++x) to[x] = mean(l[2 * x], l[2 * x + 1]);
      for (int x = 0; x < half; ++x) to[half + x] = mean(r[2 * x], r[2 * x + 1]);
      std::fill(to + 2 * half, to + width, kNothing<T>);
    });
  }
  void top_bottom_half() const {
    const int half = height / 2;
    for_rows(height, [&](int y) {
      T* to = out.data() + size_t(width) * size_t(y);
      if (y < 2 * half) {
        const T *a = row_of(y < half ? left : right, width, 2 * (y % half)), *b = a + width;
        for (int x = 0; x < width; ++x) to[x] = mean(a[x], b[x]);
      } else {
        std::fill_n(to, width, kNothing<T>);
      }
    });
  }
  // Takes pixels of the left eye where both masks are 0. The masks apply to the lowest bits of row and column.
  void interleave(int row_mask, int column_mask) const {
    for_rows(height, [&](int y) {
      T* to = out.data() + size_t(width) * size_t(y);
      const T *even = row_of(left, width, y), *odd = row_of(right, width, y);
      if (y & row_mask) std::swap(even, odd);
      for (int x = 0; x < width; ++x) to[x] = (x & column_mask ? odd : even)[x];
    });
  }

  void arrange(Mode mode) const {
    switch (mode) {
      case Mode::kSideBySide:
      case Mode::kQuadBuffer:
        return side_by_side();
      case Mode::kSideBySideHalf:
        return side_by_side_half();
      case Mode::kTopBottom:
        return top_bottom();
      case Mode::kTopBottomHalf:
        return top_bottom_half();
      case Mode::kRows:
        return interleave(1, 0);
      case Mode::kColumns:
        return interleave(0, 1);
      case Mode::kChecker:
        return interleave(1, 1);
      default:
        out = left;
    }
  }
};

bool is_anaglyph(Mode mode) {
  return mode == Mode::kAnaglyphGrey || mode == Mode::kAnaglyphColour || mode == Mode::kAnaglyphDubois;
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

void compose(Mode mode, const image::View& left, const image::View& right, image::View& out, bool depth) {
  CHECK(left.width == right.width && left.height == right.height && mode != Mode::kAutostereo);
  const Size size = composed_size(mode, {left.width, left.height});
  const size_t pixels = size_t(size.width) * size_t(size.height);
  const bool with_depth = depth && !left.depth_m.empty() && !right.depth_m.empty();
  out.width = size.width, out.height = size.height;
  out.colour.resize(pixels);
  out.depth_m.resize(with_depth ? pixels : 0);
  if (is_anaglyph(mode)) {
    for_rows(size.height, [&](int y) {
      const size_t at = size_t(y) * size_t(size.width);
      anaglyph(mode, &left.colour[at], &right.colour[at], size_t(size.width), &out.colour[at]);
      for (size_t i = at; with_depth && i < at + size_t(size.width); ++i)
        out.depth_m[i] = std::min(left.depth_m[i], right.depth_m[i]);
    });
    return;
  }
  Pictures<uint32_t>{left.colour, right.colour, out.colour, left.width, left.height}.arrange(mode);
  if (with_depth) Pictures<float>{left.depth_m, right.depth_m, out.depth_m, left.width, left.height}.arrange(mode);
}

}  // namespace telesplat::stereo
