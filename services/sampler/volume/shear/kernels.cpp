#include <memory>

#include "services/sampler/volume/shear/scene.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "services/sampler/volume/shear/kernels.cpp"
#include <hwy/foreach_target.h>  // compiles the rest once for each target

#include <hwy/highway.h>

#include "services/sampler/volume/shear/composite-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

struct Scratch {
  TilePixels tile;
  Line lines[2];   // lines of voxel rows; row v has lines[v & 1]
  Line mixed[2];   // lines of pixel rows that several voxel rows make up
  DenseRow dense;  // all 0 between rows
};

// A slice in a tile.
struct SliceInTile {
  const SplatScene& scene;
  const SplatTile& job;
  const SplatSlice& slice;
  TileColumns columns;
  int y_begin, y_end;  // pixel rows of the tile that may be touched
  double origin;       // row coordinate of the tile's first pixel row
  int own_lo, own_hi;  // voxel rows whose centres lie in the tile's own rows: their voxels count
};

// Returns the cells of a row that a clip keeps.
CellRow KeptOf(const CellRow& row, const KeptCells& kept) {
  const auto before = [](const ShearCell& cell, int u) { return int(cell.u) < u; };
  CellRow out{std::lower_bound(row.begin, row.end, int(kept.first), before), row.end};
  out.end = std::lower_bound(out.begin, row.end, int(kept.last) + 1, before);
  return kept.first <= kept.last ? out : CellRow{row.end, row.end};
}

// Makes the line of voxel row v.
void MakeLine(const SliceInTile& s, int v, uint64_t needed, Scratch& scratch, Line& line, SplatOutcome& out) {
  const ShearRows& rows = *s.scene.rows;
  line.row = v;
  line.mask = 0;
  const int r = v - rows.row_begin;
  if (r < 0 || r >= rows.rows || needed == 0) return;
  CellRow cells[2];
  int count = 0;
  for (const int held : s.slice.held) {
    if (held < 0) continue;
    const size_t row = size_t(held) * size_t(rows.rows) + size_t(r);
    const uint32_t* first = rows.first.data() + row;
    CellRow all{rows.cells.data() + first[0], rows.cells.data() + first[1]};
    if (s.scene.kept) all = KeptOf(all, s.scene.kept[row]);
    if (all.begin != all.end) cells[count++] = all;
  }
  if (count == 0) return;
  const uint64_t voxels = ResampleRow(s.scene, s.columns, cells, count, s.slice.weight, needed, scratch.dense, line);
  // Voxels count in their own slices, not in those between.
  if (v >= s.own_lo && v <= s.own_hi && s.slice.weight == 1) out.voxels += voxels;
}

const float* PathsOf(const SliceInTile& s, int y) {
  return s.scene.paths + 3 * (size_t(s.job.y0 + y) * size_t(s.scene.blocks_across) + size_t(s.job.x0 / kSplatBlock));
}

// For voxel rows at least as high as pixel rows: every pixel row lies between two.
void Magnify(const SliceInTile& s, Scratch& scratch, SplatOutcome& out) {
  const double pitch = s.slice.v.pitch;
  const auto row_at = [&](int y) { return s.origin + y * pitch; };
  scratch.lines[0].row = scratch.lines[1].row = -100;
  for (int y = s.y_begin; y < s.y_end; ++y) {
    if (scratch.tile.live[y] == 0) continue;
    const double at = row_at(y), floor = std::floor(at);
    const int v = int(floor);
    for (const int of : {v, v + 1}) {
      Line& line = scratch.lines[of & 1];
      if (line.row == of) continue;
      uint64_t needed = 0;  // blocks of the pixel rows that it will be part of
      for (int next = y; next < s.y_end && row_at(next) < of + 1; ++next) needed |= scratch.tile.live[next];
      MakeLine(s, of, needed, scratch, line, out);
    }
    const Line &a = scratch.lines[v & 1], &b = scratch.lines[(v + 1) & 1];
    const uint64_t mask = (a.mask | b.mask) & scratch.tile.live[y];
    if (mask == 0) continue;
    out.pixels += uint64_t(std::popcount(mask)) * kSplatBlock;
    CompositeRow<true>(PathsOf(s, y), mask, a, b, float(at - floor), y, scratch.tile);
  }
}

// line += weight * added
void AddLine(const Line& added, float weight, uint64_t live, Line& line) {
  const Pixels d;
  const auto w = hn::Set(d, weight);
  const uint64_t mask = added.mask & live;
  for (uint64_t m = mask; m != 0; m &= m - 1) {
    const int block = std::countr_zero(m);
    const float* from = added.at + block * kBlockFloats;
    float* to = line.at + block * kBlockFloats;
    const bool fresh = !(line.mask >> block & 1);
    for (int n = 0; n < kBlockFloats; n += int(hn::Lanes(d))) {
      const auto product = hn::Mul(hn::Load(d, from + n), w);
      hn::Store(fresh ? product : hn::Add(hn::Load(d, to + n), product), d, to + n);
    }
  }
  line.mask |= mask;
}

// For pixel rows higher than voxel rows: a pixel row is the mean of the voxel rows within a pixel's height on both
// sides, weighted by a tent. So a voxel row is part of two pixel rows; a row is finished when the next but one begins.
void Minify(const SliceInTile& s, Scratch& scratch, SplatOutcome& out) {
  const double pitch = s.slice.v.pitch;
  const SliceAxis& axis = s.slice.v;
  const auto row_at = [&](int y) { return s.origin + y * pitch; };
  const auto first_voxel = [&](int y) { return std::max(std::ceil(row_at(y) - pitch), axis.lattice_lo); };
  const auto last_voxel = [&](int y) { return std::min(std::floor(row_at(y) + pitch), axis.lattice_hi); };
  float inverse[kTileHeight];  // inverse sum of all weights in a pixel row, with or without voxels
  for (int y = s.y_begin; y < s.y_end; ++y) {
    double sum = 0;
    for (double v = first_voxel(y); v <= last_voxel(y); ++v) sum += std::max(1 - std::abs(v - row_at(y)) / pitch, 0.0);
    inverse[y] = sum > 0 ? float(1 / sum) : 0.0f;
  }
  const auto finish = [&](int y) {
    Line& line = scratch.mixed[y & 1];
    if (line.row == y && line.mask != 0) {
      out.pixels += uint64_t(std::popcount(line.mask)) * kSplatBlock;
      CompositeRow<false>(PathsOf(s, y), line.mask, line, line, 0, y, scratch.tile);
    }
    line.mask = 0;
  };
  scratch.mixed[0].mask = scratch.mixed[1].mask = 0;
  int open = s.y_begin;  // pixel rows before this one are finished
  const ShearRows& rows = *s.scene.rows;
  const int v_begin = std::max(int(first_voxel(s.y_begin)), rows.row_begin);
  const int v_end = std::min(int(last_voxel(s.y_end - 1)) + 1, rows.row_begin + rows.rows);
  for (int v = v_begin; v < v_end; ++v) {
    const double y_at = (v - s.origin) / pitch;
    const int above = int(std::floor(y_at));
    for (; open < std::min(above, s.y_end); ++open) finish(open);
    uint64_t needed = 0;
    for (const int y : {above, above + 1})
      if (y >= s.y_begin && y < s.y_end) needed |= scratch.tile.live[y];
    MakeLine(s, v, needed, scratch, scratch.lines[0], out);
    if (scratch.lines[0].mask == 0) continue;
    for (const int y : {above, above + 1}) {
      const float weight = float(1 - std::abs(y - y_at));
      if (y < s.y_begin || y >= s.y_end || !(weight > 0)) continue;
      Line& line = scratch.mixed[y & 1];
      line.row = y;
      AddLine(scratch.lines[0], weight * inverse[y], scratch.tile.live[y], line);
    }
  }
  for (; open < s.y_end; ++open) finish(open);
}

void SplatSliceInTile(const SplatScene& scene, const SplatTile& job, const SplatSlice& slice, Scratch& scratch,
                      SplatOutcome& out) {
  SliceInTile s{scene, job, slice, {}, 0, 0, 0, 0, 0};
  const ShearRows::Bounds& bounds = slice.bounds;
  const int width = std::min(kTileWidth, scene.width - job.x0);
  const SliceAxis &u = slice.u, &v = slice.v;
  if (u.begin >= job.x0 + width || u.end <= job.x0) return;
  s.columns = columns_of(u, job.x0, width);
  if (s.columns.begin >= s.columns.end) return;
  const double radius = std::max(1.0, u.pitch), left = u.origin + u.pitch * (job.x0 + s.columns.begin);
  if (bounds.u_hi < left - radius || bounds.u_lo > u.origin + u.pitch * (job.x0 + s.columns.end - 1) + radius) return;
  s.origin = v.origin + v.pitch * job.y0;
  // Pixel rows that the slice's voxels reach.
  const double reach = std::max(1 / v.pitch, 1.0);
  const auto pixel_row = [&](double of) { return std::clamp(of, -1e6, 1e6); };
  const int reach_lo = int(std::ceil(pixel_row((bounds.v_lo - s.origin) / v.pitch - reach)));
  const int reach_hi = int(std::floor(pixel_row((bounds.v_hi - s.origin) / v.pitch + reach)));
  const int own_begin = std::max(v.begin - job.y0, 0), own_end = std::min(v.end - job.y0, job.rows);
  s.own_lo = int(std::ceil(s.origin + v.pitch * (own_begin - 0.5)));
  s.own_hi = int(std::ceil(s.origin + v.pitch * (own_end - 0.5))) - 1;
  s.y_begin = std::max(own_begin, reach_lo);
  s.y_end = std::min(own_end, reach_hi + 1);
  if (s.y_begin >= s.y_end) return;
  if (v.pitch > 1)
    Minify(s, scratch, out);
  else
    Magnify(s, scratch, out);
}

void SplatLayer(const SplatScene& scene, const SplatTile& job, SplatOutcome& out) {
  thread_local const std::unique_ptr<Scratch> memory = std::make_unique<Scratch>();
  Scratch& scratch = *memory;
  uint64_t any = 0;
  const int across = std::min(kTileBlocks, scene.blocks_across - job.x0 / kSplatBlock);
  for (int y = 0; y < job.rows; ++y) {
    const uint8_t* hidden =
        job.hidden + size_t(job.y0 + y) * size_t(scene.blocks_across) + size_t(job.x0 / kSplatBlock);
    uint64_t live = 0;
    for (int b = 0; b < across; ++b) live |= uint64_t{hidden[b] != 255} << b;
    scratch.tile.live[y] = live;
    scratch.tile.touched[y] = 0;
    any |= live;
  }
  if (any == 0) return;
  for (int n = job.slice_begin; n < job.slice_end; ++n) {
    SplatSliceInTile(scene, job, scene.slices[n], scratch, out);
  }
  FinishLayer(scene, job, scratch.tile, out);
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::sampler {

HWY_EXPORT(SplatLayer);

void splat_tile(const SplatScene& scene, const SplatTile& tile, SplatOutcome& outcome) {
  HWY_DYNAMIC_DISPATCH(SplatLayer)(scene, tile, outcome);
}

}  // namespace telesplat::sampler
#endif
