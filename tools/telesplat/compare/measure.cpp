#include "tools/telesplat/compare/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/clock.h"

namespace telesplat::launcher {
namespace {

bool shows(float depth_m) { return depth_m < std::numeric_limits<float>::infinity(); }

int squared_error(uint32_t a, uint32_t b) {
  int sum = 0;
  for (const int shift : {16, 8, 0}) {
    const int e = int(a >> shift & 255) - int(b >> shift & 255);
    sum += e * e;
  }
  return sum;
}

}  // namespace

ErrorShares error_shares(const image::Reference& reference, const image::View& reconstruction) {
  const image::View& direct = reference.view;
  const size_t pixels = direct.colour.size();
  CHECK(reconstruction.colour.size() == pixels && direct.depth_m.size() == pixels);
  CHECK(reconstruction.depth_m.size() == pixels);
  enum { kSilhouette, kDepthEdge, kInterior };
  double error[3] = {}, count[3] = {};
  for (size_t i = 0; i < pixels; ++i) {
    const float a = direct.depth_m[i], b = reconstruction.depth_m[i];
    if (!image::counts(reference, reconstruction, i)) continue;
    const bool whole = shows(a) && shows(b);
    const int where = !whole ? kSilhouette : std::abs(a - b) > 0.02f * a ? kDepthEdge : kInterior;
    error[where] += squared_error(direct.colour[i], reconstruction.colour[i]);
    count[where] += 1;
  }
  const double total = error[0] + error[1] + error[2], all = count[0] + count[1] + count[2];
  ErrorShares out;
  if (total > 0) {
    out.silhouette = error[kSilhouette] / total;
    out.depth_edge = error[kDepthEdge] / total;
    out.interior = error[kInterior] / total;
  }
  if (all > 0) {
    out.silhouette_pixels = count[kSilhouette] / all;
    out.depth_edge_pixels = count[kDepthEdge] / all;
  }
  if (count[kInterior] > 0)
    out.interior_psnr_db =
        error[kInterior] > 0 ? std::min(99.0, 10 * std::log10(255.0 * 255.0 * 3 * count[kInterior] / error[kInterior]))
                             : 99.0;
  return out;
}

Cell measure_cell(viewer::Renderer& renderer, const points::PointModel& model, Sequence applied,
                  const geometry::Camera& camera, const CellOptions& o, const Truth& truth) {
  const size_t pixels = size_t(camera.width) * camera.height;
  Cell cell;
  cell.kernel = o.render.kernel;
  cell.renderer = renderer.name();
  cell.splat_scale = o.splat_scale;
  cell.view = {camera.width, camera.height, std::vector<uint32_t>(pixels), std::vector<float>(pixels)};

  splat::SelectionOptions selection;
  selection.scale = o.splat_scale;
  selection.detail = o.detail;
  selection.best_patch_only = o.best_patch_only;
  const image::Shading shading(o.shading, camera);
  splat::DrawList list;
  list.base = o.base;
  struct Timed {
    double select_ms, render_ms;
    splat::SplatStats stats;
  };
  std::vector<Timed> timed;
  // Times frames as a viewer draws most of them: without depth. The first frame warms up caches and buffers.
  for (int i = 0; i <= o.repeat; ++i) {
    const double begin_s = monotonic_s();
    splat::select_view(model, camera, selection, list);
    list.applied = applied;
    const double selected_s = monotonic_s();
    const auto stats = renderer.render(list, camera, o.render, shading,
                                       {camera.width, camera.height, cell.view.colour.data(), nullptr});
    if (i > 0) timed.push_back({(selected_s - begin_s) * 1e3, (monotonic_s() - selected_s) * 1e3, stats});
  }
  const auto median_by = [&](auto value) {
    std::sort(timed.begin(), timed.end(), [&](const Timed& a, const Timed& b) { return value(a) < value(b); });
    return timed[timed.size() / 2];
  };
  cell.times.frame_ms = [](const Timed& t) {
    return t.select_ms + t.render_ms;
  }(median_by([](const Timed& t) { return t.select_ms + t.render_ms; }));
  cell.times.select_ms = median_by([](const Timed& t) { return t.select_ms; }).select_ms;
  const Timed median = median_by([](const Timed& t) { return t.render_ms; });
  cell.times.render_ms = median.render_ms;
  cell.times.stats = median.stats;
  cell.items = list.items.size();

  renderer.render(list, camera, o.render, shading,
                  {camera.width, camera.height, cell.view.colour.data(), cell.view.depth_m.data()});
  for (uint32_t& c : cell.view.colour) c &= 0xffffff;
  cell.quality = image::compare(truth.reference, cell.view);
  cell.shares = error_shares(truth.reference, cell.view);
  cell.flip_map = truth.flip.error_map(cell.view);
  cell.flip = image::mean_error(cell.flip_map, truth.reference, cell.view);
  return cell;
}

}  // namespace telesplat::launcher
