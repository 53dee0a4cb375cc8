#include "common/splat/backdrop.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace telesplat::splat {
namespace {

// Depths of one surface differ by less than this share, between neighbours.
constexpr float kSurface = 0.1f;
constexpr float kUncovered = std::numeric_limits<float>::infinity();

struct Sample {
  uint32_t colour = 0;
  float depth_m = 0;
};

// Bilinear between four pixels, as far as they are of the nearest one's surface. at: the upper left one; fx, fy: the
// place between them. Precondition: they are covered.
Sample sample(const Backdrop& b, size_t at, float fx, float fy) {
  const size_t below = at + static_cast<size_t>(b.camera.width);
  const size_t pixels[4] = {at, at + 1, below, below + 1};
  const float weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  float nearest = kUncovered;
  for (const size_t pixel : pixels) nearest = std::min(nearest, b.depth_m[pixel]);
  float red = 0, green = 0, blue = 0, reciprocal = 0, sum = 0;
  for (int k = 0; k < 4; ++k) {
    const float depth = b.depth_m[pixels[k]];
    if (depth > (1 + kSurface) * nearest) continue;
    const uint32_t c = b.colour[pixels[k]];
    const float weight = weights[k] + 1e-6f;  // the nearest one counts, even at its far edge
    sum += weight;
    red += weight * static_cast<float>(c >> 16 & 255);
    green += weight * static_cast<float>(c >> 8 & 255);
    blue += weight * static_cast<float>(c & 255);
    reciprocal += weight / depth;
  }
  const auto channel = [&](float total) { return static_cast<uint32_t>(total / sum + 0.5f); };
  return {channel(red) << 16 | channel(green) << 8 | channel(blue), sum / reciprocal};
}

// Calls visit(x, at, fx, fy) for the pixels [first, last) of the picture's row y whose four backdrop pixels are
// covered, with the arguments of sample(). The outermost pixels of the backdrop go on to the picture's edge.
void for_whole(const Backdrop& b, int y, int first, int last, const auto& visit) {
  const int side = 1 << b.halvings, last_left = b.camera.width - 2, last_top = b.camera.height - 2;
  if (last_left < 0 || last_top < 0) return;
  const float scale = 1 / static_cast<float>(side);
  const int top = std::clamp((y - side / 2) >> b.halvings, 0, last_top);
  const auto between = [&](int pixel, int begin) {
    return std::clamp((static_cast<float>(pixel - begin) + 0.5f) * scale, 0.0f, 1.0f);
  };
  const float fy = between(y, side * top + side / 2);
  const auto row = static_cast<size_t>(top) * static_cast<size_t>(b.camera.width);
  // Pixels from begin on lie between the backdrop's pixels `left` and left + 1.
  for (int left = std::clamp((first - side / 2) >> b.halvings, 0, last_left); left <= last_left; ++left) {
    const int begin = side * left + side / 2;
    if (left > 0 && begin >= last) return;
    const size_t at = row + static_cast<size_t>(left);
    if (!b.whole[at]) continue;
    const int from = left == 0 ? first : std::max(begin, first);
    const int until = left == last_left ? last : std::min(begin + side, last);
    for (int x = from; x < until; ++x) visit(x, at, between(x, begin), fy);
  }
}

}  // namespace

void select_coarse(const points::PointModel& model, const geometry::Camera& camera, const SelectionOptions& options,
                   DrawList& out) {
  constexpr double kWidestMean = 3;  // pixels
  SelectionOptions coarse{.scale = suitable_scale(kBackdrop.kernel), .cone_culling = false};
  for (out.halvings = kLeastHalvings;; ++out.halvings) {
    if (options.eyes)
      coarse.eyes = {backdrop_camera((*options.eyes)[0], out.halvings),
                     backdrop_camera((*options.eyes)[1], out.halvings)};
    select_view(model, backdrop_camera(camera, out.halvings), coarse, out);
    double widths = 0;
    for (const DrawItem& item : out.items) widths += static_cast<double>(item.splat_px) * item.level.count;
    if (out.halvings == kMostHalvings || widths <= kWidestMean * static_cast<double>(out.points)) break;
  }
  face_eye(glm::vec3(camera.pose.position_room), out);
}

void Backdrop::find_whole() {
  const auto width = static_cast<size_t>(camera.width);
  whole.assign(depth_m.size(), 0);
  const auto covered = [&](size_t at) { return depth_m[at] < kUncovered; };
  for (size_t y = 0; y + 1 < static_cast<size_t>(camera.height); ++y)
    for (size_t at = y * width; at + 1 < (y + 1) * width; ++at)
      whole[at] = covered(at) && covered(at + 1) && covered(at + width) && covered(at + width + 1);
}

void fill_from(const Backdrop& backdrop, const geometry::Rect& rect, float near_m, const ResolvedTile& tile, int grow) {
  for (int y = -grow; y < tile.height + grow; ++y) {
    uint32_t* colour = tile.colour(y) - rect.x;
    uint32_t* info = tile.info(y) - rect.x;
    for_whole(backdrop, rect.y + y, rect.x - grow, rect.x + tile.width + grow,
              [&](int x, size_t at, float fx, float fy) {
                if (info[x] != kEmptyInfo) return;
                const Sample s = sample(backdrop, at, fx, fy);
                if (s.depth_m < near_m) return;
                colour[x] = s.colour;
                info[x] = encode_depth_code(s.depth_m, near_m) << 8;
              });
  }
}

}  // namespace telesplat::splat
