// Planner: learns from sampled tiles.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "services/packer/points/plan/planner.h"

namespace telesplat::packer {
namespace {

// True if no pixels outside `cast` are covered. Samplers keep to masks; tiles from outside may not.
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

void Planner::take(const SampledTile& tile, bool whole, double now_s) {
  PlannedFrame* frame = shelf_.find(tile.frame);
  if (frame && !frame->whole && whole && frame->find(tile.rect) == frame->tiles.size()) {
    shelf_.drop(tile.frame);  // its plan came too late: it is sampled whole
    frame = nullptr;
  }
  if (frame && !frame->whole) {
    if (frame->camera == tile.camera && tile.step == 1) take_planned(*frame, tile, now_s);
  } else if (whole && !tile.extra && tile.step == 1) {
    take_whole(tile, now_s);
  }
}

void Planner::end_frame(FrameId id) {
  PlannedFrame* frame = shelf_.find(id);
  if (frame) frame->left = 0, frame->ended = true;
}

const image::PixelMask* Planner::cast(const SampledTile& tile) {
  const PlannedFrame* frame = shelf_.find(tile.frame);
  if (!frame || frame->whole || !(frame->camera == tile.camera)) return nullptr;
  const size_t at = frame->find(tile.rect);
  return at == frame->tiles.size() || !only_cast(tile, frame->tiles[at].mask) ? nullptr : &frame->tiles[at].mask;
}

std::optional<KnownReference> Planner::reference(const SampledTile& tile) {
  const PlannedFrame* frame = shelf_.find(tile.frame);
  if (!frame || !frame->map || !frame->nearest_known) return {};
  const image::PixelMask* mask = cast(tile);
  if (!mask) return {};
  return KnownReference{*mask, frame->map->nearest_m};
}

image::PixelMask Planner::missed(const SampledTile& tile) {
  const PlannedFrame* frame = shelf_.find(tile.frame);
  const image::PixelMask* mask = cast(tile);
  if (!frame || frame->kind != PlannedFrame::Kind::kFine || !mask) return {};
  image::PixelMask out = *mask;
  for (int y = 0; y < out.height(); ++y) {
    const uint32_t* depth = &tile.image.depth[static_cast<size_t>(y) * tile.rect.width];
    for (int x = 0; x < out.width(); ++x)
      if (depth[x] != 0) out.clear(x, y);
  }
  return out;
}

// Takes a tile of a frame that was not planned, or that was planned to be sampled whole.
void Planner::take_whole(const SampledTile& tile, double now_s) {
  const auto pixels = static_cast<uint64_t>(tile.camera.width) * static_cast<uint64_t>(tile.camera.height);
  PlannedFrame* frame = shelf_.find(tile.frame);
  if (!frame) {
    if (pixels > FrameShelf::kMaxPixels) return;
    frame = &shelf_.add({.id = tile.frame,
                         .viewer = tile.viewer,
                         .camera = tile.camera,
                         .planned_s = now_s,
                         .whole = true,
                         .left = pixels,
                         .whole_m = std::vector<float>(pixels)});
  }
  if (!(frame->camera == tile.camera)) return;
  if (!tile.coarse) {
    write_depths(tile, frame->whole_m);
    note_done(*frame, tile, nullptr);
  }
  const auto came = static_cast<uint64_t>(tile.rect.width) * static_cast<uint64_t>(tile.rect.height);
  frame->left -= std::min(came, frame->left);
}

void Planner::take_planned(PlannedFrame& frame, const SampledTile& tile, double now_s) {
  const size_t at = frame.find(tile.rect);
  if (at == frame.tiles.size() || frame.returned[at] || frame.ended) return;
  frame.returned[at] = true;
  --frame.left;
  const image::PixelMask& cast = frame.tiles[at].mask;
  if (tile.coarse) {  // it tells nothing: no space counts as seen
    if (frame.kind != PlannedFrame::Kind::kFine) frame.came_m[at].assign(cast.count(), 0);
    return;
  }
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
  ViewerView* view = viewers_.find(frame.viewer);
  const bool same = view && view->known && view->camera == frame.camera;
  validation_.check({map.camera, map.depth_m, map.colour, map.normal, frame.firm},
                    {tile.rect, cast, tile.image, same ? &view->doubted : nullptr}, now_s, contradicted);
  if (same) merge(contradicted, tile.rect.x, tile.rect.y, view->doubted);
  refill_empty(frame, tile, contradicted);
}

// A viewer that still looks from there does not need these pixels again.
void Planner::note_done(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask* cast) {
  ViewerView* view = viewers_.find(frame.viewer);
  if (!view || !view->known || !(view->camera == frame.camera)) return;
  if (cast) return merge(*cast, tile.rect.x, tile.rect.y, view->done);
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; ++y)
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; ++x) view->done.set(x, y);
}

// Rays hit a surface in space known as empty: other rays shall search around it.
void Planner::refill_empty(const PlannedFrame& frame, const SampledTile& tile, const image::PixelMask& contradicted) {
  std::vector<glm::vec3> hits;
  for (int y = 0; y < contradicted.height(); ++y)
    image::for_each_set(contradicted.row(y), contradicted.words_per_row(), [&](size_t x) {
      const int frame_x = tile.rect.x + static_cast<int>(x), frame_y = tile.rect.y + y;
      const uint32_t code = tile.image.depth[static_cast<size_t>(y) * tile.rect.width + x];
      if (code == 0 || frame.map->covered.at(frame_x, frame_y)) return;
      hits.emplace_back(
          tile.camera.unproject(frame_x + 0.5, frame_y + 0.5, image::decode_depth(code, tile.camera.near_m)));
    });
  if (!hits.empty()) known_empty_.refill(hits);
}

// Pixels of large views are smaller than cells: half as many on each axis clear nearly as many cells, in a fourth of
// the time, and later views look closer where cells are left.
void Planner::carve(const geometry::Camera& full, const std::vector<float>& all_m) {
  const int width = full.width / 2, height = full.height / 2;
  if (all_m.size() < kCoarseCarve || width < 1 || height < 1) return known_empty_.carve(full, all_m, config_.threads);
  geometry::Camera camera = geometry::crop(full, {0, 0, 2 * width, 2 * height});
  camera.width = width, camera.height = height;
  coarse_m_.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float* upper = &all_m[static_cast<size_t>(2 * y) * full.width + 2 * x];
      const float* lower = upper + full.width;
      // Clear as far as all four are; new if one of them is.
      const float clear = std::min({std::abs(upper[0]), std::abs(upper[1]), std::abs(lower[0]), std::abs(lower[1])});
      const bool news = upper[0] > 0 || upper[1] > 0 || lower[0] > 0 || lower[1] > 0;
      coarse_m_[static_cast<size_t>(y) * width + x] = news ? clear : -clear;
    }
  known_empty_.carve(camera, coarse_m_, config_.threads);
}

void Planner::settle(const PlannedFrame& frame) {
  if (frame.whole) {
    carve(frame.camera, frame.whole_m);
  } else if (!frame.came_m.empty()) {
    clear_depths(frame, clear_m_);
    carve(frame.camera, clear_m_);
  }
  if (frame.kind == PlannedFrame::Kind::kView && !frame.whole && !frame.ended) validation_.resampled(frame.planned_s);
}

// The newest frame first: later views look at the same space.
bool Planner::settle() {
  auto& frames = shelf_.frames();
  const auto found = std::find_if(frames.rbegin(), frames.rend(), [](const PlannedFrame& f) { return f.complete(); });
  if (found == frames.rend()) return false;
  settle(*found);
  shelf_.drop(FrameId(found->id));
  return true;
}

// Whole frames clear most, so the next plan waits for them. Other frames that were not settled in time are forgotten:
// their rays that met nothing are cast once more. Frames whose tiles do not come are forgotten, too: their samplers
// died, or a newer view went first. Tiles that still come are compared with the model.
void Planner::settle_old(double now_s) {
  constexpr double kOld_s = 1;
  for (size_t i = shelf_.frames().size(); i-- > 0;) {
    const PlannedFrame& frame = shelf_.frames()[i];
    if (FrameShelf::given_up(frame, now_s)) {
      shelf_.drop(FrameId(frame.id));
      continue;
    }
    if (!frame.complete() || (!frame.whole && now_s - frame.planned_s < kOld_s)) continue;
    if (frame.whole) settle(frame);
    shelf_.drop(FrameId(frame.id));
  }
}

// ---- depths --------------------------------------------------------------------------------------------------------

namespace {

class Depths {
 public:
  explicit Depths(const geometry::Camera& camera) : scale_(static_cast<float>(camera.near_m * image::kMaxDepthCode)) {}
  float metres(uint32_t code) const {
    return code == 0 ? std::numeric_limits<float>::infinity() : scale_ / static_cast<float>(code);
  }

 private:
  float scale_;
};

}  // namespace

std::vector<float> depths_of(const SampledTile& tile, const image::PixelMask& cast) {
  const Depths depths(tile.camera);
  std::vector<float> out;
  for (int y = 0; y < tile.rect.height; ++y) {
    const uint32_t* code = &tile.image.depth[static_cast<size_t>(y) * tile.rect.width];
    image::for_each_set(cast.row(y), cast.words_per_row(), [&](size_t x) { out.push_back(depths.metres(code[x])); });
  }
  return out;
}

void write_depths(const SampledTile& tile, std::vector<float>& depth_m) {
  const Depths depths(tile.camera);
  for (int y = 0; y < tile.rect.height; ++y) {
    const uint32_t* code = &tile.image.depth[static_cast<size_t>(y) * tile.rect.width];
    float* out = &depth_m[static_cast<size_t>(tile.rect.y + y) * tile.camera.width + tile.rect.x];
    for (int x = 0; x < tile.rect.width; ++x) out[x] = depths.metres(code[x]);
  }
}

namespace {

constexpr float kKnown = -1;  // sign of depths that were known before

// A ray that hit the shown surface brings nothing new.
bool confirms(float came_m, float shown_m) {
  constexpr float kTolerance = 0.01f;
  return came_m == shown_m || std::abs(came_m - shown_m) <= kTolerance * shown_m;
}

// The space before a pixel without a ray counts as empty up to the depth that the model shows there. At edges, and
// where samples are far apart, it counts as empty up to the least depth of the pixels around.
void clear_as_shown(const PlannedFrame& frame, int y, float* clear_m) {
  const ViewMap& map = *frame.map;
  const int width = map.camera.width, height = map.camera.height;
  const float* shown = &map.depth_m[static_cast<size_t>(y) * width];
  image::for_each_set(frame.firm.row(y), frame.firm.words_per_row(), [&](size_t x) { clear_m[x] = kKnown * shown[x]; });
  const auto nearest = [&](int x) {
    float least = std::numeric_limits<float>::infinity();
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j)
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width - 1); ++i)
        least = std::min(least, map.depth_m[static_cast<size_t>(j) * width + i]);
    return least;
  };
  for (size_t w = 0; w < map.edge.words_per_row(); ++w) {
    const uint64_t edges = map.edge.row(y)[w] & map.covered.row(y)[w] & ~map.lacking.row(y)[w] & ~frame.firm.row(y)[w];
    const uint64_t put_off = frame.put_off.height() > 0 ? frame.put_off.row(y)[w] : 0;
    for (uint64_t rest = edges | put_off; rest != 0; rest &= rest - 1) {
      const int x = static_cast<int>(w) * 64 + std::countr_zero(rest);
      clear_m[x] = kKnown * nearest(x);
    }
  }
}

}  // namespace

void clear_depths(const PlannedFrame& frame, std::vector<float>& clear_m) {
  const auto width = static_cast<size_t>(frame.camera.width);
  clear_m.assign(width * static_cast<size_t>(frame.camera.height), 0.0f);
  for (int y = 0; frame.map && y < frame.firm.height(); ++y) clear_as_shown(frame, y, &clear_m[y * width]);
  for (size_t i = 0; i < frame.came_m.size(); ++i) {
    const RayTile& tile = frame.tiles[i];
    const float* next = frame.came_m[i].data();
    if (frame.came_m[i].size() != tile.rays) continue;
    for (int y = 0; y < tile.rect.height; ++y) {
      float* clear = &clear_m[static_cast<size_t>(tile.rect.y + y) * width + static_cast<size_t>(tile.rect.x)];
      image::for_each_set(tile.mask.row(y), tile.mask.words_per_row(), [&](size_t x) {
        const float came = *next++;
        if (!confirms(came, kKnown * clear[x])) clear[x] = came;
      });
    }
  }
}

}  // namespace telesplat::packer
