// Rows of a tile with borders around them, so that kernels need no special cases at edges.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace telesplat::codec::detail {

/// A plane of width x height elements with a border: two rows above and two below, and in each row kLead elements to
/// the left and kTail to the right. Kernels may read and write whole vectors beyond a row's end.
template <class T>
class Plane {
 public:
  static constexpr size_t kLead = 32, kTail = 64;
  static constexpr ptrdiff_t kRows = 2;
  /// Sets the size. Elements are undefined afterwards.
  void reset(size_t width, size_t height) {
    stride_ = (width + kLead + kTail + 31) / 32 * 32;
    const size_t needed = stride_ * (height + 2 * kRows);
    if (elements_.size() < needed) elements_.resize(needed);
  }
  T* row(ptrdiff_t y) { return elements_.data() + stride_ * static_cast<size_t>(y + kRows) + kLead; }
  const T* row(ptrdiff_t y) const { return elements_.data() + stride_ * static_cast<size_t>(y + kRows) + kLead; }
  /// Sets elements [-kLead, width + kTail) of row y.
  void fill_row(ptrdiff_t y, T value) {
    T* const first = row(y) - kLead;
    for (size_t i = 0; i < stride_; ++i) first[i] = value;
  }

 private:
  size_t stride_ = 0;
  std::vector<T> elements_;
};

/// A tile's rows within its image, or a copy of them.
template <class T>
struct PixelRows {
  const T* first = nullptr;
  size_t stride = 0;
  const T* row(size_t y) const { return first + y * stride; }
};

}  // namespace telesplat::codec::detail
