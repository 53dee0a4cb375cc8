#include "services/sampler/volume/shear/plan.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>

namespace telesplat::sampler {
namespace {

// Makes the planes of one layer after the other.
class Planner {
 public:
  Planner(const volume::Grid& grid, const volume::ShearFrame& frame, const ShearRows& rows, const SlabRange& slab)
      : grid_(grid), frame_(frame), rows_(rows), slab_(slab) {}

  void add_layer(const volume::Layer& layer, int planes) {
    LayerSlices l;
    l.begin = int(out_.slices.size());
    x_lo_ = frame_.width, x_hi_ = -1, y_lo_ = frame_.height, y_hi_ = -1;
    const bool forward = frame_.direction > 0;
    for (int n = 0; n < layer.end - layer.begin; ++n) {
      const int s = forward ? layer.begin + n : layer.end - 1 - n;
      if (frame_.axis == 2 && (s < slab_.begin || s >= slab_.end)) continue;
      // A slice takes along the plane behind it, in index order; the first slice takes the plane before it, too.
      if (planes == 2 && forward && s == 0) add_plane(-0.5, {-1, 0});
      if (planes == 2 && !forward) add_plane(s + 0.5, {s, s + 1});
      add_plane(s, {s});
      if (planes == 2 && forward) add_plane(s + 0.5, {s, s + 1});
      if (planes == 2 && !forward && s == 0) add_plane(-0.5, {-1, 0});
    }
    l.end = int(out_.slices.size());
    if (l.begin < l.end) {
      l.rect.x = x_lo_ / kSplatBlock * kSplatBlock, l.rect.y = y_lo_;
      l.rect.width = std::min((x_hi_ / kSplatBlock + 1) * kSplatBlock, frame_.width) - l.rect.x;
      l.rect.height = y_hi_ + 1 - y_lo_;
    }
    out_.layers.push_back(l);
  }

  ShearPlan take() { return std::move(out_); }

 private:
  // Adds the plane at index coordinate `at`, the mean of the slices `of`, unless they hold nothing that the raster
  // sees.
  void add_plane(double at, std::initializer_list<int> of) {
    SplatSlice slice;
    slice.weight = 1.0f / float(of.size());
    const double t = frame_.t(at);
    if (!hold(slice, of) || t < 0.1) return;
    place(slice, at, t);
    int xa = 0, xb = 0, ya = 0, yb = 0;
    if (!reach(slice.u, slice.bounds.u_lo, slice.bounds.u_hi, xa, xb) ||
        !reach(slice.v, slice.bounds.v_lo, slice.bounds.v_hi, ya, yb))
      return;
    x_lo_ = std::min(x_lo_, xa), x_hi_ = std::max(x_hi_, xb);
    y_lo_ = std::min(y_lo_, ya), y_hi_ = std::max(y_hi_, yb);
    out_.slices.push_back(slice);
  }

  // Fills in which of the slices are held and have voxels, and their bounds. False: no slice has.
  bool hold(SplatSlice& slice, std::initializer_list<int> of) const {
    int count = 0;
    for (const int s : of) {
      const int held = s - rows_.slice_begin;
      if (held < 0 || held >= rows_.slices) continue;
      const ShearRows::Bounds& b = rows_.bounds[size_t(held)];
      if (b.u_lo > b.u_hi) continue;
      slice.held[count++] = held;
      ShearRows::Bounds& all = slice.bounds;
      all.u_lo = std::min(all.u_lo, b.u_lo), all.u_hi = std::max(all.u_hi, b.u_hi);
      all.v_lo = std::min(all.v_lo, b.v_lo), all.v_hi = std::max(all.v_hi, b.v_hi);
    }
    return count > 0;
  }

  void place(SplatSlice& slice, double at, double t) const {
    const volume::ShearFrame& f = frame_;
    slice.u.origin = f.eye[f.u()] + (f.u0 + 0.5 * f.du) * t;
    slice.u.pitch = f.du * t;
    slice.u.end = f.width;
    slice.v.origin = f.eye[f.v()] + (f.v0 + 0.5 * f.dv) * t;
    slice.v.pitch = f.dv * t;
    slice.v.end = f.height;
    if (f.axis == 2) return;
    // The ends of the slab cut across the raster.
    SliceAxis& cut = f.axis == 0 ? slice.v : slice.u;
    const auto [first, last] = volume::owned_pixels(grid_, f, at, slab_.begin, slab_.end);
    cut.begin = first, cut.end = last;
    if (slab_.held_begin > 0) cut.lattice_lo = slab_.held_begin;
    if (slab_.held_end < grid_.size[2]) cut.lattice_hi = slab_.held_end - 1;
  }

  // Finds the pixels [from, to] that voxels lo to hi of the axis reach. False: no pixels.
  static bool reach(const SliceAxis& axis, int lo, int hi, int& from, int& to) {
    const double radius = std::max(axis.pitch, 1.0);
    const double a = std::ceil((lo - radius - axis.origin) / axis.pitch);
    const double b = std::floor((hi + radius - axis.origin) / axis.pitch);
    if (b < axis.begin || a > axis.end - 1) return false;
    from = std::max(int(std::max(a, -1.0)), axis.begin);
    to = int(std::min(b, double(axis.end - 1)));
    return from <= to;
  }

  const volume::Grid& grid_;
  const volume::ShearFrame& frame_;
  const ShearRows& rows_;
  const SlabRange slab_;
  ShearPlan out_;
  int x_lo_ = 0, x_hi_ = -1, y_lo_ = 0, y_hi_ = -1;  // pixels that the layer's planes reach
};

}  // namespace

int planes_of(const volume::Grid& grid, const volume::ShearFrame& frame,
              const std::vector<volume::LevelColour>& colours) {
  constexpr double kMuch = 0.6;  // extinction of a slice
  float most = 0;
  for (const volume::LevelColour& c : colours) most = std::max(most, c.extinction);
  return most * frame.path(grid, frame.width / 2.0, frame.height / 2.0) > kMuch ? 2 : 1;
}

ShearPlan plan_slices(const volume::Grid& grid, const volume::ShearFrame& frame, const ShearRows& rows,
                      const SlabRange& slab, int planes) {
  Planner planner(grid, frame, rows, slab);
  for (const volume::Layer& layer : frame.layers) planner.add_layer(layer, planes);
  return planner.take();
}

std::vector<float> block_paths(const volume::Grid& grid, const volume::ShearFrame& frame, int across, int planes) {
  std::vector<float> out(3 * size_t(across) * size_t(frame.height));
  // The ray's direction is a + x b + y c; its length is the root of a quadratic form.
  const glm::dmat3 m(grid.index_to_room);
  glm::dvec3 first(0.0);
  first[frame.axis] = frame.direction;
  first[frame.u()] = frame.u0 + 0.5 * frame.du;
  first[frame.v()] = frame.v0 + 0.5 * frame.dv;
  const glm::dvec3 start = m * first, right = m[frame.u()] * frame.du, down = m[frame.v()] * frame.dv;
  const double unit = 1 / (grid.unit_m() * planes);
  for (int y = 0; y < frame.height; ++y) {
    const glm::dvec3 row = start + down * double(y);
    for (int b = 0; b < across; ++b) {
      const int last = std::max(std::min(kSplatBlock, frame.width - b * kSplatBlock) - 1, 1);
      const double from = glm::length(row + right * double(b * kSplatBlock)) * unit;
      const double to = glm::length(row + right * double(b * kSplatBlock + last)) * unit;
      float* at = out.data() + 3 * (size_t(y) * size_t(across) + size_t(b));
      const double middle = glm::length(row + right * (b * kSplatBlock + last / 2.0)) * unit;
      const double bend = 2 * (from - 2 * middle + to) / (double(last) * last);
      at[0] = float(from), at[1] = float((to - from) / last - bend * last), at[2] = float(bend);
    }
  }
  return out;
}

}  // namespace telesplat::sampler
