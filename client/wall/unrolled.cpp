#include "client/wall/unrolled.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace telesplat::wall {

Result<Unrolled> unrolled(const Wall& wall) {
  Unrolled out;
  double pixel_m = std::numeric_limits<double>::max(), left = pixel_m, top = -pixel_m, right = -pixel_m,
         bottom = pixel_m;
  for (const Screen& s : wall.screens) {
    pixel_m = std::min({pixel_m, s.width_m / s.width, s.height_m / s.height});
    left = std::min(left, s.unrolled_m.x - s.width_m / 2), right = std::max(right, s.unrolled_m.x + s.width_m / 2);
    bottom = std::min(bottom, s.unrolled_m.y - s.height_m / 2), top = std::max(top, s.unrolled_m.y + s.height_m / 2);
  }
  const double across = std::round((right - left) / pixel_m), down = std::round((top - bottom) / pixel_m);
  if (!(std::max(across, down) <= geometry::kMaxImageSide))
    return Error{fmt::format("the wall {} unrolled has {:.0f}x{:.0f} pixels, limit {} a side", wall.name, across, down,
                             geometry::kMaxImageSide)};
  out.width = std::max(1, int(across)), out.height = std::max(1, int(down));
  out.metres_per_pixel = pixel_m;
  for (const Screen& s : wall.screens) {
    const int width = std::clamp(int(std::lround(s.width_m / pixel_m)), 1, out.width),
              height = std::clamp(int(std::lround(s.height_m / pixel_m)), 1, out.height);
    const double x = (s.unrolled_m.x - s.width_m / 2 - left) / pixel_m,
                 y = (top - s.unrolled_m.y - s.height_m / 2) / pixel_m;
    out.places.push_back({std::clamp(int(std::lround(x)), 0, out.width - width),
                          std::clamp(int(std::lround(y)), 0, out.height - height), width, height});
  }
  return out;
}

}  // namespace telesplat::wall
