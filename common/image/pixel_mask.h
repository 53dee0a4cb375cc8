// A set of pixels in a rectangle: those that are covered, or those whose rays are cast.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace telesplat::image {

/// Number of set bits. std::popcount() would be a library call if the build may not assume the processor's own
/// instruction.
inline uint32_t set_bits(uint64_t word) {
  word -= word >> 1 & 0x5555555555555555;
  word = (word & 0x3333333333333333) + (word >> 2 & 0x3333333333333333);
  return static_cast<uint32_t>(((word + (word >> 4)) & 0x0F0F0F0F0F0F0F0F) * 0x0101010101010101 >> 56);
}

/// One bit a pixel, rows padded to whole 64-bit words with zeros, pixel x of a row at bit x % 64 of word x / 64.
class PixelMask {
 public:
  PixelMask() = default;
  PixelMask(int width, int height) { reset(width, height); }
  /// Sets the size; all bits become zero.
  void reset(int width, int height) {
    width_ = width, height_ = height, words_per_row_ = (static_cast<size_t>(width) + 63) / 64;
    words_.assign(words_per_row_ * static_cast<size_t>(height), 0);
  }
  int width() const { return width_; }
  int height() const { return height_; }
  size_t words_per_row() const { return words_per_row_; }
  uint64_t* row(int y) { return words_.data() + words_per_row_ * static_cast<size_t>(y); }
  const uint64_t* row(int y) const { return words_.data() + words_per_row_ * static_cast<size_t>(y); }
  bool at(int x, int y) const { return (row(y)[x >> 6] >> (x & 63) & 1) != 0; }
  void set(int x, int y) { row(y)[x >> 6] |= uint64_t{1} << (x & 63); }
  void clear(int x, int y) { row(y)[x >> 6] &= ~(uint64_t{1} << (x & 63)); }
  size_t count() const {
    size_t n = 0;
    for (const uint64_t word : words_) n += set_bits(word);
    return n;
  }
  /// Number of maximal runs of covered pixels within rows.
  size_t runs() const {
    size_t n = 0;
    for (int y = 0; y < height_; ++y)
      for (size_t w = 0; w < words_per_row_; ++w) {
        const uint64_t word = row(y)[w], last = w == 0 ? 0 : row(y)[w - 1] >> 63;
        n += set_bits(word & ~(word << 1 | last));
      }
    return n;
  }

  bool operator==(const PixelMask&) const = default;

 private:
  int width_ = 0, height_ = 0;
  size_t words_per_row_ = 0;
  std::vector<uint64_t> words_;
};

/// Calls f(x) for every set bit of one row, in order.
template <class F>
void for_each_set(const uint64_t* words, size_t word_count, F f) {
  for (size_t w = 0; w < word_count; ++w)
    for (uint64_t rest = words[w]; rest != 0; rest &= rest - 1) f(w * 64 + static_cast<size_t>(std::countr_zero(rest)));
}

}  // namespace telesplat::image
