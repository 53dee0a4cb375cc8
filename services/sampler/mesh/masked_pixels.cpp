#include "services/sampler/mesh/masked_pixels.h"

#include <algorithm>
#include <bit>

namespace telesplat::sampler {
namespace {

constexpr int kSquare = 32, kCell = 8;  // pixels a side
constexpr int kCellsAcross = kSquare / kCell;

// Column and row of place i along the Z curve through a square of cells: even bits of i are x, odd ones y.
constexpr int column_of(int i) { return (i & 1) | (i >> 1 & 2); }
constexpr int row_of(int i) { return column_of(i >> 1); }

// Returns eight pixels of a row as bits; pixels beyond the mask are not covered. x: a multiple of 8.
uint32_t bits(const image::PixelMask& mask, int x, int y) {
  if (x >= mask.width() || y >= mask.height()) return 0;
  return static_cast<uint32_t>(mask.row(y)[x >> 6] >> (x & 63)) & 255u;
}

void gather_cell(const image::PixelMask& mask, int x, int y, std::vector<MaskedPixel>& out) {
  uint32_t rows[kCell], any = 0;
  for (int i = 0; i < kCell; ++i) any |= rows[i] = bits(mask, x, y + i);
  if (any == 0) return;
  for (int i = 0; i < kCell; ++i) {  // blocks of 4 x 2
    const int left = 4 * (i & 1), top = i & ~1;
    uint32_t block = (rows[top] >> left & 15) | (rows[top + 1] >> left & 15) << 4;
    for (; block != 0; block &= block - 1) {
      const int bit = std::countr_zero(block);
      out.push_back({static_cast<int16_t>(x + left + (bit & 3)), static_cast<int16_t>(y + top + (bit >> 2))});
    }
  }
}

}  // namespace

std::vector<MaskedPixel> gather(const image::PixelMask& mask) {
  std::vector<MaskedPixel> out;
  out.reserve(mask.count());
  for (int y = 0; y < mask.height(); y += kSquare)
    for (int x = 0; x < mask.width(); x += kSquare)
      for (int i = 0; i < kCellsAcross * kCellsAcross; ++i)
        gather_cell(mask, x + kCell * column_of(i), y + kCell * row_of(i), out);
  return out;
}

}  // namespace telesplat::sampler
