#include "common/codec/dense/depth.h"

#include <algorithm>
#include <array>

#include "common/image/depth_image.h"

namespace telesplat::codec::detail {
namespace {

// What L and UL of a row's first pixel are: so it is predicted from the two above it.
void begin_row(Plane<uint32_t>& depth, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  depth.row(r)[-1] = depth.row(r)[-2] = depth.row(r - 1)[0];
}

// What UR of a row's last pixels is.
void end_row(Plane<uint32_t>& depth, size_t y, size_t width) {
  uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
  const uint32_t slope = width > 1 ? row[width - 1] - row[width - 2] : 0;
  row[width] = row[width - 1] + slope, row[width + 1] = row[width] + slope;
}

// Calls covered(begin, end) for the runs of row y, in order. Pixels that are not covered become L + U - UL: what U
// differs by from the last one that is covered stays.
template <class F>
void with_holes(const uint32_t* above, const TileShape& shape, size_t y, uint32_t* row, F covered) {
  ptrdiff_t from = 0;
  const auto fill = [&](ptrdiff_t end) {
    const uint32_t off = row[from - 1] - above[from - 1];
    for (ptrdiff_t x = from; x < end; ++x) row[x] = (above[x] + off) & image::kMaxDepthCode;
  };
  shape.for_each_run(y, [&](size_t begin, size_t end) {
    const auto first = static_cast<ptrdiff_t>(begin), last = static_cast<ptrdiff_t>(end);
    fill(first);
    covered(first, last);
    from = last;
  });
  fill(static_cast<ptrdiff_t>(shape.width));
}

// Four times the mean of L + U - UL, 2 L - LL, 2 U - UU and L + UR - U, all but the terms of L and LL, and 2.
uint32_t mean_terms(const uint32_t* above2, const uint32_t* above, size_t x) {
  return 2 * above[x] - above[x - 1] - above2[x] + above[x + 1] + 2;
}

// The mean is rounded up from half. Where it was rounded down, a pixel lies rather above than below it: there signs are
// turned, so that what is likelier has the smaller number.
constexpr uint32_t kAbove = 3;

void mean_residuals(const uint32_t* above2, const uint32_t* above, const uint32_t* row, size_t n, uint32_t* z,
                    uint8_t* tokens) {
  for (size_t x = 0; x < n; ++x) {
    const uint32_t sum = 4 * row[x - 1] - row[x - 2] + mean_terms(above2, above, x);
    const uint32_t turned = 0 - static_cast<uint32_t>((sum & 3) == kAbove);
    const uint32_t off = (row[x] - static_cast<uint32_t>(static_cast<int32_t>(sum) >> 2)) << 8;
    const uint32_t v = (off ^ turned) - turned;
    z[x] = ((v << 1) ^ static_cast<uint32_t>(static_cast<int32_t>(v) >> 31)) >> 8;
    tokens[x] = static_cast<uint8_t>(token_of(z[x]));
  }
}

}  // namespace

void DepthPlane::reset(const TileShape& shape, uint32_t base) {
  depth.reset(shape.width, shape.height);
  depth.fill_row(-1, base), depth.fill_row(-2, base);
  symbols.reset(shape, true);
  in_steps = false;
}

void DepthPlane::encode(const TileShape& shape, uint32_t base, bool may_mean) {
  depth.fill_row(-1, base), depth.fill_row(-2, base);
  for (size_t y = 0; y < shape.height; ++y) {
    begin_row(depth, y);
    with_holes(depth.row(static_cast<ptrdiff_t>(y) - 1), shape, y, depth.row(static_cast<ptrdiff_t>(y)),
               [](ptrdiff_t, ptrdiff_t) {});
    end_row(depth, y, shape.width);
  }
  way = choose_way(shape, may_mean);
  symbols.reset(shape, true, way == kPlanes ? kHits : 0);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.span(y);
    const uint32_t *const above2 = depth.row(r - 2) + begin, *const above = depth.row(r - 1) + begin,
                          *const row = depth.row(r) + begin;
    uint32_t* const z = symbols.wide.row(r) + begin;
    uint8_t* const tokens = symbols.tokens.row(r) + begin;
    if (way == kMean)
      mean_residuals(above2, above, row, end - begin, z, tokens);
    else if (way == kPlanes)
      kernels().plane_residuals(above2, above, row, end - begin, z, tokens);
    else
      kernels().depth_residuals(above, row, end - begin, z, tokens);
    finish_tokens(symbols, shape, y);
  }
}

void DepthPlane::to_indices(const TileShape& shape, const DepthLattice& lattice) {
  in_steps = true;
  for (size_t y = 0; y < shape.height; ++y) {
    uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape.width; ++x) row[x] = lattice.index(row[x]);  // 0, nothing, is an index of its own
  }
}

// What is predicted of pixels that are not covered may be no index: the last one.
void DepthPlane::to_codes(const TileShape& shape, const DepthLattice& lattice) {
  const uint32_t* const codes = lattice.codes();
  const uint32_t last = lattice.last();
  for (size_t y = 0; y < shape.height; ++y) {
    uint32_t* const row = depth.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape.width; ++x) row[x] = codes[std::min(row[x], last)];
  }
}

// Tries every sixteenth row: which tokens take fewer bits.
DepthPlane::Way DepthPlane::choose_way(const TileShape& shape, bool may_mean) {
  symbols.reset(shape, true, kHits);
  std::array<uint32_t, kSymbols> linear{}, planes{}, means{};
  uint64_t linear_bits = 0, plane_bits = 0, mean_bits = 0;
  for (size_t y = 2; y < shape.height; y += 16) {
    const auto r = static_cast<ptrdiff_t>(y);
    const uint32_t* const z = symbols.wide.row(r);
    const uint8_t* const tokens = symbols.tokens.row(r);
    kernels().plane_residuals(depth.row(r - 2), depth.row(r - 1), depth.row(r), shape.width, symbols.wide.row(r),
                              symbols.tokens.row(r));
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) {
        const uint32_t token = token_of(z[x]);
        ++linear[token], linear_bits += token >> 3;
        ++planes[tokens[x]], plane_bits += tokens[x] < kHits ? 0 : token >> 3;
      }
    });
    if (!may_mean) continue;
    mean_residuals(depth.row(r - 2), depth.row(r - 1), depth.row(r), shape.width, symbols.wide.row(r),
                   symbols.tokens.row(r));
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) ++means[tokens[x]], mean_bits += tokens[x] >> 3;
    });
  }
  const double by_line = static_cast<double>(linear_bits) + bits_of(linear, kSymbols),
               by_planes = static_cast<double>(plane_bits) + bits_of(planes, kSymbols),
               by_mean = static_cast<double>(mean_bits) + bits_of(means, kSymbols);
  faceted = by_planes < by_line;
  if (may_mean && by_mean < std::min(by_line, by_planes)) return kMean;
  return faceted ? kPlanes : kLinear;
}

void DepthPlane::put_way(BitSink& bits, bool may_mean) const { bits.put(way, may_mean ? 2 : 1); }

bool DepthPlane::begin_decoding(const TileShape& shape, bool may_mean, BitReader& bits) {
  way = static_cast<Way>(bits.source.take(may_mean ? 2 : 1));
  symbols.reset(shape, true, way == kPlanes ? kHits : 0);
  return way <= kMean;
}

void DepthPlane::decode_by_mean(const TileShape& shape, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  uint32_t* const row = depth.row(r);
  const uint32_t *const above = depth.row(r - 1), *const above2 = depth.row(r - 2);
  const uint32_t* const z = symbols.wide.row(r);
  for (auto& terms : terms_)
    if (terms.size() < shape.width + 64) terms.resize(shape.width + 64);
  uint32_t *const terms = terms_[0].data(), *const offs = terms_[1].data();
  for (size_t x = 0; x < shape.width; ++x)
    terms[x] = mean_terms(above2, above, x), offs[x] = (z[x] >> 1) ^ (0 - (z[x] & 1));
  with_holes(above, shape, y, row, [&](ptrdiff_t x, ptrdiff_t end) {
    uint32_t past = row[x - 2], left = row[x - 1];
    for (; x < end; ++x) {
      const uint32_t sum = 4 * left + (terms[x] - past);
      const uint32_t off = (sum & 3) == kAbove ? 0 - offs[x] : offs[x];
      past = left, left = (static_cast<uint32_t>(static_cast<int32_t>(sum) >> 2) + off) & image::kMaxDepthCode;
      row[x] = left;
    }
  });
}

void DepthPlane::decode_by_planes(const TileShape& shape, size_t y) {
  const size_t width = shape.width;
  const auto r = static_cast<ptrdiff_t>(y);
  for (auto& terms : terms_)
    if (terms.size() < width + 64) terms.resize(width + 64);
  uint32_t *const terms = terms_[0].data(), *const take_left = terms_[1].data(), *const take_slope = terms_[2].data();
  kernels().plane_terms(depth.row(r - 2), depth.row(r - 1), symbols.wide.row(r), symbols.tokens.row(r), shape.cover(y),
                        width, terms, take_left, take_slope);
  uint32_t* const row = depth.row(r);
  uint32_t left = row[-1], slope = 0;
  for (size_t x = 0; x < width; ++x) {
    const uint32_t next = terms[x] + (left & take_left[x]) + (slope & take_slope[x]);
    slope = next - left, left = next;  // modulo 2^32, which is as good
    row[x] = next & image::kMaxDepthCode;
  }
}

bool DepthPlane::decode_row(const TileShape& shape, size_t y, uint32_t most) {
  const auto r = static_cast<ptrdiff_t>(y);
  begin_row(depth, y);
  uint32_t* const row = depth.row(r);
  if (way == kMean) {
    decode_by_mean(shape, y);
  } else if (way == kPlanes) {
    decode_by_planes(shape, y);
  } else {
    kernels().depth_rows(depth.row(r - 1), symbols.wide.row(r), shape.width, row);
  }
  end_row(depth, y, shape.width);
  return kernels().largest_less_one(shape.cover(y), row, shape.width) < most;  // 0 becomes the largest number
}

void DepthPlane::extend(const TileShape& shape) {
  const size_t w = shape.width;
  const auto h = static_cast<ptrdiff_t>(shape.height);
  for (ptrdiff_t y = 0; y < h; ++y) {
    uint32_t* const row = depth.row(y);
    row[-1] = w > 1 ? 2 * row[0] - row[1] : row[0];
    row[-2] = 2 * row[-1] - row[0];
    row[w] = w > 1 ? 2 * row[w - 1] - row[w - 2] : row[w - 1];
  }
  for (ptrdiff_t x = -2; x < static_cast<ptrdiff_t>(w); ++x) {
    depth.row(-1)[x] = h > 1 ? 2 * depth.row(0)[x] - depth.row(1)[x] : depth.row(0)[x];
    depth.row(-2)[x] = 2 * depth.row(-1)[x] - depth.row(0)[x];
    depth.row(h)[x] = h > 1 ? 2 * depth.row(h - 1)[x] - depth.row(h - 2)[x] : depth.row(h - 1)[x];
  }
}

}  // namespace telesplat::codec::detail
