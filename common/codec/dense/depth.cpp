#include "common/codec/dense/depth.h"

#include <algorithm>

#include "common/image/depth_image.h"

namespace telesplat::codec::detail {
namespace {

// What L and UL of a row's first pixel are: so it is predicted from the two above it.
void begin_row(Plane<uint32_t>& depth, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  depth.row(r)[-1] = depth.row(r)[-2] = depth.row(r - 1)[0];
}

}  // namespace

void DepthPlane::reset(const TileShape& shape, uint32_t base) {
  depth.reset(shape.width, shape.height);
  depth.fill_row(-1, base), depth.fill_row(-2, base);
  symbols.reset(shape, true);
}

void DepthPlane::encode(const TileShape& shape, uint32_t base) {
  symbols.reset(shape, true);
  depth.fill_row(-1, base), depth.fill_row(-2, base);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    begin_row(depth, y);
    uint32_t* const row = depth.row(r);
    const uint32_t* const above = depth.row(r - 1);
    shape.for_each_hole(y, [&](size_t x) { row[x] = (row[x - 1] + above[x] - above[x - 1]) & image::kMaxDepthCode; });
    kernels().depth_residuals(above, row, shape.width, symbols.wide.row(r), symbols.tokens.row(r));
    finish_tokens(symbols, shape, y);
  }
}

bool DepthPlane::decode_row(const TileShape& shape, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  begin_row(depth, y);
  uint32_t* const row = depth.row(r);
  kernels().depth_rows(depth.row(r - 1), symbols.wide.row(r), shape.width, row);
  uint32_t least = 1;
  if (shape.full(y))
    for (size_t x = 0; x < shape.width; ++x) least = std::min(least, row[x]);
  else
    for_each_set(shape.mask->row(static_cast<int>(y)), shape.mask->words_per_row(),
                 [&](size_t x) { least = std::min(least, row[x]); });
  return least != 0;
}

void DepthPlane::extend(const TileShape& shape) {
  const size_t w = shape.width;
  const auto h = static_cast<ptrdiff_t>(shape.height);
  for (ptrdiff_t y = 0; y < h; ++y) {
    uint32_t* const row = depth.row(y);
    row[-1] = w > 1 ? 2 * row[0] - row[1] : row[0];
    row[w] = w > 1 ? 2 * row[w - 1] - row[w - 2] : row[w - 1];
  }
  for (size_t x = 0; x < w; ++x) {
    depth.row(-1)[x] = h > 1 ? 2 * depth.row(0)[x] - depth.row(1)[x] : depth.row(0)[x];
    depth.row(h)[x] = h > 1 ? 2 * depth.row(h - 1)[x] - depth.row(h - 2)[x] : depth.row(h - 1)[x];
  }
}

}  // namespace telesplat::codec::detail
