#include "services/sampler/volume/shear/splatter.h"

#include <hwy/aligned_allocator.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <initializer_list>

#include "common/volume/lighting.h"
#include "services/sampler/volume/shear/hidden.h"
#include "services/sampler/volume/shear/scene.h"

namespace telesplat::sampler {
namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// How far heads turn about the volume's middle before a newer frame comes: what may come into sight by that is splatted even where it is hidden
// now. 5 degrees and some more.
constexpr double kHeadMove = 0.12;

using Floats = hwy::AlignedFreeUniquePtr<float[]>;

// Extinction times colour, and extinction, by level.
Floats colour_table(const std::vector<volume::LevelColour>& colours) {
  Floats out = hwy::AllocateAligned<float>(4 * size_t(volume::kMaxLevels));
  std::fill_n(out.get(), 4 * size_t(volume::kMaxLevels), 0.0f);
  for (size_t l = 0; l < std::min(colours.size(), size_t(volume::kMaxLevels)); ++l) {
    const volume::LevelColour& c = colours[l];
    if (!(c.extinction > 0)) continue;
    out[4 * l] = c.r * c.extinction, out[4 * l + 1] = c.g * c.extinction, out[4 * l + 2] = c.b * c.extinction;
    out[4 * l + 3] = c.extinction;
  }
  return out;
}

// Path lengths (ShearFrame::path) by block, as a polynomial of the pixel in it that is right at the first, middle and last one.
std::vector<float> block_paths(const volume::Grid& grid, const volume::ShearFrame& frame, int across, int planes) {
  std::vector<float> out(3 * size_t(across) * size_t(frame.height));
  // The ray's direction is a + x b + y c; its length the root of a quadratic form.
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

// How many planes a slice is sampled on: two where levels are so opaque that one would show as a step. Known from what all samplers share.
int planes_of(const volume::Grid& grid, const volume::ShearFrame& frame,
              const std::vector<volume::LevelColour>& colours) {
  constexpr double kMuch = 0.6;  // extinction of a slice
  float most = 0;
  for (const volume::LevelColour& c : colours) most = std::max(most, c.extinction);
  return most * frame.path(grid, frame.width / 2.0, frame.height / 2.0) > kMuch ? 2 : 1;
}

struct LayerSlices {
  int begin = 0, end = 0;  // of the scene's slices
  geometry::Rect rect;     // raster pixels that they reach, in whole blocks; no width: none
};

// Where slices lie in the raster.
struct Geometry {
  std::vector<SplatSlice> slices;
  std::vector<LayerSlices> layers;
};

// planes: of a slice, 1 or 2; see planes_of.
Geometry slices_of(const volume::Grid& grid, const volume::ShearFrame& frame, const ShearRows& rows, int k_begin,
                   int k_end, int held_begin, int held_end, int planes) {
  Geometry out;
  for (const volume::Layer& layer : frame.layers) {
    LayerSlices l;
    l.begin = int(out.slices.size());
    int x_lo = frame.width, x_hi = -1, y_lo = frame.height, y_hi = -1;
    const auto add = [&](double at, std::initializer_list<int> of) {
      SplatSlice slice;
      slice.weight = 1.0f / float(of.size());
      int count = 0;
      for (const int s : of) {
        const int held = s - rows.slice_begin;
        if (held < 0 || held >= rows.slices) continue;
        const ShearRows::Bounds& b = rows.bounds[size_t(held)];
        if (b.u_lo > b.u_hi) continue;
        slice.held[count++] = held;
        slice.bounds.u_lo = std::min(slice.bounds.u_lo, b.u_lo),
        slice.bounds.u_hi = std::max(slice.bounds.u_hi, b.u_hi);
        slice.bounds.v_lo = std::min(slice.bounds.v_lo, b.v_lo),
        slice.bounds.v_hi = std::max(slice.bounds.v_hi, b.v_hi);
      }
      const double t = frame.t(at);
      if (count == 0 || t < 0.1) return;
      slice.u.origin = frame.eye[frame.u()] + (frame.u0 + 0.5 * frame.du) * t;
      slice.u.pitch = frame.du * t;
      slice.u.end = frame.width;
      slice.v.origin = frame.eye[frame.v()] + (frame.v0 + 0.5 * frame.dv) * t;
      slice.v.pitch = frame.dv * t;
      slice.v.end = frame.height;
      if (frame.axis != 2) {
        SliceAxis& cut = frame.axis == 0 ? slice.v : slice.u;
        const auto [first, last] = volume::owned_pixels(grid, frame, at, k_begin, k_end);
        cut.begin = first, cut.end = last;
        if (held_begin > 0) cut.lattice_lo = held_begin;
        if (held_end < grid.size[2]) cut.lattice_hi = held_end - 1;
      }
      const auto reach = [](const SliceAxis& axis, int lo, int hi, int& from, int& to) {
        const double radius = std::max(axis.pitch, 1.0);
        const double a = std::ceil((lo - radius - axis.origin) / axis.pitch);
        const double b = std::floor((hi + radius - axis.origin) / axis.pitch);
        if (b < axis.begin || a > axis.end - 1) return false;
        from = std::max(int(std::max(a, -1.0)), axis.begin);
        to = int(std::min(b, double(axis.end - 1)));
        return from <= to;
      };
      int xa = 0, xb = 0, ya = 0, yb = 0;
      if (!reach(slice.u, slice.bounds.u_lo, slice.bounds.u_hi, xa, xb) ||
          !reach(slice.v, slice.bounds.v_lo, slice.bounds.v_hi, ya, yb))
        return;
      x_lo = std::min(x_lo, xa), x_hi = std::max(x_hi, xb), y_lo = std::min(y_lo, ya), y_hi = std::max(y_hi, yb);
      out.slices.push_back(slice);
    };
    for (int n = 0; n < layer.end - layer.begin; ++n) {
      const int s = frame.direction > 0 ? layer.begin + n : layer.end - 1 - n;
      if (frame.axis == 2 && (s < k_begin || s >= k_end)) continue;
      // The plane behind a slice, in index order, goes with it; the one before the first slice with that.
      const bool forward = frame.direction > 0;
      if (planes == 2 && forward && s == 0) add(-0.5, {-1, 0});
      if (planes == 2 && !forward) add(s + 0.5, {s, s + 1});
      add(s, {s});
      if (planes == 2 && forward) add(s + 0.5, {s, s + 1});
      if (planes == 2 && !forward && s == 0) add(-0.5, {-1, 0});
    }
    l.end = int(out.slices.size());
    if (l.begin < l.end) {
      l.rect.x = x_lo / kSplatBlock * kSplatBlock, l.rect.y = y_lo;
      l.rect.width = std::min((x_hi / kSplatBlock + 1) * kSplatBlock, frame.width) - l.rect.x;
      l.rect.height = y_hi + 1 - y_lo;
    }
    out.layers.push_back(l);
  }
  return out;
}

// Leaves of an image what lies in `rect`.
void crop(volume::SliceImage& image, const geometry::Rect& rect) {
  if (image.rect == rect) return;
  uint32_t* to = image.pixels.data();
  const uint32_t* from = to + size_t(rect.y - image.rect.y) * size_t(image.rect.width) + (rect.x - image.rect.x);
  for (int y = 0; y < rect.height; ++y, to += rect.width, from += image.rect.width)
    std::copy(from, from + rect.width, to);  // forwards, so rows may overlap
  image.pixels.resize(size_t(rect.width) * size_t(rect.height));
  image.rect = rect;
}

}  // namespace

struct ShearSplatter::Impl {
  explicit Impl(int threads) : arena(threads > 0 ? threads : tbb::task_arena::automatic) {}
  tbb::task_arena arena;
  Floats light_factors;
};

ShearSplatter::ShearSplatter(int threads) : impl_(std::make_unique<Impl>(threads)) {
  impl_->light_factors = hwy::AllocateAligned<float>(4 * 256);
  for (int i = 0; i < 256; ++i) {
    float* f = impl_->light_factors.get() + 4 * i;
    f[0] = f[1] = f[2] = float(i) / 255.0f, f[3] = 1;
  }
}
ShearSplatter::~ShearSplatter() = default;

std::vector<volume::SliceImage> ShearSplatter::splat(const SlabVolume& volume,
                                                     const std::vector<volume::LevelColour>& colours,
                                                     const volume::ShearFrame& frame, int k_begin, int k_end,
                                                     ShearStats* stats) {
  const auto started = Clock::now();
  const volume::Grid& grid = volume.grid();
  const volume::Voxels& voxels = volume.voxels();
  const ShearRows& rows = volume.impl().rows(frame.axis);
  const double arrange_ms = ms_since(started);
  const auto splatting = Clock::now();

  SplatScene scene;
  const int planes = planes_of(grid, frame, colours);
  scene.rows = &rows;
  scene.size_u = grid.size[size_t(frame.u())];
  scene.width = frame.width, scene.height = frame.height;
  scene.blocks_across = (frame.width + kSplatBlock - 1) / kSplatBlock;
  const Geometry geometry = slices_of(grid, frame, rows, k_begin, k_end, voxels.k_begin, voxels.k_end, planes);
  scene.slices = geometry.slices.data();
  const Floats table = colour_table(colours);
  scene.colours = table.get();
  std::vector<uint8_t> light(65536, 255);
  if (!voxels.normal.empty()) {
    const glm::dvec3 eye_room = grid.index_to_room * glm::dvec4(frame.eye, 1);
    const std::vector<float> intensities = volume::normal_intensities(grid, eye_room);
    for (size_t n = 0; n < light.size(); ++n) light[n] = uint8_t(intensities[n] * 255.0f + 0.5f);
  }
  scene.light = light.data();
  scene.light_factors = impl_->light_factors.get();
  const std::vector<float> paths = block_paths(grid, frame, scene.blocks_across, planes);
  scene.paths = paths.data();

  const int tiles_across = (frame.width + kTileWidth - 1) / kTileWidth;
  const int tiles_down = (frame.height + kTileHeight - 1) / kTileHeight;
  const size_t stride = size_t(scene.blocks_across) * kSplatBlock;
  const Floats remaining = hwy::AllocateAligned<float>(stride * size_t(frame.height));
  std::vector<uint64_t> begun(size_t(tiles_across) * size_t(tiles_down) * kTileHeight, 0);
  HiddenPixels hidden(frame.width, frame.height);
  std::vector<uint8_t> opaque(size_t(scene.blocks_across) * size_t(frame.height), 0);

  // By how many pixels a layer's plane moves against another's, seen from an eye that moved (kHeadMove).
  const double middle_t = (frame.t(frame.layers.front().plane) + frame.t(frame.layers.back().plane)) / 2;
  const auto moved = [&](int axis, double pitch) {
    const double sides =
        glm::length(glm::dvec3(grid.index_to_room[frame.axis])) / glm::length(glm::dvec3(grid.index_to_room[axis]));
    return kHeadMove * middle_t * sides / pitch;
  };
  const double move_x = moved(frame.u(), frame.du), move_y = moved(frame.v(), frame.dv);

  std::vector<volume::SliceImage> images;
  SplatOutcome total;
  for (size_t l = 0; l < frame.layers.size(); ++l) {
    if (l > 0) {
      const double shift = std::abs(1 / frame.t(frame.layers[l - 1].plane) - 1 / frame.t(frame.layers[l].plane));
      // Rounded up, and half a pixel for what the warp interpolates: newly opaque pixels have no margin yet.
      const int dx = int(std::ceil(std::min(move_x * shift + 0.5, 4096.0)));
      const int dy = int(std::ceil(std::min(move_y * shift + 0.5, 4096.0)));
      for (size_t n = 0; n < opaque.size(); ++n) hidden.bytes()[n] |= opaque[n];
      std::fill(opaque.begin(), opaque.end(), uint8_t{0});
      hidden.shrink(dx, dy);
    }
    const LayerSlices& layer = geometry.layers[l];
    if (layer.rect.width <= 0) continue;
    volume::SliceImage image;
    image.layer = int(l), image.k_begin = k_begin, image.k_end = k_end;
    image.rect = layer.rect;
    image.pixels.resize(size_t(image.rect.width) * size_t(image.rect.height));
    const int column_begin = image.rect.x / kTileWidth,
              column_end = (image.rect.x + image.rect.width - 1) / kTileWidth + 1;
    const int row_begin = image.rect.y / kTileHeight,
              row_end = (image.rect.y + image.rect.height - 1) / kTileHeight + 1;
    const int columns = column_end - column_begin, count = columns * (row_end - row_begin);
    std::vector<SplatOutcome> outcomes(size_t(std::max(count, 0)));
    impl_->arena.execute([&] {
      tbb::parallel_for(0, count, [&](int n) {
        const int column = column_begin + n % columns, row = row_begin + n / columns;
        SplatTile tile;
        tile.x0 = column * kTileWidth, tile.y0 = row * kTileHeight;
        tile.rows = std::min(kTileHeight, frame.height - tile.y0);
        tile.slice_begin = layer.begin, tile.slice_end = layer.end;
        tile.hidden = hidden.bytes();
        tile.remaining = remaining.get();
        tile.begun = begun.data() + (size_t(row) * size_t(tiles_across) + size_t(column)) * kTileHeight;
        tile.opaque = opaque.data();
        tile.image = image.pixels.data();
        tile.image_x = image.rect.x, tile.image_y = image.rect.y;
        tile.image_width = image.rect.width, tile.image_height = image.rect.height;
        splat_tile(scene, tile, outcomes[size_t(n)]);
      });
    });
    SplatOutcome out;
    for (const SplatOutcome& o : outcomes) {
      out.voxels += o.voxels, out.pixels += o.pixels;
      out.x_lo = std::min(out.x_lo, o.x_lo), out.x_hi = std::max(out.x_hi, o.x_hi);
      out.y_lo = std::min(out.y_lo, o.y_lo), out.y_hi = std::max(out.y_hi, o.y_hi);
    }
    total.voxels += out.voxels, total.pixels += out.pixels;
    if (out.x_lo > out.x_hi) continue;
    crop(image, {out.x_lo, out.y_lo, out.x_hi + 1 - out.x_lo, out.y_hi + 1 - out.y_lo});
    images.push_back(std::move(image));
  }
  if (stats) {
    const auto first_of = [&](int k) {
      const int clamped = std::clamp(k, voxels.k_begin, voxels.k_end);
      return voxels.rows[size_t(clamped - voxels.k_begin) * size_t(grid.size[1])];
    };
    const uint64_t held = voxels.size() == 0 ? 0 : first_of(k_end) - first_of(k_begin);
    stats->voxels = total.voxels;
    stats->skipped = held > total.voxels ? held - total.voxels : 0;
    stats->pixels = total.pixels;
    stats->arrange_ms = arrange_ms;
    stats->splat_ms = ms_since(splatting);
  }
  return images;
}

}  // namespace telesplat::sampler
