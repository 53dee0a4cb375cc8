#include "services/packer/points/plan/planned_frame.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/codec/mask_stream.h"
#include "common/parallel/in_parallel.h"
#include "common/splat/reference/reference_depth.h"

namespace telesplat::packer {

namespace {

// Returns 64 pixels of a row from x on; those beyond the row's words are zero.
uint64_t bits_at(const uint64_t* row, size_t words, int x) {
  const auto word = static_cast<size_t>(x) >> 6;
  const int shift = x & 63;
  const uint64_t low = word < words ? row[word] >> shift : 0;
  return shift == 0 || word + 1 >= words ? low : low | row[word + 1] << (64 - shift);
}

uint64_t first_bits(int n) { return n >= 64 ? ~uint64_t{0} : (uint64_t{1} << n) - 1; }

// Number of rays in a rectangle, and their box.
struct Content {
  uint64_t rays = 0;
  geometry::Rect box;
};
Content content_of(const image::PixelMask& mask, const geometry::Rect& r) {
  Content out;
  int x0 = r.x + r.width, x1 = r.x, y0 = -1, y1 = 0;
  for (int y = r.y; y < r.y + r.height; ++y) {
    const uint64_t rays = out.rays;
    for (int x = r.x; x < r.x + r.width; x += 64) {
      const uint64_t bits = bits_at(mask.row(y), mask.words_per_row(), x) & first_bits(r.x + r.width - x);
      if (bits == 0) continue;
      out.rays += static_cast<uint64_t>(std::popcount(bits));
      x0 = std::min(x0, x + std::countr_zero(bits));
      x1 = std::max(x1, x + 64 - std::countl_zero(bits));
    }
    if (out.rays == rays) continue;
    if (y0 < 0) y0 = y;
    y1 = y + 1;
  }
  if (out.rays > 0) out.box = {x0, y0, x1 - x0, y1 - y0};
  return out;
}

// Returns where to cut a box that is wider than high, so that about `share` of its rays lie on the left: between two
// words of the mask, if possible.
int cut_across(const image::PixelMask& mask, const geometry::Rect& box, double share, uint64_t rays) {
  const int first = box.x / 64 + 1, last = (box.x + box.width - 1) / 64;
  if (first > last) return box.x + box.width / 2;
  std::vector<uint64_t> before(static_cast<size_t>(last - first + 1));  // rays in the word before each possible cut
  for (int y = box.y; y < box.y + box.height; ++y) {
    const uint64_t* const row = mask.row(y);
    before[0] += static_cast<uint64_t>(std::popcount(row[first - 1] >> (box.x & 63)));
    for (size_t i = 1; i < before.size(); ++i)
      before[i] += static_cast<uint64_t>(std::popcount(row[static_cast<size_t>(first) + i - 1]));
  }
  const double wanted = share * static_cast<double>(rays);
  int best = first;
  double sum = 0, least = HUGE_VAL;
  for (size_t i = 0; i < before.size(); ++i) {
    sum += static_cast<double>(before[i]);
    if (std::abs(sum - wanted) < least) least = std::abs(sum - wanted), best = first + static_cast<int>(i);
  }
  return best * 64;
}

// The same for a box that is higher than wide: about `share` of its rays lie above.
int cut_down(const image::PixelMask& mask, const geometry::Rect& box, double share, uint64_t rays) {
  const double wanted = share * static_cast<double>(rays);
  int best = box.y + 1;
  double sum = 0, least = HUGE_VAL;
  for (int y = box.y; y + 1 < box.y + box.height; ++y) {
    sum += static_cast<double>(content_of(mask, {box.x, y, box.width, 1}).rays);
    if (std::abs(sum - wanted) < least) least = std::abs(sum - wanted), best = y + 1;
  }
  return best;
}

void cut(const image::PixelMask& mask, const geometry::Rect& r, const TileLimits& limits, std::vector<RayTile>& tiles) {
  const auto [rays, box] = content_of(mask, r);
  if (rays == 0) return;
  const int longest = std::max(box.width, box.height);
  const auto parts = [](uint64_t all, uint64_t of) { return (all + of - 1) / of; };
  const uint64_t by_size =
      parts(static_cast<uint64_t>(longest), static_cast<uint64_t>(std::max(limits.size, kLeastTile)));
  const uint64_t by_rays = limits.rays == 0 || longest <= kLeastTile ? 1 : parts(rays, limits.rays);
  const uint64_t most = std::max(by_size, by_rays);
  if (most == 1) {
    tiles.push_back({box, cropped(mask, box), rays});
    return;
  }
  const double share = static_cast<double>(most / 2) / static_cast<double>(most);
  if (box.width >= box.height) {
    const int x = cut_across(mask, box, share, rays);
    cut(mask, {box.x, box.y, x - box.x, box.height}, limits, tiles);
    cut(mask, {x, box.y, box.x + box.width - x, box.height}, limits, tiles);
  } else {
    const int y = cut_down(mask, box, share, rays);
    cut(mask, {box.x, box.y, box.width, y - box.y}, limits, tiles);
    cut(mask, {box.x, y, box.width, box.y + box.height - y}, limits, tiles);
  }
}

}  // namespace

image::PixelMask cropped(const image::PixelMask& mask, const geometry::Rect& r) {
  image::PixelMask out(r.width, r.height);
  for (int y = 0; y < r.height; ++y) {
    uint64_t* row = out.row(y);
    for (int x = 0; x < r.width; x += 64)
      row[x >> 6] = bits_at(mask.row(r.y + y), mask.words_per_row(), r.x + x) & first_bits(r.width - x);
  }
  return out;
}

void merge(const image::PixelMask& part, int x, int y, image::PixelMask& mask) {
  const int shift = x & 63;
  for (int row = 0; row < part.height(); ++row) {
    const uint64_t* from = part.row(row);
    uint64_t* to = mask.row(y + row) + (x >> 6);
    for (size_t w = 0; w < part.words_per_row(); ++w) {
      if (from[w] == 0) continue;
      to[w] |= from[w] << shift;
      if (shift != 0 && from[w] >> (64 - shift) != 0) to[w + 1] |= from[w] >> (64 - shift);
    }
  }
}

std::vector<RayTile> cut_tiles(const image::PixelMask& mask, const geometry::Rect& area, const TileLimits& limits) {
  std::vector<RayTile> tiles;
  cut(mask, area, limits, tiles);
  return tiles;
}

uint64_t put_off_rays(const image::PixelMask& some, uint64_t most, image::PixelMask& cast) {
  constexpr int kWidth = 64, kHeight = 16;  // a word of a mask
  struct Piece {
    size_t word;
    int y;
    uint64_t rays;
    double distance2;
  };
  std::vector<Piece> pieces;
  uint64_t left = 0;
  for (int y = 0; y < some.height(); y += kHeight)
    for (size_t word = 0; word < some.words_per_row(); ++word) {
      uint64_t rays = 0;
      for (int row = y; row < std::min(y + kHeight, some.height()); ++row)
        rays += static_cast<uint64_t>(std::popcount(some.row(row)[word]));
      if (rays == 0) continue;
      const double dx = (static_cast<double>(word) + 0.5) * kWidth - 0.5 * some.width();
      const double dy = y + 0.5 * kHeight - 0.5 * some.height();
      pieces.push_back({word, y, rays, dx * dx + dy * dy});
      left += rays;
    }
  if (left <= most) return 0;
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.distance2 > b.distance2; });
  uint64_t taken = 0;
  for (const Piece& piece : pieces) {
    if (left <= most) break;
    for (int row = piece.y; row < std::min(piece.y + kHeight, some.height()); ++row)
      cast.row(row)[piece.word] &= ~some.row(row)[piece.word];
    left -= piece.rays, taken += piece.rays;
  }
  return taken;
}

void sort_by_distance_to_centre(std::vector<RayTile>& tiles, int width, int height) {
  const auto distance2 = [&](const RayTile& t) {
    const double dx = t.rect.x + 0.5 * t.rect.width - 0.5 * width, dy = t.rect.y + 0.5 * t.rect.height - 0.5 * height;
    return dx * dx + dy * dy;
  };
  std::stable_sort(tiles.begin(), tiles.end(),
                   [&](const RayTile& a, const RayTile& b) { return distance2(a) < distance2(b); });
}

size_t add_tiles(const std::vector<RayTile>& tiles, int threads, wire::Plan& plan) {
  std::vector<std::vector<uint32_t>> masks(tiles.size());
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] {
    in_parallel(size_t{0}, tiles.size(), [&](size_t i) {
      const RayTile& t = tiles[i];
      if (t.rays < static_cast<uint64_t>(t.rect.width) * static_cast<uint64_t>(t.rect.height))
        masks[i] = codec::encode_mask(t.mask);
    });
  });
  for (size_t i = 0; i < tiles.size(); ++i) {
    const RayTile& t = tiles[i];
    if (plan.tiles.size() / wire::kPlanNumbers >= wire::kMaxTiles || masks[i].size() > wire::kMaxMaskWords ||
        plan.masks.size() + masks[i].size() > wire::kMaxPlanWords)
      return i;
    for (const int n : {t.rect.x, t.rect.y, t.rect.width, t.rect.height}) plan.tiles.push_back(uint32_t(n));
    plan.tiles.push_back(uint32_t(t.rays));
    plan.tiles.push_back(uint32_t(masks[i].size()));
    plan.masks.insert(plan.masks.end(), masks[i].begin(), masks[i].end());
  }
  return tiles.size();
}

// ---- frames --------------------------------------------------------------------------------------------------------

size_t PlannedFrame::find(const geometry::Rect& rect) const {
  const auto found = std::find_if(tiles.begin(), tiles.end(), [&](const RayTile& t) { return t.rect == rect; });
  return static_cast<size_t>(found - tiles.begin());
}

PlannedFrame* FrameShelf::find(FrameId id) {
  const auto found = std::find_if(frames_.begin(), frames_.end(), [&](const PlannedFrame& f) { return f.id == id; });
  return found == frames_.end() ? nullptr : &*found;
}

// Masks have one bit per pixel, and depths come only for rays.
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
  constexpr int kMostFollowed = 4;  // most often, viewers have fewer frames under way
  if (patch.mosaics.empty()) return;
  const uint32_t tag = patch.mosaics.front().second.frame_tag();
  if (points::group_of(tag) != 0) return;  // a temporary group's points will be gone
  int followed = 0;
  for (auto frame = shelf.frames().rbegin(); frame != shelf.frames().rend(); ++frame) {
    if (!frame->map || !frame->nearest_known || frame->complete()) continue;
    frame->nearest_known = ++followed <= kMostFollowed;
    if (!frame->nearest_known || tag == points::tagged(frame->id, false).value) continue;
    splat::add_to_reference_depth(patch, model, frame->camera, frame->map->nearest_m);
  }
}

// ---- views ---------------------------------------------------------------------------------------------------------

namespace {

size_t pixels_of(const geometry::Camera& camera) {
  return static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height);
}

// Returns the number of pixels in a view's maps.
size_t pixels_in(const ViewerView& v) {
  const size_t each = pixels_of(v.camera);
  return (v.map ? each : 0) + (v.fine_map && v.fine_map != v.map ? each : 0);
}

geometry::Box grown(const geometry::Box& box, float by_m) { return {box.lo - by_m, box.hi + by_m}; }

}  // namespace

uint64_t ValidationTurn::take_due(int sets, double turn_s, double most, double now_s) {
  sets_due = std::clamp(sets_due + sets * (now_s - std::exchange(at_s, now_s)) / turn_s, 0.0, most);
  const double due = std::floor(sets_due);
  sets_due -= due;
  return static_cast<uint64_t>(due);
}

void forget_casts(ViewerView& view) {
  const int width = view.camera.width, height = view.camera.height;
  view.done.reset(width, height);
  view.doubted.reset(width, height);
  for (image::PixelMask& mask : view.refined) mask.reset(width, height);
  for (auto& tiles : view.found) tiles.clear();
  view.cells_done = 0;
  view.fine_map = nullptr;
  view.looks = 0;
  view.lost.clear();
  view.cell_rays = 0;
}

void follow(const geometry::Camera& camera, ViewerView& view) {
  view.still = view.known && view.camera == camera;
  view.movement_m = view.known ? camera.pose.position_room - view.camera.pose.position_room : glm::dvec3(0);
  if (view.still) return;
  view.camera = camera;
  view.known = true;
  view.map = nullptr;
  forget_casts(view);
}

bool may_see(const geometry::Camera& camera, double around_m, const points::ModelConfig& model,
             std::span<const points::ClusterKey> leaves) {
  // Views from beside see a little more on each side; splats stand out of their leaf.
  const int x = camera.width / 16 + 1, y = camera.height / 16 + 1;
  const geometry::Frustum frustum(geometry::crop(camera, {-x, -y, camera.width + 2 * x, camera.height + 2 * y}));
  const auto out_m = static_cast<float>(around_m + points::octree_grid(model).leaf_size);
  return std::any_of(leaves.begin(), leaves.end(), [&](points::ClusterKey key) {
    return frustum.may_contain(grown(points::leaf_box(model, key), out_m));
  });
}

ViewerView* ViewerViews::find(InstanceId viewer) {
  const auto found =
      std::find_if(views_.begin(), views_.end(), [&](const ViewerView& v) { return v.viewer == viewer; });
  return found == views_.end() ? nullptr : &*found;
}

ViewerView& ViewerViews::use(InstanceId viewer) {
  auto used = std::find_if(views_.begin(), views_.end(), [&](const ViewerView& v) { return v.viewer == viewer; });
  if (used == views_.end()) {
    used = views_.emplace(views_.begin());
    used->viewer = viewer;
  }
  views_.splice(views_.begin(), views_, used);
  size_t views = 0, pixels = 0, maps = 0, map_pixels = 0;
  std::erase_if(views_, [&](const ViewerView& v) {
    pixels += pixels_of(v.camera);
    return ++views > kMaxViewers || (views > 1 && pixels > kMaxViewPixels);
  });
  for (ViewerView& v : views_) {
    maps += (v.map != nullptr) + (v.fine_map && v.fine_map != v.map);
    map_pixels += pixels_in(v);
    if (&v == &views_.front() || (maps <= kMaxMaps && map_pixels <= kMaxMapPixels)) continue;
    v.map = nullptr, v.fine_map = nullptr;
  }
  return views_.front();
}

size_t ViewerViews::map_pixels() const {
  size_t out = 0;
  for (const ViewerView& v : views_) out += pixels_in(v);
  return out;
}

void ViewerViews::forgotten(const points::ModelConfig& model, double around_m,
                            std::span<const points::ClusterKey> leaves) {
  for (ViewerView& view : views_)
    if (view.known && may_see(view.camera, around_m, model, leaves)) forget_casts(view);
}

}  // namespace telesplat::packer
