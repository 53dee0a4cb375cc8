#include "client/viewer/render/supersampler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "client/viewer/render/renderer.h"
#include "common/core/check.h"
#include "common/splat/flat/splat_table.h"

namespace telesplat::viewer {
namespace {

// Splats reach into a rectangle from this far outside of it, in sub-pixels.
constexpr int kOverhang = splat::kMaxSplatSide;
// Samples closer than this, in pixels, count as finer than pixels: samples of twice the resolution are 0.5 apart.
constexpr float kFiner = 0.75f;
// Sub-pixels pay from this many such samples for each pixel of the rectangle: an edge across a rectangle of 128 x 96
// pixels, with four samples a pixel, has 0.03.
constexpr double kWorthwhile = 0.01;
// Surface of cut splats, as a share of that of the others, at most: so the others may hide all of them.
constexpr double kMostCut = 1.2;
// Samples closer than this, in sub-pixels, are as fine as sub-pixels.
constexpr float kFinest = 1.5f;
// A depth larger by this factor is behind: about splat::kEdge steps of a depth code.
constexpr float kBehindRays = 1.03f;

geometry::Rect grown(const geometry::Rect& r, int by) {
  return {r.x - by, r.y - by, r.width + 2 * by, r.height + 2 * by};
}

geometry::Rect scaled(const geometry::Rect& r, int by) { return {r.x * by, r.y * by, r.width * by, r.height * by}; }

geometry::Camera finer(geometry::Camera camera, int by) {
  camera.width *= by;
  camera.height *= by;
  return camera;
}

}  // namespace

void box_filter(const uint32_t* from, size_t from_pitch, int side, PixelBlock to) {
  const auto samples = uint32_t(side * side), half = samples / 2;
  for (int y = 0; y < to.height; ++y, from += from_pitch * size_t(side), to.pixels += to.pitch)
    for (int x = 0; x < to.width; ++x) {
      // Sums of 16 channels of 8 bits fit into 12 bits.
      uint32_t red_blue = 0, green = 0;
      for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
          const uint32_t c = from[size_t(j) * from_pitch + size_t(x * side + i)];
          red_blue += c & 0xff00ff;
          green += c >> 8 & 0xff;
        }
      const uint32_t red = ((red_blue >> 16) + half) / samples, blue = ((red_blue & 0xffff) + half) / samples;
      to.pixels[x] = 0xff000000u | red << 16 | (green + half) / samples << 8 | blue;
    }
}

Supersampler::Fineness Supersampler::fineness(const geometry::Rect& rect) const {
  uint64_t finer = 0;
  double cut = 0, whole = 0;  // surface, pixels
  for (const splat::DrawItem& item : list_.items) {
    const double spacing = double(item.splat_px) / list_.scale / side_, area = spacing * spacing * item.level.count;
    if (spacing < kFiner) finer += item.level.count;
    (item.splat_px > float(splat::kMaxSplatSide) ? cut : whole) += area;
  }
  return {double(finer) > kWorthwhile * rect.width * rect.height && cut <= kMostCut * whole, cut > 0};
}

void Supersampler::render(const Scene& scene, const splat::DrawList& list, const geometry::Camera& camera,
                          image::View& view, bool antialias) {
  fit(view, camera, true);
  splat::RenderOptions options = scene.render;
  options.finish.antialias = antialias;
  renderer_.render(list, camera, options, scene.shading,
                   {view.width, view.height, view.colour.data(), view.depth_m.data()});
}

bool Supersampler::draw(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect, uint32_t* to,
                        size_t pitch) {
  CHECK(side_ == 2 || side_ == 4);
  const geometry::Camera fine = finer(camera, side_);
  const geometry::Rect sub = scaled(grown(rect, 1), side_);
  splat::SelectionOptions selection = scene.selection;
  selection.detail = 1, selection.rests = true;
  // Finer samples cover only parts of a cluster, often edges that were sampled twice: coarser splats beside them must
  // not shrink. Where both lie, the nearest centre wins a sub-pixel anyway.
  selection.hide_ratio = std::numeric_limits<float>::infinity();
  selection.max_splat_px = float(splat::kMaxSplatSide * side_);  // so that cut splats can be counted
  scene.select(crop(fine, grown(sub, kOverhang)), selection, list_);
  const Fineness fineness = this->fineness(rect);
  const geometry::Camera around = crop(fine, sub);
  if (!scene.rays || !scene.rays->look_up(around, list_.epoch, met_m_)) met_m_.clear();
  const auto known = met_m_.size() - size_t(std::count(met_m_.begin(), met_m_.end(), 0.0f));
  if (!fineness.worthwhile && double(known) <= kWorthwhile * rect.width * rect.height) return false;
  render(scene, list_, around, fine_);
  if (!met_m_.empty()) show_met(scene, around);
  const bool open = count_covered(rect), gaps = open || fineness.gaps;
  if (gaps) render_coarse(scene, camera, rect), close_gaps(rect, fineness.gaps);
  const auto row = size_t(fine_.width), inset = size_t(side_);
  box_filter(fine_.colour.data() + inset * row + inset, row, side_, {to, pitch, rect.width, rect.height});
  if (open && find_silhouettes(rect)) show_antialiased(scene, camera, rect, to, pitch);
  return true;
}

// Draws the rectangle and two pixels around it, without sub-pixels.
void Supersampler::render_coarse(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect) {
  const geometry::Rect around = grown(rect, 2);
  splat::SelectionOptions selection = scene.selection;
  selection.detail = 1, selection.rests = true;
  scene.select(crop(camera, grown(around, kOverhang)), selection, coarse_list_);
  render(scene, coarse_list_, crop(camera, around), coarse_);
}

// Counts the sub-pixels that show something. True if some do and some do not.
bool Supersampler::count_covered(const geometry::Rect& rect) {
  const size_t width = size_t(rect.width) + 2, height = size_t(rect.height) + 2;
  covered_.assign(width * height, 0), known_.assign(width * height, 0);
  const int shift = std::countr_zero(unsigned(side_));
  size_t all = 0, i = 0;
  for (int y = 0; y < fine_.height; ++y)
    for (int x = 0; x < fine_.width; ++x, ++i) {
      const size_t pixel = size_t(y >> shift) * width + size_t(x >> shift);
      const bool covered = !std::isinf(fine_.depth_m[i]);
      covered_[pixel] += covered, all += covered;
      if (!met_m_.empty()) known_[pixel] += met_m_[i] != 0;
    }
  return all > 0 && all < fine_.depth_m.size();
}

// Marks pixels at silhouettes, from covered_ and known_. True if there are any.
bool Supersampler::find_silhouettes(const geometry::Rect& rect) {
  const size_t row = size_t(rect.width) + 2;
  const int whole = side_ * side_;
  bool any = false;
  silhouette_.assign(covered_.size(), 0);
  for (size_t y = 1; y <= size_t(rect.height); ++y)
    for (size_t x = 1; x <= size_t(rect.width); ++x) {
      if (known_[y * row + x] >= side_) continue;
      int nothing = 0;
      for (size_t j = y - 1; j <= y + 1; ++j)
        for (size_t i = x - 1; i <= x + 1; ++i) nothing += whole - covered_[j * row + i];
      any |= silhouette_[y * row + x] = nothing >= whole;
    }
  return any;
}

// Draws the points of list_ that are closer than `spacing`; list_ keeps only these.
void Supersampler::render_closer(const Scene& scene, const geometry::Camera& around, float spacing, image::View& view) {
  std::erase_if(list_.items, [&](const splat::DrawItem& item) { return item.splat_px / list_.scale >= spacing; });
  render(scene, list_, around, view);
}

void Supersampler::show_antialiased(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect,
                                    uint32_t* to, size_t pitch) {
  render(scene, coarse_list_, crop(camera, grown(rect, 2)), antialiased_, true);
  const size_t width = size_t(rect.width) + 2, antialiased_width = width + 2;
  for (size_t y = 0; y < size_t(rect.height); ++y)
    for (size_t x = 0; x < size_t(rect.width); ++x) {
      const size_t pixel = (y + 1) * width + x + 1;
      if (silhouette_[pixel]) to[y * pitch + x] = antialiased_.colour[(y + 2) * antialiased_width + x + 2];
    }
}

// Shows the hits of known rays. Splats in front of a hit come from coarser samples, or from samples beside it; coarser
// samples at the same depth hide the finest ones.
void Supersampler::show_met(const Scene& scene, const geometry::Camera& around) {
  const auto behind = [&](const image::View& view, size_t i) {
    return kBehindRays * view.depth_m[i] >= std::abs(met_m_[i]);
  };
  const auto show = [&](const image::View& from, size_t i) {
    fine_.depth_m[i] = from.depth_m[i], fine_.colour[i] = from.colour[i];
  };
  const splat::DrawList all = list_;
  render_closer(scene, around, kFinest, closer_);
  bool wrong = false;
  for (size_t i = 0; i < met_m_.size(); ++i) {
    if (met_m_[i] == 0) continue;
    const bool finest = !std::isinf(closer_.depth_m[i]);
    if (finest && (met_m_[i] < 0 || behind(closer_, i)))
      show(closer_, i), met_m_[i] = closer_.depth_m[i];
    else
      wrong |= !behind(fine_, i);
  }
  if (!wrong) return;
  list_ = all;
  render_closer(scene, around, kFiner * float(side_), closer_);
  for (size_t i = 0; i < met_m_.size(); ++i) {
    if (met_m_[i] == 0 || behind(fine_, i)) continue;
    if (!std::isinf(closer_.depth_m[i]) && behind(closer_, i))
      show(closer_, i);
    else if (std::isinf(met_m_[i]))
      fine_.depth_m[i] = std::abs(met_m_[i]), fine_.colour[i] = scene.shading.background();
  }
}

void Supersampler::close_gaps(const geometry::Rect& rect, bool with_depths) {
  const size_t w = size_t(rect.width) + 4;
  farthest_.resize(size_t(rect.width));
  for (int y = 0; y < rect.height; ++y) {
    const size_t first = (size_t(y) + 1) * w + 1;  // upper left pixel of the 3x3 around the row's first pixel
    for (int x = 0; x < rect.width; ++x) {
      float far = 0;
      for (size_t j = 0; j < 3; ++j)
        for (size_t i = 0; i < 3; ++i) far = std::max(far, coarse_.depth_m[first + j * w + size_t(x) + i]);
      farthest_[size_t(x)] = kBehindRays * far;
    }
    const uint32_t* pixels = coarse_.colour.data() + first + w + 1;
    for (int j = 0; j < side_; ++j) {
      const size_t row = size_t((y + 1) * side_ + j) * size_t(fine_.width) + size_t(side_);
      for (int x = 0; x < rect.width * side_; ++x)
        if (const float depth_m = fine_.depth_m[row + size_t(x)]; depth_m > farthest_[size_t(x / side_)] &&
                                                                  (with_depths || std::isinf(depth_m)) &&
                                                                  (met_m_.empty() || met_m_[row + size_t(x)] == 0))
          fine_.colour[row + size_t(x)] = pixels[x / side_];
    }
  }
}

}  // namespace telesplat::viewer
