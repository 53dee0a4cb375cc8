#include "client/viewer/render/fine_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace telesplat::viewer {
namespace {

// Depths are kept as steps of a 2730th of an octave (0.025 %), from near_m on, 24 octaves of them.
constexpr double kSteps = 2730;
constexpr uint16_t kNothing = 0xffff;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
// Rays and pixels have the same eye if the nearest content moves by at most this between them, pixels.
constexpr double kParallax = 1;
// Content counts as at least this near: points that were known before are no hits of finer rays.
constexpr double kNearest_m = 0.3;
// Rays around a hit on another surface that are forgotten, on each side.
constexpr int kRevised = 3;
// More changes than this are reported as one change of everything.
constexpr size_t kMostChanges = 4096;
// Depths that differ by a smaller factor belong to one surface.
constexpr float kBehind = 1.03f;

uint16_t code(double depth_m, double near_m) {
  const double steps = std::round(kSteps * std::log2(std::max(depth_m / near_m, 1.0)));
  return static_cast<uint16_t>(std::min(1 + steps, double{kNothing - 1}));
}

float depth_of(uint16_t code, double near_m) {
  static const std::vector<float> kTimes = [] {
    std::vector<float> times(size_t{kNothing} + 1);
    for (size_t i = 1; i < kNothing; ++i) times[i] = static_cast<float>(std::exp2((double(i) - 1) / kSteps));
    times[kNothing] = kInfinity;
    return times;
  }();
  return static_cast<float>(near_m) * kTimes[code];
}

geometry::Rect whole(const geometry::Camera& camera) { return {0, 0, camera.width, camera.height}; }

bool same_frustum(const geometry::Camera& a, geometry::Camera b) {
  b.width = a.width, b.height = a.height;
  return a == b;
}

// Maps pixels of one camera to those of another with the same eye, as rows of a 3x3 matrix; the third row gives the
// depth there of a place at depth 1 here.
class PixelMap {
 public:
  PixelMap(const geometry::Camera& from, const geometry::Camera& to) {
    const auto t = to.room_to_pixel();
    const auto at = [&](double x, double y) {
      // From the other camera's eye: both are nearly the same.
      const glm::dvec3 d = from.unproject(x, y, 1) - from.pose.position_room;
      return glm::dvec3(glm::dot(glm::dvec3(t.x), d), glm::dot(glm::dvec3(t.y), d), glm::dot(glm::dvec3(t.w), d));
    };
    const double w = from.width, h = from.height;
    origin_ = at(0, 0), x_ = (at(w, 0) - origin_) / w, y_ = (at(0, h) - origin_) / h;
  }
  glm::dvec3 at(double x, double y) const { return origin_ + x * x_ + y * y_; }
  const glm::dvec3& step() const { return x_; }

 private:
  glm::dvec3 origin_, x_, y_;
};

// Returns the rectangle of the other picture that covers a rectangle of this one, cut to its size. Empty: it lies
// outside, or its corners do not all lie before the eye.
geometry::Rect around(const PixelMap& map, const geometry::Rect& r, const geometry::Camera& to) {
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
  for (int corner = 0; corner < 4; ++corner) {
    const glm::dvec3 p = map.at(r.x + (corner & 1) * r.width, r.y + (corner >> 1) * r.height);
    if (p.z <= 0) return {};
    x0 = std::min(x0, p.x / p.z), x1 = std::max(x1, p.x / p.z);
    y0 = std::min(y0, p.y / p.z), y1 = std::max(y1, p.y / p.z);
  }
  const auto within = [](double v, int size) { return static_cast<int>(std::clamp(v, 0.0, double(size))); };
  const int left = within(std::floor(x0), to.width), top = within(std::floor(y0), to.height);
  return {left, top, within(std::ceil(x1), to.width) - left, within(std::ceil(y1), to.height) - top};
}

}  // namespace

const FineRays::Block* FineRays::Layer::find(int block_x, int block_y) const {
  const auto found = blocks.find(block_y * columns() + block_x);
  return found == blocks.end() ? nullptr : found->second.get();
}

void FineRays::forget() {
  if (!layers_.empty()) changes_ = {{layers_.front().camera, whole(layers_.front().camera)}};
  layers_.clear();
  blocks_ = 0;
  nearest_m_ = std::numeric_limits<double>::infinity();
}

void FineRays::clear() {
  const std::lock_guard lock(mutex_);
  forget();
}

void FineRays::follow(const geometry::Camera& view) {
  const std::lock_guard lock(mutex_);
  if (!layers_.empty() && !same_eye(view)) forget();
}

FineRays::Layer& FineRays::layer_of(const geometry::Camera& camera) {
  if (!layers_.empty() && !same_frustum(camera, layers_.front().camera)) forget();
  const auto known = std::find_if(layers_.begin(), layers_.end(), [&](const Layer& l) { return l.camera == camera; });
  if (known != layers_.end()) return *known;
  if (layers_.size() == kMostLayers) forget();
  const auto coarser =
      std::find_if(layers_.begin(), layers_.end(), [&](const Layer& l) { return l.camera.width <= camera.width; });
  return *layers_.insert(coarser, Layer{camera, {}});
}

uint16_t* FineRays::Layer::at(int x, int y) {
  const auto found = blocks.find(y / kBlock * columns() + x / kBlock);
  if (found == blocks.end()) return nullptr;
  return &(*found->second)[static_cast<size_t>(y % kBlock * kBlock + x % kBlock)];
}

void FineRays::put(Layer& layer, int x, int y, uint16_t met) {
  if (uint16_t* known = layer.at(x, y)) {
    *known = met;
  } else if (blocks_ < kMostBlocks) {
    ++blocks_;
    layer.blocks[y / kBlock * layer.columns() + x / kBlock] = std::make_unique<Block>(Block{});
    *layer.at(x, y) = met;
  }
}

void FineRays::add(const Tile& tile) {
  const std::lock_guard lock(mutex_);
  if (tile.epoch != epoch_) forget(), epoch_ = tile.epoch;
  Layer& layer = layer_of(tile.camera);
  const geometry::Rect& m = tile.missed_rect;
  for (int y = 0; y < m.height; ++y)
    image::for_each_set(tile.missed->row(y), tile.missed->words_per_row(),
                        [&](size_t x) { put(layer, m.x + static_cast<int>(x), m.y + y, kNothing); });
  const geometry::Rect& r = tile.rect;
  for (int y = 0; y < r.height; ++y)
    for (int x = 0; x < r.width; ++x)
      if (const uint32_t depth = tile.image->depth[static_cast<size_t>(y) * r.width + x]) {
        const double depth_m = image::decode_depth(depth, tile.camera.near_m);
        nearest_m_ = std::min(nearest_m_, depth_m);
        put(layer, r.x + x, r.y + y, code(depth_m, tile.camera.near_m));
      }
  note_change(tile.camera, m);
}

// True if this ray and all known rays beside it went farther than this depth.
bool FineRays::went_farther(Layer& layer, int x, int y, float depth_m) {
  const uint16_t* own = layer.at(x, y);
  if (!own || *own == 0) return false;
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, layer.camera.height - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, layer.camera.width - 1); ++i)
      if (const uint16_t* met = layer.at(i, j); met && *met != 0)
        if (depth_of(*met, layer.camera.near_m) <= kBehind * depth_m) return false;
  return true;
}

void FineRays::revise(const geometry::Camera& camera, const geometry::Rect& rect, const image::DepthImage& image) {
  const std::lock_guard lock(mutex_);
  for (Layer& layer : layers_) {
    const auto t = layer.camera.room_to_pixel();
    const int width = layer.camera.width, height = layer.camera.height;
    for (int i = 0; i < rect.width * rect.height; ++i) {
      const uint32_t depth = image.depth[static_cast<size_t>(i)];
      if (depth == 0) continue;
      const glm::dvec4 place(camera.unproject(rect.x + i % rect.width + 0.5, rect.y + i / rect.width + 0.5,
                                              image::decode_depth(depth, camera.near_m)),
                             1);
      const double depth_m = glm::dot(t.w, place), u = glm::dot(t.x, place) / depth_m,
                   v = glm::dot(t.y, place) / depth_m;
      if (!(depth_m > 0 && u >= 0 && v >= 0 && u < width && v < height)) continue;
      const int x = static_cast<int>(u), y = static_cast<int>(v);
      if (!went_farther(layer, x, y, static_cast<float>(depth_m))) continue;
      const int left = std::max(x - kRevised, 0), top = std::max(y - kRevised, 0);
      const geometry::Rect around{left, top, std::min(x + kRevised + 1, width) - left,
                                  std::min(y + kRevised + 1, height) - top};
      for (int n = 0; n < around.width * around.height; ++n)
        if (uint16_t* met = layer.at(left + n % around.width, top + n / around.width)) *met = 0;
      note_change(layer.camera, around);
    }
  }
}

void FineRays::note_change(const geometry::Camera& camera, const geometry::Rect& rect) {
  changes_.emplace_back(camera, rect);
  // No caller takes the changes: join them.
  if (changes_.size() > kMostChanges) changes_ = {{camera, whole(camera)}};
}

bool FineRays::same_eye(const geometry::Camera& camera) const {
  const double apart_m = glm::distance(camera.pose.position_room, layers_.front().camera.pose.position_room);
  return apart_m * std::max(camera.focal_x(), camera.focal_y()) <= kParallax * std::min(nearest_m_, kNearest_m);
}

bool FineRays::look_up(const geometry::Camera& camera, EpochId epoch, std::vector<float>& met_m) const {
  const std::lock_guard lock(mutex_);
  if (layers_.empty() || epoch != epoch_ || !same_eye(camera)) return false;
  met_m.assign(static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height), 0);
  bool known = false;
  for (const Layer& layer : layers_) known |= look_up(layer, camera, met_m);
  return known;
}

bool FineRays::look_up(const Layer& layer, const geometry::Camera& camera, std::vector<float>& met_m) const {
  const PixelMap map(camera, layer.camera);
  const geometry::Rect there = around(map, whole(camera), layer.camera);
  if (there.width <= 0 || there.height <= 0) return false;
  const int first_x = there.x / kBlock, last_x = (there.x + there.width - 1) / kBlock;
  const int first_y = there.y / kBlock, last_y = (there.y + there.height - 1) / kBlock, columns = last_x - first_x + 1;
  std::vector<const Block*> blocks;
  for (int y = first_y; y <= last_y; ++y)
    for (int x = first_x; x <= last_x; ++x) blocks.push_back(layer.find(x, y));
  if (std::all_of(blocks.begin(), blocks.end(), [](const Block* b) { return b == nullptr; })) return false;
  bool known = false;
  float* met = met_m.data();
  for (int y = 0; y < camera.height; ++y) {
    glm::dvec3 at = map.at(0.5, y + 0.5);
    for (int x = 0; x < camera.width; ++x, ++met, at += map.step()) {
      if (*met != 0) continue;  // a finer layer knows it
      const double u = at.x / at.z, v = at.y / at.z;
      if (!(u >= there.x && v >= there.y && u < there.x + there.width && v < there.y + there.height)) continue;
      const int i = static_cast<int>(u), j = static_cast<int>(v);
      const Block* block = blocks[static_cast<size_t>((j / kBlock - first_y) * columns + i / kBlock - first_x)];
      if (!block) continue;
      const uint16_t code = (*block)[static_cast<size_t>(j % kBlock * kBlock + i % kBlock)];
      if (code == 0) continue;
      // Another orientation of the same eye has other depths along its axis.
      const float depth_m = depth_of(code, layer.camera.near_m) / static_cast<float>(at.z);
      *met = &layer == &layers_.front() ? depth_m : -depth_m;
      known = true;
    }
  }
  return known;
}

void FineRays::take_changes(const geometry::Camera& camera, std::vector<geometry::Rect>& out) {
  const std::lock_guard lock(mutex_);
  for (const auto& [from, rect] : changes_) {
    const geometry::Rect r = around(PixelMap(from, camera), rect, camera);
    if (r.width > 0 && r.height > 0) out.push_back(r);
  }
  changes_.clear();
}

}  // namespace telesplat::viewer
