// Resamples rows of voxels to lines of pixels: the horizontal half of resampling a slice.
#if defined(TELESPLAT_SHEAR_RESAMPLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SHEAR_RESAMPLE_INL_H_
#undef TELESPLAT_SHEAR_RESAMPLE_INL_H_
#else
#define TELESPLAT_SHEAR_RESAMPLE_INL_H_
#endif

#include <algorithm>
#include <bit>
#include <cmath>

#include "services/sampler/volume/shear/quad-inl.h"
#include "services/sampler/volume/shear/scene.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

// Pixels of a block: as many lanes as the target has, up to a block's.
using Pixels = hn::CappedTag<float, kSplatBlock>;
using PixelIndices = hn::RebindToSigned<Pixels>;

inline constexpr int kBlockFloats = 4 * kSplatBlock;  // r, g, b, extinction (or light left), 8 of each

// A line or pixel row of a tile.
struct Line {
  uint64_t mask = 0;  // blocks that hold values
  int row = 0;
  alignas(64) float at[kTileBlocks * kBlockFloats];
};

// Voxels of a row, side by side, 0 where no voxel is: (r, g, b, extinction) of index u stands at 4 * (u + kMargin).
inline constexpr int kMargin = 16;
struct DenseRow {
  alignas(64) float at[4 * (volume::kMaxSide + 2 * kMargin)] = {};
};

// The columns of a slice in a tile. Index coordinates are counted from `base`, so that single precision is enough.
struct TileColumns {
  int base;
  float origin, pitch;         // index coordinate, less base, of the tile's first pixel centre; per pixel
  float inverse, reach;        // pixels a voxel; pixels from its centre that a voxel reaches
  float radius;                // radius of the kernel, voxels: more than 1 if a pixel is larger than a voxel
  int lattice_lo, lattice_hi;  // less base
  int begin, end;              // pixels that may be written, from the tile's first
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
  return c;
}

// Returns the bits of blocks [first, last].
inline uint64_t blocks(int first, int last) { return (~uint64_t{0} << first) & (~uint64_t{0} >> (63 - last)); }

// Resamples a block if a voxel is at least as large as a pixel: linear between the voxels on both sides.
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
  // A tile may begin far beside the volume, so only base and index together lie within the row.
  const auto pixel = [&](int n) HWY_ATTR {
    const float* p = dense.at + 4 * (c.base + kMargin + index[n]);
    const auto a = LoadQuad(p), b = LoadQuad(p + 4);
    return Add(a, Mul(Sub(b, a), QuadOf(weight[n])));
  };
  StoreTransposed(pixel(0), pixel(1), pixel(2), pixel(3), to, kSplatBlock);
  StoreTransposed(pixel(4), pixel(5), pixel(6), pixel(7), to + 4, kSplatBlock);
}

// Likewise if a pixel is larger: the mean of the voxels within a pixel's width on both sides, weighted by a tent.
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
  // Pixel after pixel, not in an argument list, whose order of evaluation is not defined.
  for (int half = 0; half < kSplatBlock; half += 4) {
    const auto p0 = pixel(half), p1 = pixel(half + 1), p2 = pixel(half + 2), p3 = pixel(half + 3);
    StoreTransposed(p0, p1, p2, p3, to + half, kSplatBlock);
  }
}

// Clears the pixels outside [begin, end).
HWY_INLINE void TrimBlock(const TileColumns& c, int block, float* to) {
  for (int n = 0; n < kSplatBlock; ++n) {
    const int x = block * kSplatBlock + n;
    if (x >= c.begin && x < c.end) continue;
    for (int channel = 0; channel < 4; ++channel) to[channel * kSplatBlock + n] = 0;
  }
}

// Cells of a row: [begin, end).
struct CellRow {
  const ShearCell* begin = nullptr;
  const ShearCell* end = nullptr;
};

// Adjacent pixels of a line, and the voxels that reach them.
struct Segment {
  int x_begin, x_end;
  int u_lo, u_hi;      // voxels that reach the pixels
  int own_lo, own_hi;  // voxels whose centres lie in the pixels: these are counted
};

inline Segment segment_of(const TileColumns& c, int first_block, int last_block) {
  Segment s;
  s.x_begin = std::max(c.begin, first_block * kSplatBlock);
  s.x_end = std::min(c.end, (last_block + 1) * kSplatBlock);
  const auto at = [&](float x) { return c.origin + c.pitch * x; };
  s.u_lo = c.base + int(std::ceil(at(float(s.x_begin)) - c.radius));
  s.u_hi = c.base + int(std::floor(at(float(s.x_end - 1)) + c.radius));
  s.own_lo = c.base + int(std::ceil(at(float(s.x_begin) - 0.5f)));
  s.own_hi = c.base + int(std::ceil(at(float(s.x_end) - 0.5f))) - 1;
  return s;
}

// Returns the cells of a row from the first that reaches a segment.
inline CellRow cells_of(const CellRow& row, const Segment& segment) {
  CellRow out = row;
  if (row.end - row.begin > 16)
    out.begin = std::lower_bound(row.begin, row.end, segment.u_lo,
                                 [](const ShearCell& cell, int u) { return int(cell.u) < u; });
  else
    while (out.begin != out.end && int(out.begin->u) < segment.u_lo) ++out.begin;
  return out;
}

// Adds weight times the voxels of a segment to the dense row. Returns the blocks that they reach; `voxels` counts them.
// row: set to end with the last cell that was visited.
HWY_INLINE uint64_t FillRow(const SplatScene& scene, const TileColumns& c, const Segment& segment, float weight,
                            CellRow& row, DenseRow& dense, uint64_t& voxels) {
  float* at = dense.at + 4 * kMargin;
  const Quad w = QuadOf(weight);
  uint64_t mask = 0;
  // Collect runs of voxels side by side: each run reaches a range of pixels, and these pixels' blocks.
  int run = -2, last = -2;
  const auto close = [&]() {
    if (run < 0) return;
    const float from = (float(run - c.base) - c.origin) * c.inverse - c.reach;
    const float to = (float(last - c.base) - c.origin) * c.inverse + c.reach;
    const int lo = std::max(int(std::ceil(from)), segment.x_begin);
    const int hi = std::min(int(std::floor(to)), segment.x_end - 1);
    if (lo <= hi) mask |= blocks(lo / kSplatBlock, hi / kSplatBlock);
    voxels += uint64_t(std::max(std::min(last, segment.own_hi) - std::max(run, segment.own_lo) + 1, 0));
  };
  const ShearCell* cell = row.begin;
  for (; cell != row.end; ++cell) {
    const int u = cell->u;
    if (u > segment.u_hi) break;
    const float* colour = scene.colours + 4 * cell->level;
    if (colour[3] == 0) continue;
    const Quad light = Mul(LoadQuad(scene.light_factors + 4 * scene.light[cell->normal]), w);
    StoreQuad(Add(LoadQuad(at + 4 * u), Mul(LoadQuad(colour), light)), at + 4 * u);
    if (u != last + 1) close(), run = u;
    last = u;
  }
  close();
  row.end = cell;
  return mask;
}

// Makes the line of a row of voxels, or of the sum of two rows, in `needed` blocks only. Returns the number of voxels.
inline uint64_t ResampleRow(const SplatScene& scene, const TileColumns& c, const CellRow* rows, int count, float weight,
                            uint64_t needed, DenseRow& dense, Line& line) {
  line.mask = 0;
  uint64_t voxels = 0;
  for (uint64_t rest = needed; rest != 0;) {
    const int first = std::countr_zero(rest), last = first + std::countr_one(rest >> first) - 1;
    rest &= ~blocks(first, last);
    const Segment segment = segment_of(c, first, last);
    if (segment.x_begin >= segment.x_end) continue;
    CellRow filled[2];
    uint64_t mask = 0;
    for (int r = 0; r < count; ++r) {
      filled[r] = cells_of(rows[r], segment);
      mask |= FillRow(scene, c, segment, weight, filled[r], dense, voxels);
    }
    line.mask |= mask;
    for (uint64_t m = mask; m != 0; m &= m - 1) {
      const int block = std::countr_zero(m);
      float* to = line.at + block * kBlockFloats;
      if (c.radius > 1)
        MinifyBlock(c, dense, block, scene.size_u, to);
      else
        MagnifyBlock(c, dense, block, to);
      if (block * kSplatBlock < c.begin || (block + 1) * kSplatBlock > c.end) TrimBlock(c, block, to);
    }
    for (int r = 0; r < count; ++r)
      for (const ShearCell* cell = filled[r].begin; cell != filled[r].end; ++cell)
        StoreQuad(QuadOf(0), dense.at + 4 * (kMargin + cell->u));
  }
  return voxels;
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
