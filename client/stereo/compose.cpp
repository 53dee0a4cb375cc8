#include "client/stereo/compose.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "client/stereo/anaglyph.h"
#include "common/core/check.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::stereo {
namespace {

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

// Channel by channel, rounded.
uint32_t mean(uint32_t a, uint32_t b) { return (a | b) - ((a ^ b) >> 1 & 0x7f7f7f7fu); }
float mean(float a, float b) { return std::min(a, b); }

// Nothing is shown where a side is odd.
template <class T>
constexpr T kNothing = T(0xff000000u);
template <>
constexpr float kNothing<float> = std::numeric_limits<float>::infinity();

// What follows works on colours and depths alike.
template <class T>
struct Pictures {
  const std::vector<T>&left, &right;
  std::vector<T>& out;
  int width, height;  // of an eye's picture

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
  // The left eye's where both masks are 0; they look at the lowest bit of row and column.
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
