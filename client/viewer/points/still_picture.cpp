#include "client/viewer/points/still_picture.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace telesplat::viewer {
namespace {

// Pixels by which a point's splat can reach beyond its cluster's cube: half of splat::kMaxSplatSide sub-pixels, at two
// sub-pixels a pixel, plus the reach of the finish.
constexpr double kOverhang = 6;

}  // namespace

void StillPicture::begin(const geometry::Camera& camera) {
  camera_ = camera;
  columns_ = (camera.width + kTileWidth - 1) / kTileWidth;
  covered_ = 0;
  tiles_.clear();
  for (int y = 0; y < camera.height; y += kTileHeight)
    for (int x = 0; x < camera.width; x += kTileWidth) {
      const geometry::Rect r{x, y, std::min(kTileWidth, camera.width - x), std::min(kTileHeight, camera.height - y)};
      tiles_.push_back({r, std::hypot(r.x + 0.5 * (r.width - camera.width), r.y + 0.5 * (r.height - camera.height))});
    }
  colour_.resize(size_t(camera.width) * size_t(camera.height));
}

void StillPicture::on_changes(const ModelCache::Changes& changes) {
  if (changes.everywhere) return begin(camera_);
  if (changes.boxes.empty()) return;
  const auto to_pixel = camera_.room_to_pixel();
  for (const geometry::Box& box : changes.boxes) want(to_pixel, box);
}

void StillPicture::on_changes(std::span<const geometry::Rect> rects) {
  for (const geometry::Rect& r : rects)
    want(std::max(r.x - 1, 0), std::max(r.y - 1, 0), std::min(r.x + r.width, camera_.width - 1),
         std::min(r.y + r.height, camera_.height - 1));
}

// Marks the tiles that the box's eight corners span.
void StillPicture::want(const geometry::Camera::PixelTransform& to_pixel, const geometry::Box& box) {
  double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
  int behind = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec4 p(corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                       corner & 4 ? box.hi.z : box.lo.z, 1);
    const double w = glm::dot(to_pixel.w, p);
    if (w < camera_.near_m) {
      ++behind;
      continue;
    }
    const double x = glm::dot(to_pixel.x, p) / w, y = glm::dot(to_pixel.y, p) / w;
    x0 = std::min(x0, x), x1 = std::max(x1, x);
    y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  if (behind == 8) return;
  if (behind > 0) return want(0, 0, camera_.width - 1, camera_.height - 1);
  x0 -= kOverhang, y0 -= kOverhang, x1 += kOverhang, y1 += kOverhang;
  if (!(x1 >= 0 && y1 >= 0 && x0 < camera_.width && y0 < camera_.height)) return;
  want(int(std::max(x0, 0.0)), int(std::max(y0, 0.0)), int(std::min(x1, camera_.width - 1.0)),
       int(std::min(y1, camera_.height - 1.0)));
}

void StillPicture::want(int x0, int y0, int x1, int y1) {
  for (int row = y0 / kTileHeight; row <= y1 / kTileHeight; ++row)
    for (int column = x0 / kTileWidth; column <= x1 / kTileWidth; ++column)
      tiles_[size_t(row * columns_ + column)].wanted = true;
}

std::optional<size_t> StillPicture::next(double now_s) const {
  const auto order = [](const Tile& t) { return std::tuple(t.has_pixels, t.done_s, t.distance); };
  std::optional<size_t> best;
  for (size_t i = 0; i < tiles_.size(); ++i) {
    const Tile& t = tiles_[i];
    if (t.wanted && now_s - t.done_s >= kTileRest_s && (!best || order(t) < order(tiles_[*best]))) best = i;
  }
  return best;
}

uint32_t* StillPicture::pixels(size_t tile) {
  const geometry::Rect& r = tiles_[tile].rect;
  return colour_.data() + size_t(r.y) * size_t(camera_.width) + size_t(r.x);
}

void StillPicture::done(size_t tile, bool has_pixels, double now_s) {
  Tile& t = tiles_[tile];
  t.wanted = false;
  t.done_s = now_s;
  covered_ += size_t(has_pixels) - size_t(t.has_pixels);
  t.has_pixels = has_pixels;
}

void StillPicture::put_over(image::View& picture, size_t tile) const {
  const Tile& t = tiles_[tile];
  if (!t.has_pixels) return;
  for (int y = t.rect.y; y < t.rect.y + t.rect.height; ++y) {
    const size_t first = size_t(y) * size_t(camera_.width) + size_t(t.rect.x);
    std::copy_n(colour_.data() + first, t.rect.width, picture.colour.data() + first);
  }
}

void StillPicture::put_over(image::View& picture) const {
  for (size_t i = 0; i < tiles_.size(); ++i) put_over(picture, i);
}

double StillPicture::share() const {
  double pixels = 0;
  for (const Tile& t : tiles_)
    if (t.has_pixels) pixels += double(t.rect.width) * t.rect.height;
  return tiles_.empty() ? 0 : pixels / (double(camera_.width) * camera_.height);
}

}  // namespace telesplat::viewer
