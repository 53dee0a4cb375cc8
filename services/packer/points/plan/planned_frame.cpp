#include "services/packer/points/plan/planned_frame.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/splat/reference/reference_depth.h"

namespace telesplat::packer {

size_t PlannedFrame::find(const geometry::Rect& rect) const {
  const auto found = std::find_if(tiles.begin(), tiles.end(), [&](const RayTile& t) { return t.rect == rect; });
  return static_cast<size_t>(found - tiles.begin());
}

PlannedFrame* FrameShelf::find(FrameId id) {
  const auto found = std::find_if(frames_.begin(), frames_.end(), [&](const PlannedFrame& f) { return f.id == id; });
  return found == frames_.end() ? nullptr : &*found;
}

// Masks have a bit a pixel, and depths come of each ray.
size_t FrameShelf::held(const PlannedFrame& frame) {
  size_t pixels = frame.whole_m.size() + (frame.map ? frame.map->depth_m.size() : 0);
  for (const RayTile& t : frame.tiles)
    pixels += t.rays + (static_cast<size_t>(t.rect.width) * static_cast<size_t>(t.rect.height) + 31) / 32;
  return pixels;
}

PlannedFrame& FrameShelf::add(PlannedFrame frame) {
  drop(frame.id);
  frame.held = held(frame);
  size_t pixels = frame.held;
  for (const PlannedFrame& f : frames_) pixels += f.held;
  while (!frames_.empty() && (frames_.size() >= kMaxFrames || pixels > kMaxPixels)) {
    pixels -= frames_.front().held;
    frames_.pop_front();
  }
  return frames_.emplace_back(std::move(frame));
}

void FrameShelf::drop(FrameId id) {
  std::erase_if(frames_, [&](const PlannedFrame& f) { return f.id == id; });
}

bool view_under_way(const FrameShelf& shelf, double now_s) {
  constexpr double kSoon_s = 0.25;
  return std::any_of(shelf.frames().begin(), shelf.frames().end(), [&](const PlannedFrame& f) {
    return f.kind == PlannedFrame::Kind::kView && !f.complete() && now_s - f.planned_s < kSoon_s;
  });
}

bool tells_much(const FrameShelf& shelf) {
  constexpr uint64_t kMany = 4096;
  return std::any_of(shelf.frames().begin(), shelf.frames().end(),
                     [](const PlannedFrame& f) { return f.complete() && (f.whole || f.passed >= kMany); });
}

void note_inserted(const points::PreparedPatch& patch, const points::ModelConfig& model, FrameShelf& shelf) {
  constexpr int kMostFollowed = 4;  // more than viewers most often have under way
  if (patch.mosaics.empty()) return;
  const uint32_t tag = patch.mosaics.front().second.frame_tag();
  if (points::group_of(tag) != 0) return;  // its points will be gone
  int followed = 0;
  for (auto frame = shelf.frames().rbegin(); frame != shelf.frames().rend(); ++frame) {
    if (!frame->map || !frame->nearest_known || frame->complete()) continue;
    frame->nearest_known = ++followed <= kMostFollowed;
    if (!frame->nearest_known || tag == points::tagged(frame->id, 1).value) continue;
    splat::add_to_reference_depth(patch, model, frame->camera, frame->map->nearest_m);
  }
}

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

constexpr float kKnown = -1;  // sign of what was known before

// A ray that saw what was shown tells nothing new.
bool confirms(float came_m, float shown_m) {
  constexpr float kTolerance = 0.01f;
  return came_m == shown_m || std::abs(came_m - shown_m) <= kTolerance * shown_m;
}

// What was not cast is as it was shown, unless a ray was needed to tell. At edges, and where samples
// are far apart, the nearest surface around counts.
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
