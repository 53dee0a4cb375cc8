// Rows of voxels to lines of pixels: the horizontal half of resampling a slice.
#if defined(TELESPLAT_SHEAR_RESAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SHEAR_RESAMPLE_INL_H_
#undef TELESPLAT_SHEAR_RESAMPLE_INL_H_
#else
#define TELESPLAT_SHEAR_RESAMPLE_INL_H_
#endif

#include <algorithm>
#include <bit>
#include <cmath>

#include "services/sampler/shear_quad-inl.h"
#include "services/sampler/shear_scene.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

// Pixels of a block: as many lanes as the target has, up to a block's.
using Pixels = hn::CappedTag<float, kSplatBlock>;
using PixelIndices = hn::RebindToSigned<Pixels>;

inline constexpr int kBlockFloats = 4 * kSplatBlock;  // r, g, b, extinction (or light left), 8 of each

// A line or pixel row of a tile.
struct Line {
  uint64_t mask = 0;  // blocks that mean something
  int row = 0;
  alignas(64) float at[kTileBlocks * kBlockFloats];
};

// Voxels of a row, side by side, 0 where there are none: (r, g, b, extinction) of index u stands at 4 * (u + kMargin).
inline constexpr int kMargin = 16;
struct DenseRow {
  alignas(64) float at[4 * (volume::kMaxSide + 2 * kMargin)] = {};
};

// How the columns of a slice lie in a tile. Index coordinates are counted from `base`, so that single precision is enough.
struct TileColumns {
  int base;
  float origin, pitch;         // index coordinate, less base, of the tile's first pixel centre; per pixel
  float inverse, reach;        // pixels a voxel; how many pixels from its centre a voxel reaches
  float radius;                // the kernel's, voxels: more than 1 where a pixel is larger than a voxel
  int lattice_lo, lattice_hi;  // less base
  int begin, end;              // pixels that may be written, from the tile's first
  int u_lo, u_hi;              // voxels that reach into it
  int own_lo, own_hi;          // voxels whose centres lie in it: counted here
};

inline TileColumns columns_of(const SliceAxis& axis, int x0, int width) {
  TileColumns c;
  const double first = axis.origin + axis.pitch * x0;
  c.base = int(std::floor(first));
  c.origin = float(first - c.base);
  c.pitch = float(axis.pitch);
  c.inverse = float(1 / axis.pitch);
  const double radius = std::max(1.0, axis.pitch);
  c.radius = float(radius);
  c.reach = float(radius / axis.pitch);
  const auto bound = [&](double v) { return int(std::clamp(v - c.base, -1e6, 1e6)); };
  c.lattice_lo = bound(axis.lattice_lo), c.lattice_hi = bound(axis.lattice_hi);
  c.begin = std::max(axis.begin - x0, 0), c.end = std::min(axis.end - x0, width);
  c.u_lo = int(std::ceil(axis.origin + axis.pitch * (x0 + c.begin) - radius));
  c.u_hi = int(std::floor(axis.origin + axis.pitch * (x0 + c.end - 1) + radius));
  c.own_lo = int(std::ceil(axis.origin + axis.pitch * (x0 + c.begin - 0.5)));
  c.own_hi = int(std::ceil(axis.origin + axis.pitch * (x0 + c.end - 0.5))) - 1;
  return c;
}

// Blocks [first, last].
inline uint64_t blocks(int first, int last) { return (~uint64_t{0} << first) & (~uint64_t{0} >> (63 - last)); }

// A block's pixels where a voxel is at least as large as a pixel: linear between the voxels on both sides.
HWY_INLINE void MagnifyBlock(const TileColumns& c, const DenseRow& dense, int block, float* to) {
  const Pixels d;
  const PixelIndices di;
  alignas(32) int32_t index[kSplatBlock];
  alignas(32) float weight[kSplatBlock];
  for (size_t l = 0; l < kSplatBlock; l += hn::Lanes(d)) {
    const auto x = hn::Iota(d, float(block * kSplatBlock + int(l)));
    const auto at = hn::Add(hn::Set(d, c.origin), hn::Mul(hn::Set(d, c.pitch), x));
    const auto floor = hn::Floor(at);
    hn::Store(hn::ConvertTo(di, floor), di, index + l);
    hn::Store(hn::Sub(at, floor), d, weight + l);
  }
  const float* base = dense.at + 4 * (c.base + kMargin);
  const auto pixel = [&](int n) HWY_ATTR {
    const float* p = base + 4 * index[n];
    const auto a = LoadQuad(p), b = LoadQuad(p + 4);
    return Add(a, Mul(Sub(b, a), QuadOf(weight[n])));
  };
  StoreTransposed(pixel(0), pixel(1), pixel(2), pixel(3), to, kSplatBlock);
  StoreTransposed(pixel(4), pixel(5), pixel(6), pixel(7), to + 4, kSplatBlock);
}

// Where a pixel is larger: the mean of the voxels within a pixel's width on both sides, weighted by a tent.
HWY_INLINE void MinifyBlock(const TileColumns& c, const DenseRow& dense, int block, int size_u, float* to) {
  const float inverse_radius = 1 / c.radius;
  const auto pixel = [&](int n) HWY_ATTR {
    const float at = c.origin + c.pitch * float(block * kSplatBlock + n);
    const int lo = std::max(int(std::ceil(at - c.radius)), c.lattice_lo);
    const int hi = std::min(int(std::floor(at + c.radius)), c.lattice_hi);
    Quad sum = QuadOf(0);
    float weights = 0;
    for (int i = lo; i <= hi; ++i) {
      const float w = 1 - std::abs(float(i) - at) * inverse_radius;
      if (!(w > 0)) continue;
      weights += w;
      const int u = i + c.base;
      if (u >= 0 && u < size_u) sum = Add(sum, Mul(LoadQuad(dense.at + 4 * (u + kMargin)), QuadOf(w)));
    }
    return weights > 0 ? Mul(sum, QuadOf(1 / weights)) : sum;
  };
  // Pixel after pixel, not in an argument list, whose order is nobody's.
  for (int half = 0; half < kSplatBlock; half += 4) {
    const auto p0 = pixel(half), p1 = pixel(half + 1), p2 = pixel(half + 2), p3 = pixel(half + 3);
    StoreTransposed(p0, p1, p2, p3, to + half, kSplatBlock);
  }
}

// Nothing beside the pixels [begin, end).
HWY_INLINE void TrimBlock(const TileColumns& c, int block, float* to) {
  for (int n = 0; n < kSplatBlock; ++n) {
    const int x = block * kSplatBlock + n;
    if (x >= c.begin && x < c.end) continue;
    for (int channel = 0; channel < 4; ++channel) to[channel * kSplatBlock + n] = 0;
  }
}

// The line of a row of cells, of `needed` blocks alone. Returns how many voxels it was made of, counted where their centres lie.
inline uint64_t ResampleRow(const SplatScene& scene, const TileColumns& c, const ShearCell* begin, const ShearCell* end,
                            uint64_t needed, DenseRow& dense, Line& line) {
  line.mask = 0;
  if (end - begin > 16)
    begin = std::lower_bound(begin, end, c.u_lo, [](const ShearCell& cell, int u) { return int(cell.u) < u; });
  else
    while (begin != end && int(begin->u) < c.u_lo) ++begin;
  float* at = dense.at + 4 * kMargin;
  uint64_t mask = 0, voxels = 0;
  // Runs of voxels side by side reach the blocks of the pixels between half-open ends.
  int run = -2, last = -2;
  const auto close = [&]() HWY_ATTR {
    if (run < 0) return;
    const float from = (float(run - c.base) - c.origin) * c.inverse - c.reach;
    const float to = (float(last - c.base) - c.origin) * c.inverse + c.reach;
    const int lo = std::max(int(std::ceil(from)), c.begin), hi = std::min(int(std::floor(to)), c.end - 1);
    if (lo <= hi) mask |= blocks(lo / kSplatBlock, hi / kSplatBlock);
    voxels += uint64_t(std::max(std::min(last, c.own_hi) - std::max(run, c.own_lo) + 1, 0));
  };
  const ShearCell* cell = begin;
  for (; cell != end; ++cell) {
    const int u = cell->u;
    if (u > c.u_hi) break;
    const auto colour = LoadQuad(scene.colours + 4 * cell->level);
    if (scene.colours[4 * cell->level + 3] == 0) continue;
    const auto light = LoadQuad(scene.light_factors + 4 * scene.light[cell->normal]);
    StoreQuad(Mul(colour, light), at + 4 * u);
    if (u != last + 1) close(), run = u;
    last = u;
  }
  close();
  const ShearCell* const stop = cell;
  mask &= needed;
  line.mask = mask;
  for (uint64_t m = mask; m != 0; m &= m - 1) {
    const int block = std::countr_zero(m);
    float* to = line.at + block * kBlockFloats;
    if (c.radius > 1)
      MinifyBlock(c, dense, block, scene.size_u, to);
    else
      MagnifyBlock(c, dense, block, to);
    if (block * kSplatBlock < c.begin || (block + 1) * kSplatBlock > c.end) TrimBlock(c, block, to);
  }
  for (cell = begin; cell != stop; ++cell) StoreQuad(QuadOf(0), at + 4 * cell->u);
  return mask != 0 ? voxels : 0;
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
