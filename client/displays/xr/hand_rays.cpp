#include "client/displays/xr/hand_rays.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace telesplat::viewer {
namespace {

constexpr int kSteps = 512;            // along a ray
constexpr int kHalvings = 12;          // of the step in which it meets something
constexpr double kThick_m = 0.1;       // behind what is seen; a ray farther behind passes it
constexpr double kOnSurface_m = 2e-3;  // a line that ends there is not hidden by it

struct Pixel {
  size_t at;
  int x, y;
  double depth_m;
};

std::optional<Pixel> pixel_of(const image::View& picture, const geometry::Camera::PixelTransform& t, double near_m,
                              const glm::dvec3& point) {
  const glm::dvec4 p(point, 1);
  const double w = glm::dot(t.w, p);
  if (!(w > near_m)) return std::nullopt;
  const double x = std::floor(glm::dot(t.x, p) / w), y = std::floor(glm::dot(t.y, p) / w);
  if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) return std::nullopt;
  return Pixel{size_t(y) * size_t(picture.width) + size_t(x), int(x), int(y), w};
}

}  // namespace

std::optional<glm::dvec3> first_hit(const image::View& picture, const geometry::Camera& camera, const glm::dvec3& from,
                                    const glm::dvec3& direction) {
  const auto transform = camera.room_to_pixel();
  const auto behind = [&](double s) {
    const auto pixel = pixel_of(picture, transform, camera.near_m, from + s * direction);
    if (!pixel) return false;
    const double beyond = pixel->depth_m - double(picture.depth_m[pixel->at]);
    return beyond >= 0 && beyond < kThick_m;
  };
  const double step = kFarthest_m / kSteps;
  for (int i = 1; i <= kSteps; ++i) {
    if (!behind(i * step)) continue;
    double before = (i - 1) * step, after = i * step;
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (before + after);
      (behind(middle) ? after : before) = middle;
    }
    return from + after * direction;
  }
  return std::nullopt;
}

void draw_line(image::View& picture, const geometry::Camera& camera, const glm::dvec3& from, const glm::dvec3& to,
               uint32_t colour) {
  const auto transform = camera.room_to_pixel();
  const auto w_of = [&](const glm::dvec3& p) { return glm::dot(transform.w, glm::dvec4(p, 1)); };
  // The part before the picture plane.
  glm::dvec3 a = from, b = to;
  const double near_m = 1.001 * camera.near_m, wa = w_of(a), wb = w_of(b);
  if (!(wa > near_m) && !(wb > near_m)) return;
  if (!(wa > near_m)) a = glm::mix(a, b, (near_m - wa) / (wb - wa));
  if (!(wb > near_m)) b = glm::mix(b, a, (near_m - wb) / (wa - wb));
  // A step a pixel, as if it crossed the picture: even steps of the picture are uneven ones of the room.
  const int steps = 2 * std::max(picture.width, picture.height);
  const double w0 = w_of(a), w1 = w_of(b);
  const auto place = [&](const glm::dvec3& p, double w) {
    return glm::dvec2(glm::dot(transform.x, glm::dvec4(p, 1)), glm::dot(transform.y, glm::dvec4(p, 1))) / w;
  };
  // Only the part of it that lies in the picture.
  const glm::dvec2 at_a = place(a, w0), along = place(b, w1) - at_a, size(picture.width, picture.height);
  double begin = 0, end = 1;
  for (int axis = 0; axis < 2; ++axis) {
    if (std::abs(along[axis]) < 1e-9) continue;
    const double s0 = -at_a[axis] / along[axis], s1 = (size[axis] - at_a[axis]) / along[axis];
    begin = std::max(begin, std::min(s0, s1)), end = std::min(end, std::max(s0, s1));
  }
  size_t last = ~size_t{0};
  for (int i = 0; i <= steps && begin <= end; ++i) {
    const double s = begin + (end - begin) * i / steps, t = s * w0 / ((1 - s) * w1 + s * w0);
    const auto pixel = pixel_of(picture, transform, camera.near_m, glm::mix(a, b, t));
    if (!pixel || std::exchange(last, pixel->at) == pixel->at) continue;
    for (int y = std::max(pixel->y - 1, 0); y <= std::min(pixel->y + 1, picture.height - 1); ++y)
      for (int x = std::max(pixel->x - 1, 0); x <= std::min(pixel->x + 1, picture.width - 1); ++x) {
        const size_t at = size_t(y) * size_t(picture.width) + size_t(x);
        if (pixel->depth_m > double(picture.depth_m[at]) + kOnSurface_m) continue;
        picture.colour[at] = colour;
        picture.depth_m[at] = std::min(picture.depth_m[at], float(pixel->depth_m));
      }
  }
}

}  // namespace telesplat::viewer
