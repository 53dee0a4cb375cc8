#include "common/codec/dense/depth.h"

#include <algorithm>
#include <array>

#include "common/image/depth_image.h"

namespace telesplat::codec::detail {
namespace {

using image::kMaxDepthCode;

// Sets L and UL of a row's first pixel to the pixel above it.
void begin_row(Plane<uint32_t>& depth, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  depth.row(r)[-1] = depth.row(r)[-2] = depth.row(r - 1)[0];
}

// Sets UR of a row's last pixels.
void end_row(Plane<uint32_t>& depth, size_t y, size_t width) {
  uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
  const uint32_t slope = width > 1 ? row[width - 1] - row[width - 2] : 0;
  row[width] = row[width - 1] + slope, row[width + 1] = row[width] + slope;
}

// Calls covered(begin, end) for the covered runs of row y, in order. Sets other pixels to L + U - UL.
template <class F>
void with_holes(const uint32_t* above, const TileShape& shape, size_t y, uint32_t* row, F covered) {
  ptrdiff_t from = 0;
  const auto fill = [&](ptrdiff_t end) {
    const uint32_t off = row[from - 1] - above[from - 1];
    for (ptrdiff_t x = from; x < end; ++x) row[x] = (above[x] + off) & kMaxDepthCode;
  };
  shape.for_each_run(y, [&](size_t begin, size_t end) {
    const auto first = static_cast<ptrdiff_t>(begin), last = static_cast<ptrdiff_t>(end);
    fill(first);
    covered(first, last);
    from = last;
  });
  fill(static_cast<ptrdiff_t>(shape.width));
}

// Four times the mean of L + U - UL, 2 L - LL, 2 U - UU and L + UR - U, without the terms of L and LL, plus 2.
uint32_t mean_terms(const uint32_t* above2, const uint32_t* above, ptrdiff_t x) {
  return 2 * above[x] - above[x - 1] - above2[x] + above[x + 1] + 2;
}

// mean_of() rounds halves up. If it rounded the mean down, a pixel lies more likely above it than below: then the sign
// is turned, so that the likelier sign has the smaller number.
uint32_t turn_if_rounded_down(uint32_t off, uint32_t sum) { return (sum & 3) == 3 ? 0 - off : off; }
uint32_t mean_of(uint32_t sum) { return static_cast<uint32_t>(static_cast<int32_t>(sum) >> 2); }

}  // namespace

void DepthPlane::reset(const TileShape& shape, uint32_t base) {
  depth.reset(shape.width, shape.height);
  depth.fill_row(-1, base), depth.fill_row(-2, base);
}

void DepthPlane::find_residuals(const TileShape& shape, size_t y, Way by) {
  const auto r = static_cast<ptrdiff_t>(y);
  const uint32_t *const above2 = depth.row(r - 2), *const above = depth.row(r - 1), *const row = depth.row(r);
  uint32_t* const z = symbols.z.row(r);
  uint8_t* const tokens = symbols.tokens.row(r);
  if (by == kPlanes) return plane_residuals(above2, above, row, shape.width, z, tokens);
  if (by == kLinear) depth_residuals(above, row, shape.width, z);
  if (by == kMean)
    for (ptrdiff_t x = 0; x < static_cast<ptrdiff_t>(shape.width); ++x) {
      const uint32_t sum = 4 * row[x - 1] - row[x - 2] + mean_terms(above2, above, x);
      z[x] = fold24(turn_if_rounded_down(row[x] - mean_of(sum), sum));
    }
  tokens_of(z, shape.width, tokens);
}

// Estimates the bits from every sixteenth row.
double DepthPlane::bits_by(const TileShape& shape, Way by) {
  std::array<uint32_t, kSymbols> counts{};
  uint64_t raw = 0;
  for (size_t y = 2; y < shape.height; y += 16) {
    find_residuals(shape, y, by);
    const uint8_t* const tokens = symbols.tokens.row(static_cast<ptrdiff_t>(y));
    const unsigned first = by == kPlanes ? kHits : 0;
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) ++counts[tokens[x]], raw += tokens[x] < first ? 0 : (tokens[x] - first) >> 3;
    });
  }
  return static_cast<double>(raw) + bits_of(counts, kSymbols);
}

void DepthPlane::encode(const TileShape& shape, bool may_mean) {
  for (size_t y = 0; y < shape.height; ++y) {
    begin_row(depth, y);
    with_holes(depth.row(static_cast<ptrdiff_t>(y) - 1), shape, y, depth.row(static_cast<ptrdiff_t>(y)),
               [](ptrdiff_t, ptrdiff_t) {});
    end_row(depth, y, shape.width);
  }
  symbols.reset(shape, false);
  const double by_line = bits_by(shape, kLinear), by_planes = bits_by(shape, kPlanes);
  way = by_planes < by_line ? kPlanes : kLinear;
  if (may_mean && bits_by(shape, kMean) < std::min(by_line, by_planes)) way = kMean;
  symbols.reset(shape, false, way == kPlanes ? kHits : 0);
  for (size_t y = 0; y < shape.height; ++y) find_residuals(shape, y, way), finish_tokens(symbols, shape, y);
}

void DepthPlane::to_indices(const TileShape& shape, const DepthLattice& lattice) {
  for (size_t y = 0; y < shape.height; ++y) {
    uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape.width; ++x) row[x] = lattice.index(row[x]);  // 0, a hole, has its own index
  }
}

// Pixels that are not covered may have predictions beyond the last index: those become the last one.
void DepthPlane::to_codes(const TileShape& shape, const DepthLattice& lattice) {
  const uint32_t* const codes = lattice.codes();
  const uint32_t last = lattice.last();
  for (size_t y = 0; y < shape.height; ++y) {
    uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape.width; ++x) row[x] = codes[std::min(row[x], last)];
  }
}

bool DepthPlane::begin_decoding(const TileShape& shape, BitReader& bits) {
  way = static_cast<Way>(bits.source.take(kWayBits));
  symbols.reset(shape, false, way == kPlanes ? kHits : 0);
  return way <= kMean;
}

void DepthPlane::decode_by_planes(const TileShape& shape, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  for (auto& terms : terms_)
    if (terms.size() < shape.width) terms.resize(shape.width);
  const PlaneTerms of{terms_[0].data(), terms_[1].data(), terms_[2].data()};
  plane_terms(depth.row(r - 2), depth.row(r - 1), symbols.z.row(r), symbols.tokens.row(r), shape.width, of);
  uint32_t* const row = depth.row(r);
  with_holes(depth.row(r - 1), shape, y, row, [&](ptrdiff_t x, ptrdiff_t end) {
    uint32_t left = row[x - 1], slope = left - row[x - 2];
    for (; x < end; ++x) {
      const uint32_t next = of.terms[x] + (left & of.take_left[x]) + (slope & of.take_slope[x]);
      slope = next - left, left = next;  // modulo 2^32, which the mask below makes exact
      row[x] = next & kMaxDepthCode;
    }
  });
}

bool DepthPlane::decode_row(const TileShape& shape, size_t y, uint32_t most) {
  const auto r = static_cast<ptrdiff_t>(y);
  begin_row(depth, y);
  uint32_t* const row = depth.row(r);
  const uint32_t *const above = depth.row(r - 1), *const above2 = depth.row(r - 2), *const z = symbols.z.row(r);
  if (way == kPlanes)
    decode_by_planes(shape, y);
  else if (way == kLinear)
    with_holes(above, shape, y, row, [&](ptrdiff_t x, ptrdiff_t end) {
      for (uint32_t off = row[x - 1] - above[x - 1]; x < end; ++x)
        off += static_cast<uint32_t>(unfold(z[x])), row[x] = (above[x] + off) & kMaxDepthCode;
    });
  else
    with_holes(above, shape, y, row, [&](ptrdiff_t x, ptrdiff_t end) {
      for (; x < end; ++x) {
        const uint32_t sum = 4 * row[x - 1] - row[x - 2] + mean_terms(above2, above, x);
        const uint32_t off = turn_if_rounded_down(static_cast<uint32_t>(unfold(z[x])), sum);
        row[x] = (mean_of(sum) + off) & kMaxDepthCode;
      }
    });
  end_row(depth, y, shape.width);
  uint32_t largest = 0;  // largest depth - 1, so that 0 wraps to the largest number
  shape.for_each_run(y, [&](size_t x, size_t end) {
    for (; x < end; ++x) largest = std::max(largest, row[x] - 1);
  });
  return largest < most;
}

void DepthPlane::extend(const TileShape& shape) {
  const size_t w = shape.width;
  const auto h = static_cast<ptrdiff_t>(shape.height);
  for (ptrdiff_t y = 0; y < h; ++y) {
    uint32_t* const row = depth.row(y);
    row[-1] = w > 1 ? 2 * row[0] - row[1] : row[0];
    row[w] = w > 1 ? 2 * row[w - 1] - row[w - 2] : row[w - 1];
  }
  for (ptrdiff_t x = -1; x <= static_cast<ptrdiff_t>(w); ++x) {
    depth.row(-1)[x] = h > 1 ? 2 * depth.row(0)[x] - depth.row(1)[x] : depth.row(0)[x];
    depth.row(h)[x] = h > 1 ? 2 * depth.row(h - 1)[x] - depth.row(h - 2)[x] : depth.row(h - 1)[x];
  }
}

}  // namespace telesplat::codec::detail
