#include "services/sampler/volume/shear/hidden.h"

#include <algorithm>
#include <cstddef>

namespace telesplat::sampler {

HiddenPixels::HiddenPixels(int width, int height)
    : width_(width), height_(height), across_((width + 7) / 8), bytes_(size_t(across_) * size_t(height)) {}

void HiddenPixels::shrink(int dx, int dy) {
  if (dx <= 0 && dy <= 0) return;
  // Rows as words, most rows being empty or whole in most of them. A word's neighbours on both sides lend their ends.
  const size_t words = size_t(across_ + 7) / 8;
  std::vector<uint64_t> rows(words * size_t(height_));
  std::vector<uint8_t> some(size_t(height_), 0);
  std::vector<uint64_t> row(words + 2), next(words + 2);
  for (int y = 0; y < height_; ++y) {
    const uint8_t* from = bytes_.data() + size_t(y) * size_t(across_);
    if (std::none_of(from, from + across_, [](uint8_t b) { return b != 0; })) continue;
    some[size_t(y)] = 1;
    std::fill(row.begin(), row.end(), ~uint64_t{0});
    for (size_t w = 0; w < words; ++w) {
      uint64_t bits = 0;
      for (size_t b = 0; b < 8; ++b) {
        const size_t at = w * 8 + b;
        bits |= uint64_t{at < size_t(across_) ? from[at] : uint8_t{255}} << (8 * b);
      }
      const int beyond = int(w + 1) * 64 - width_;  // pixels of this word that lie beyond the raster
      if (beyond > 0) bits |= ~uint64_t{0} << (64 - std::min(beyond, 64));
      row[w + 1] = bits;
    }
    // By 1, 2, 4 ... pixels and the rest, less than a word each.
    for (int left = dx, reached = 1; left > 0; reached *= 2) {
      const int by = std::min({left, reached, 63});
      for (size_t w = 1; w <= words; ++w) {
        const uint64_t from_left = row[w] << by | row[w - 1] >> (64 - by);
        const uint64_t from_right = row[w] >> by | row[w + 1] << (64 - by);
        next[w] = row[w] & from_left & from_right;
      }
      std::swap(row, next);
      row.front() = row.back() = next.front() = next.back() = ~uint64_t{0};
      left -= by;
    }
    std::copy(row.begin() + 1, row.end() - 1, rows.begin() + std::ptrdiff_t(size_t(y) * words));
  }
  for (int y = 0; y < height_; ++y) {
    uint8_t* to = bytes_.data() + size_t(y) * size_t(across_);
    if (!some[size_t(y)]) continue;
    const int lo = std::max(y - dy, 0), hi = std::min(y + dy, height_ - 1);
    for (size_t w = 0; w < words; ++w) {
      uint64_t bits = ~uint64_t{0};
      for (int other = lo; other <= hi && bits != 0; ++other) bits &= rows[size_t(other) * words + w];
      for (size_t b = 0; b < 8 && w * 8 + b < size_t(across_); ++b) to[w * 8 + b] = uint8_t(bits >> (8 * b));
    }
  }
}

}  // namespace telesplat::sampler
