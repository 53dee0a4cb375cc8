// What sampled tiles tell the planner.
#include <algorithm>
#include <limits>

#include "services/packer/points/plan/planner_impl.h"

namespace telesplat::packer {
namespace {

// Whether no other pixels are covered. Samplers keep to masks; what comes from outside may not.
bool only_cast(const SampledTile& tile, const image::PixelMask& cast) {
  const auto& depth = tile.image.depth;
  if (cast.width() != tile.rect.width || cast.height() != tile.rect.height ||
      depth.size() != static_cast<size_t>(tile.rect.width) * tile.rect.height)
    return false;
  size_t covered = 0;
  for (int y = 0; y < cast.height(); ++y) {
    const uint32_t* row = &depth[static_cast<size_t>(y) * cast.width()];
    image::for_each_set(cast.row(y), cast.words_per_row(), [&](size_t x) { covered += row[x] != 0; });
  }
  return covered + static_cast<size_t>(std::count(depth.begin(), depth.end(), 0u)) == depth.size();
}

constexpr size_t kCoarseCarve = size_t{1} << 19;  // pixels: larger views are carved at half their resolution

}  // namespace

void Planner::Impl::take(const SampledTile& tile, bool whole, double now_s) {
  PlannedFrame* frame = shelf.find(tile.frame);
  if (frame && !frame->whole && whole && frame->find(tile.rect) == frame->tiles.size()) {
    shelf.drop(tile.frame);  // its plan came too late: it is sampled whole
    frame = nullptr;
  }
  if (frame && !frame->whole) {
    if (frame->camera == tile.camera && tile.step == 1) take_planned(*frame, tile, now_s);
  } else if (whole && !tile.extra && tile.step == 1) {
    take_whole(tile, now_s);
  }
}

void Planner::Impl::end_frame(FrameId id) {
  PlannedFrame* frame = shelf.find(id);
  if (frame) frame->left = 0, frame->ended = true;
}

std::optional<KnownReference> Planner::Impl::reference(const SampledTile& tile) {
  const PlannedFrame* frame = shelf.find(tile.frame);
  if (!frame || frame->whole || !frame->map || !frame->nearest_known || !(frame->camera == tile.camera)) return {};
  const size_t at = frame->find(tile.rect);
  if (at == frame->tiles.size() || !only_cast(tile, frame->tiles[at].mask)) return {};
  return KnownReference{frame->tiles[at].mask, frame->map->nearest_m};
}

image::PixelMask Planner::Impl::missed(const SampledTile& tile) {
  const PlannedFrame* frame = shelf.find(tile.frame);
  if (!frame || frame->kind != PlannedFrame::Kind::kFine || !(frame->camera == tile.camera)) return {};
  const size_t at = frame->find(tile.rect);
  if (at == frame->tiles.size() || !only_cast(tile, frame->tiles[at].mask)) return {};
  image::PixelMask out = frame->tiles[at].mask;
  for (int y = 0; y < out.height(); ++y) {
    const uint32_t* depth = &tile.image.depth[static_cast<size_t>(y) * tile.rect.width];
    for (int x = 0; x < out.width(); ++x)
      if (depth[x] != 0) out.clear(x, y);
  }
  return out;
}

// A frame that nobody planned, or that was to be sampled whole.
void Planner::Impl::take_whole(const SampledTile& tile, double now_s) {
  const auto pixels = static_cast<uint64_t>(tile.camera.width) * static_cast<uint64_t>(tile.camera.height);
  PlannedFrame* frame = shelf.find(tile.frame);
  if (!frame) {
    if (pixels > FrameShelf::kMaxPixels) return;
    frame = &shelf.add({.id = tile.frame,
                        .viewer = tile.viewer,
                        .camera = tile.camera,
                        .planned_s = now_s,
                        .whole = true,
                        .left = pixels,
                        .whole_m = std::vector<float>(pixels)});
  }
  if (!(frame->camera == tile.camera)) return;
  write_depths(tile, frame->whole_m);
  note_done(*frame, tile, nullptr);
  const auto came = static_cast<uint64_t>(tile.rect.width) * static_cast<uint64_t>(tile.rect.height);
  frame->left -= std::min(came, frame->left);
}

void Planner::Impl::take_planned(PlannedFrame& frame, const SampledTile& tile, double now_s) {
  const size_t at = frame.find(tile.rect);
  if (at == frame.tiles.size() || frame.returned[at] || frame.ended) return;
  frame.returned[at] = true;
  --frame.left;
  const image::PixelMask& cast = frame.tiles[at].mask;
  if (frame.kind != PlannedFrame::Kind::kFine) {
    frame.came_m[at] = depths_of(tile, cast);
    frame.passed += static_cast<uint64_t>(
        std::count(frame.came_m[at].begin(), frame.came_m[at].end(), std::numeric_limits<float>::infinity()));
  }
  if (frame.kind != PlannedFrame::Kind::kView) return;
  note_done(frame, tile, &cast);
  if (!frame.map) return;
  const ViewMap& map = *frame.map;
  image::PixelMask contradicted;
  ViewerView* view = viewers.find(frame.viewer);
  const bool same = view && view->known && view->camera == frame.camera;
  validation.check({map.camera, map.depth_m, map.colour, map.normal, frame.firm}, tile.rect, cast, tile.image, now_s,
                   contradicted, same ? &view->doubted : nullptr);
  if (same) merge(contradicted, tile.rect.x, tile.rect.y, view->doubted);
  refill_empty(frame, tile, contradicted);
}

// The viewer that still looks from there needs these pixels no more.
void Planner::Impl::note_done(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask* cast) {
  ViewerView* view = viewers.find(frame.viewer);
  if (!view || !view->known || !(view->camera == frame.camera)) return;
  if (cast) return merge(*cast, tile.rect.x, tile.rect.y, view->done);
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; ++y)
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; ++x) view->done.set(x, y);
}

// Hits where nothing was: other rays shall look around there.
void Planner::Impl::refill_empty(const PlannedFrame& frame, const SampledTile& tile,
                                 const image::PixelMask& contradicted) {
  std::vector<glm::vec3> hits;
  for (int y = 0; y < contradicted.height(); ++y)
    image::for_each_set(contradicted.row(y), contradicted.words_per_row(), [&](size_t x) {
      const int frame_x = tile.rect.x + static_cast<int>(x), frame_y = tile.rect.y + y;
      const uint32_t code = tile.image.depth[static_cast<size_t>(y) * tile.rect.width + x];
      if (code == 0 || frame.map->covered.at(frame_x, frame_y)) return;
      hits.emplace_back(
          tile.camera.unproject(frame_x + 0.5, frame_y + 0.5, image::decode_depth(code, tile.camera.near_m)));
    });
  if (!hits.empty()) known_empty.refill(hits);
}

// Pixels of large views are smaller than cells: half as many on each axis tell nearly as much, in a fourth of the time,
// and later views look closer where that leaves something open.
void Planner::Impl::carve(const geometry::Camera& full, const std::vector<float>& all_m) {
  const int width = full.width / 2, height = full.height / 2;
  if (all_m.size() < kCoarseCarve || width < 1 || height < 1) return known_empty.carve(full, all_m, config.threads);
  geometry::Camera camera = geometry::crop(full, {0, 0, 2 * width, 2 * height});
  camera.width = width, camera.height = height;
  coarse_m.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float* upper = &all_m[static_cast<size_t>(2 * y) * full.width + 2 * x];
      const float* lower = upper + full.width;
      // As far as all four are clear; it is new if one of them is.
      const float clear = std::min({std::abs(upper[0]), std::abs(upper[1]), std::abs(lower[0]), std::abs(lower[1])});
      const bool news = upper[0] > 0 || upper[1] > 0 || lower[0] > 0 || lower[1] > 0;
      coarse_m[static_cast<size_t>(y) * width + x] = news ? clear : -clear;
    }
  known_empty.carve(camera, coarse_m, config.threads);
}

void Planner::Impl::settle(const PlannedFrame& frame) {
  if (frame.whole) {
    carve(frame.camera, frame.whole_m);
  } else if (!frame.came_m.empty()) {
    clear_depths(frame, clear_m);
    carve(frame.camera, clear_m);
  }
  if (frame.kind == PlannedFrame::Kind::kView && !frame.whole && !frame.ended) validation.resampled(frame.planned_s);
}

// The newest one first: later views look at what it saw.
bool Planner::Impl::settle() {
  auto& frames = shelf.frames();
  const auto found = std::find_if(frames.rbegin(), frames.rend(), [](const PlannedFrame& f) { return f.complete(); });
  if (found == frames.rend()) return false;
  settle(*found);
  shelf.drop(FrameId(found->id));
  return true;
}

// Whole frames tell most, so the next plan waits for them. Others that found no time are forgotten: where they saw
// nothing rays are cast once more. So are those whose tiles do not come: their samplers died, or a newer view went
// first. What comes all the same is compared with the model.
void Planner::Impl::settle_old(double now_s) {
  constexpr double kOld_s = 1;
  for (size_t i = shelf.frames().size(); i-- > 0;) {
    const PlannedFrame& frame = shelf.frames()[i];
    if (FrameShelf::given_up(frame, now_s)) {
      shelf.drop(FrameId(frame.id));
      continue;
    }
    if (!frame.complete() || (!frame.whole && now_s - frame.planned_s < kOld_s)) continue;
    if (frame.whole) settle(frame);
    shelf.drop(FrameId(frame.id));
  }
}

}  // namespace telesplat::packer
