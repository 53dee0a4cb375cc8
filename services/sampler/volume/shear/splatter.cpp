#include "services/sampler/volume/shear/splatter.h"

#include <hwy/aligned_allocator.h>
#include <tbb/task_arena.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>

#include "common/parallel/in_parallel.h"
#include "common/volume/lighting.h"
#include "services/sampler/volume/shear/plan.h"

namespace telesplat::sampler {

namespace {

using Clock = std::chrono::steady_clock;
double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Angle by which heads turn about the volume's middle before a newer frame comes, rad: 5 degrees and some more. Voxels
// that may come into sight by that are splatted even if they are hidden now.
constexpr double kHeadMove = 0.12;

using Floats = hwy::AlignedFreeUniquePtr<float[]>;

// Returns extinction times colour, and extinction, by level.
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

// Keeps only the pixels in `rect`.
void crop(volume::SliceImage& image, const geometry::Rect& rect) {
  if (image.rect == rect) return;
  uint32_t* to = image.pixels.data();
  const uint32_t* from = to + size_t(rect.y - image.rect.y) * size_t(image.rect.width) + (rect.x - image.rect.x);
  for (int y = 0; y < rect.height; ++y, to += rect.width, from += image.rect.width)
    std::copy(from, from + rect.width, to);  // forwards, so rows may overlap
  image.pixels.resize(size_t(rect.width) * size_t(rect.height));
  image.rect = rect;
}

// Returns intensities by normal, in 1/255.
std::vector<uint8_t> light_table(const SlabVolume& volume, const volume::ShearFrame& frame) {
  std::vector<uint8_t> light(65536, 255);
  if (volume.voxels().normal.empty()) return light;
  const glm::dvec3 eye_room = volume.grid().index_to_room * glm::dvec4(frame.eye, 1);
  const std::vector<float> intensities = volume::normal_intensities(volume.grid(), eye_room);
  for (size_t n = 0; n < light.size(); ++n) light[n] = uint8_t(intensities[n] * 255.0f + 0.5f);
  return light;
}

// Pixels by which a layer's plane moves against another's, seen from an eye that moved by kHeadMove.
struct Parallax {
  double x, y;

  Parallax(const volume::Grid& grid, const volume::ShearFrame& frame) {
    const double middle_t = (frame.t(frame.layers.front().plane) + frame.t(frame.layers.back().plane)) / 2;
    const auto moved = [&](int axis, double pitch) {
      const double sides =
          glm::length(glm::dvec3(grid.index_to_room[frame.axis])) / glm::length(glm::dvec3(grid.index_to_room[axis]));
      return kHeadMove * middle_t * sides / pitch;
    };
    x = moved(frame.u(), frame.du), y = moved(frame.v(), frame.dv);
  }
};

// The raster while layers are splatted, front to back: the light that still comes through.
class Canvas {
 public:
  Canvas(const volume::ShearFrame& frame, int blocks_across)
      : height_(frame.height),
        tiles_across_((frame.width + kTileWidth - 1) / kTileWidth),
        remaining_(hwy::AllocateAligned<float>(size_t(blocks_across) * kSplatBlock * size_t(frame.height))),
        begun_(size_t(tiles_across_) * size_t((frame.height + kTileHeight - 1) / kTileHeight) * kTileHeight, 0),
        hidden_(frame.width, frame.height),
        opaque_(size_t(blocks_across) * size_t(frame.height), 0) {}

  // Hides the pixels behind the layers so far, except for a margin of dx and dy pixels.
  void hide(int dx, int dy) {
    for (size_t n = 0; n < opaque_.size(); ++n) hidden_.bytes()[n] |= opaque_[n];
    std::fill(opaque_.begin(), opaque_.end(), uint8_t{0});
    hidden_.shrink(dx, dy);
  }

  // Splats a layer into the image, which has layer.rect.
  SplatOutcome splat(const SplatScene& scene, const LayerSlices& layer, volume::SliceImage& image,
                     tbb::task_arena& arena) {
    const geometry::Rect& r = image.rect;
    const int column_begin = r.x / kTileWidth, column_end = (r.x + r.width - 1) / kTileWidth + 1;
    const int row_begin = r.y / kTileHeight, row_end = (r.y + r.height - 1) / kTileHeight + 1;
    const int columns = column_end - column_begin, count = columns * (row_end - row_begin);
    std::vector<SplatOutcome> outcomes(size_t(std::max(count, 0)));
    arena.execute([&] {
      in_parallel(0, count, [&](int n) {
        const SplatTile tile = tile_at(column_begin + n % columns, row_begin + n / columns, layer, image);
        splat_tile(scene, tile, outcomes[size_t(n)]);
      });
    });
    SplatOutcome out;
    for (const SplatOutcome& o : outcomes) {
      out.voxels += o.voxels, out.pixels += o.pixels;
      out.x_lo = std::min(out.x_lo, o.x_lo), out.x_hi = std::max(out.x_hi, o.x_hi);
      out.y_lo = std::min(out.y_lo, o.y_lo), out.y_hi = std::max(out.y_hi, o.y_hi);
    }
    return out;
  }

 private:
  SplatTile tile_at(int column, int row, const LayerSlices& layer, volume::SliceImage& image) {
    SplatTile tile;
    tile.x0 = column * kTileWidth, tile.y0 = row * kTileHeight;
    tile.rows = std::min(kTileHeight, height_ - tile.y0);
    tile.slice_begin = layer.begin, tile.slice_end = layer.end;
    tile.hidden = hidden_.bytes();
    tile.remaining = remaining_.get();
    tile.begun = begun_.data() + (size_t(row) * size_t(tiles_across_) + size_t(column)) * kTileHeight;
    tile.opaque = opaque_.data();
    tile.image = image.pixels.data();
    tile.image_x = image.rect.x, tile.image_y = image.rect.y;
    tile.image_width = image.rect.width, tile.image_height = image.rect.height;
    return tile;
  }

  int height_, tiles_across_;
  Floats remaining_;
  std::vector<uint64_t> begun_;
  HiddenPixels hidden_;
  std::vector<uint8_t> opaque_;
};

// Returns the number of voxels held of the slices [k_begin, k_end).
uint64_t voxels_between(const SlabVolume& volume, int k_begin, int k_end) {
  const volume::Voxels& voxels = volume.voxels();
  if (voxels.size() == 0) return 0;
  const auto first_of = [&](int k) {
    const int clamped = std::clamp(k, voxels.k_begin, voxels.k_end);
    return voxels.rows[size_t(clamped - voxels.k_begin) * size_t(volume.grid().size[1])];
  };
  return first_of(k_end) - first_of(k_begin);
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
                                                     const volume::ShearFrame& frame, const SlabSlices& slab,
                                                     ShearStats* stats, const geometry::Clip& clip) {
  const auto started = Clock::now();
  const int k_begin = slab.k_begin, k_end = slab.k_end;
  const volume::Grid& grid = volume.grid();
  const volume::Voxels& voxels = volume.voxels();
  const ShearRows& rows = volume.rows(frame.axis);
  const double arrange_ms = ms_since(started);
  const auto splatting = Clock::now();

  const int planes = planes_of(grid, frame, colours);
  const int across = (frame.width + kSplatBlock - 1) / kSplatBlock;
  const ShearPlan plan = plan_slices(grid, frame, rows, {k_begin, k_end, voxels.k_begin, voxels.k_end}, planes);
  const Floats table = colour_table(colours);
  const std::vector<uint8_t> light = light_table(volume, frame);
  const std::vector<float> paths = block_paths(grid, frame, across, planes);
  const std::vector<KeptCells> kept =
      clip.empty() ? std::vector<KeptCells>() : kept_cells(grid, rows, frame.axis, clip);
  const SplatScene scene{.rows = &rows,
                         .size_u = grid.size[size_t(frame.u())],
                         .slices = plan.slices.data(),
                         .colours = table.get(),
                         .light = light.data(),
                         .light_factors = impl_->light_factors.get(),
                         .paths = paths.data(),
                         .kept = clip.empty() ? nullptr : kept.data(),
                         .blocks_across = across,
                         .width = frame.width,
                         .height = frame.height};

  std::vector<volume::SliceImage> images;
  uint64_t splatted = 0, pixels = 0;
  Canvas canvas(frame, across);
  const Parallax parallax(grid, frame);
  for (size_t l = 0; l < frame.layers.size(); ++l) {
    if (l > 0) {
      const double shift = std::abs(1 / frame.t(frame.layers[l - 1].plane) - 1 / frame.t(frame.layers[l].plane));
      // Rounded up, and half a pixel more as the warp interpolates: newly opaque pixels have no margin yet.
      canvas.hide(int(std::ceil(std::min(parallax.x * shift + 0.5, 4096.0))),
                  int(std::ceil(std::min(parallax.y * shift + 0.5, 4096.0))));
    }
    const LayerSlices& layer = plan.layers[l];
    if (layer.rect.width <= 0) continue;
    volume::SliceImage image{int(l), k_begin, k_end, layer.rect, {}};
    image.pixels.resize(size_t(image.rect.width) * size_t(image.rect.height));
    const SplatOutcome out = canvas.splat(scene, layer, image, impl_->arena);
    splatted += out.voxels, pixels += out.pixels;
    if (out.x_lo > out.x_hi) continue;
    crop(image, {out.x_lo, out.y_lo, out.x_hi + 1 - out.x_lo, out.y_hi + 1 - out.y_lo});
    images.push_back(std::move(image));
  }
  if (stats) {
    const uint64_t held = voxels_between(volume, k_begin, k_end);
    *stats = {splatted, held > splatted ? held - splatted : 0, pixels, arrange_ms, ms_since(splatting)};
  }
  return images;
}

HiddenPixels::HiddenPixels(int width, int height)
    : width_(width), height_(height), across_((width + 7) / 8), bytes_(size_t(across_) * size_t(height)) {}

void HiddenPixels::shrink(int dx, int dy) {
  if (dx <= 0 && dy <= 0) return;
  // Rows as words of 64 pixels: most words are empty or full. Shifts take bits from the neighbours of a word.
  const size_t words = size_t(across_ + 7) / 8;
  std::vector<uint64_t> rows(words * size_t(height_));
  std::vector<uint8_t> some(size_t(height_), 0);
  std::vector<uint64_t> row(words + 2), next(words + 2);
  for (int y = 0; y < height_; ++y) {
    const uint8_t* from = bytes_.data() + size_t(y) * size_t(across_);
    if (std::none_of(from, from + across_, [](uint8_t b) { return b != 0; })) continue;
    some[size_t(y)] = 1;
    std::fill(row.begin(), row.end(), ~uint64_t{0});
    for (size_t w = 0; w < words; ++w) {
      uint64_t bits = 0;
      for (size_t b = 0; b < 8; ++b) {
        const size_t at = w * 8 + b;
        bits |= uint64_t{at < size_t(across_) ? from[at] : uint8_t{255}} << (8 * b);
      }
      const int beyond = int(w + 1) * 64 - width_;  // pixels of this word that lie beyond the raster
      if (beyond > 0) bits |= ~uint64_t{0} << (64 - std::min(beyond, 64));
      row[w + 1] = bits;
    }
    // Shrink by 1, 2, 4 ... pixels and the rest, each less than a word.
    for (int left = dx, reached = 1; left > 0; reached *= 2) {
      const int by = std::min({left, reached, 63});
      for (size_t w = 1; w <= words; ++w) {
        const uint64_t from_left = row[w] << by | row[w - 1] >> (64 - by);
        const uint64_t from_right = row[w] >> by | row[w + 1] << (64 - by);
        next[w] = row[w] & from_left & from_right;
      }
      std::swap(row, next);
      row.front() = row.back() = next.front() = next.back() = ~uint64_t{0};
      left -= by;
    }
    std::copy(row.begin() + 1, row.end() - 1, rows.begin() + std::ptrdiff_t(size_t(y) * words));
  }
  for (int y = 0; y < height_; ++y) {
    uint8_t* to = bytes_.data() + size_t(y) * size_t(across_);
    if (!some[size_t(y)]) continue;
    const int lo = std::max(y - dy, 0), hi = std::min(y + dy, height_ - 1);
    for (size_t w = 0; w < words; ++w) {
      uint64_t bits = ~uint64_t{0};
      for (int other = lo; other <= hi && bits != 0; ++other) bits &= rows[size_t(other) * words + w];
      for (size_t b = 0; b < 8 && w * 8 + b < size_t(across_); ++b) to[w * 8 + b] = uint8_t(bits >> (8 * b));
    }
  }
}

const ShearRows& SlabVolume::rows(int axis) const {
  std::call_once(made_[axis], [&] { rows_[axis] = arrange(grid_, voxels_, axis); });
  return rows_[axis];
}

size_t SlabVolume::bytes() const {
  const size_t held = size_t(voxels_.k_end - voxels_.k_begin);
  const auto& size = grid_.size;
  const size_t rows = held * size_t(size[1]) + size_t(size[0]) * held + size_t(size[0]) * size_t(size[1]);
  return voxels_.size() * (6 + 3 * sizeof(ShearCell)) + (rows + held * size_t(size[1])) * sizeof(uint32_t);
}

namespace {

class ShearSlab final : public Slab {
 public:
  ShearSlab(std::shared_ptr<ShearSplatter> splatter, const volume::Grid& grid, volume::Voxels voxels)
      : splatter_(std::move(splatter)), volume_(grid, std::move(voxels)) {}

  size_t bytes() const override { return volume_.bytes(); }
  std::vector<volume::SliceImage> splat(const std::vector<volume::LevelColour>& colours,
                                        const volume::ShearFrame& frame, int k_begin, int k_end,
                                        const geometry::Clip& clip, uint64_t& voxels) const override {
    ShearStats stats;
    auto images = splatter_->splat(volume_, colours, frame, {k_begin, k_end}, &stats, clip);
    voxels = stats.voxels;
    return images;
  }

 private:
  std::shared_ptr<ShearSplatter> splatter_;
  SlabVolume volume_;
};

}  // namespace

MakeSlab make_shear_slabs(int threads) {
  return [splatter = std::make_shared<ShearSplatter>(threads)](const volume::Grid& grid, volume::Voxels voxels) {
    return std::make_shared<const ShearSlab>(splatter, grid, std::move(voxels));
  };
}

}  // namespace telesplat::sampler
