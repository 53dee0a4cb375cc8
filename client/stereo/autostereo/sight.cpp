#include "client/stereo/autostereo/sight.h"

#include <algorithm>
#include <cmath>

#include "client/stereo/autostereo/interleaver.h"
#include "common/core/check.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::stereo {
namespace {

// How much of the way from line 0 to `line` is open.
double opened(double line, double half_opening) {
  const double nearest = std::nearbyint(line);
  return 2 * half_opening * nearest + std::clamp(line - nearest, -half_opening, half_opening);
}

}  // namespace

double visible_share(const Panel& panel, const glm::dvec3& eye, int x, int y, int subpixel) {
  const double half_m = 0.5 * panel.pixel_m / (panel.subpixels == Subpixels::kWhole ? 1 : 3);
  const double half_opening = 0.5 * panel.lines.opening;
  const glm::dvec2 middle = place_of(panel, x, y, subpixel);
  const auto line = [&](double aside_m) {
    return line_at(panel.lines, through(panel.lines, eye, middle + glm::dvec2(aside_m, 0)));
  };
  const double from = line(-half_m), to = line(half_m);
  return (opened(to, half_opening) - opened(from, half_opening)) / (to - from);
}

image::View seen_by(const Panel& panel, const glm::dvec3& eye, const image::View& picture) {
  CHECK(picture.width == panel.width && picture.height == panel.height);
  image::View out{picture.width, picture.height, std::vector<uint32_t>(picture.colour.size()), {}};
  const auto shifts = shifts_of(panel.subpixels);
  const int reach = std::max(1, int(std::ceil(panel.lines.pitch_m / panel.pixel_m)));
  const auto width = size_t(panel.width);
  in_parallel(0, panel.height, [&](int y) {
    // Of each channel, sums from the row's beginning.
    std::vector<double> light(width + 1), visible(width + 1);
    const uint32_t* row = picture.colour.data() + size_t(y) * width;
    uint32_t* to = out.colour.data() + size_t(y) * width;
    std::fill_n(to, width, 0xff000000u);
    for (int s = 0; s < 3; ++s) {
      const int shift = shifts[size_t(s)];
      for (size_t x = 0; x < width; ++x) {
        const double share = visible_share(panel, eye, int(x), y, s);
        light[x + 1] = light[x] + share * (row[x] >> shift & 255);
        visible[x + 1] = visible[x] + share;
      }
      for (int x = 0; x < panel.width; ++x) {
        const auto from = size_t(std::max(0, x - reach)), end = size_t(std::min(panel.width, x + reach + 1));
        const double sum = visible[end] - visible[from];
        if (sum > 0) to[x] |= uint32_t(std::lround((light[end] - light[from]) / sum)) << shift;
      }
    }
  });
  return out;
}

SeenShares seen_shares(const Panel& panel, const Eyes& eyes) {
  Interleaver interleaver(panel);
  const auto shifts = shifts_of(panel.subpixels);
  std::vector<uint32_t> of_left, of_right;
  double seen = 0, wrong = 0;
  uint64_t dark = 0, all = 0;
  const int middle = panel.height / 2, first = std::max(0, middle - 4), end = std::min(panel.height, middle + 4);
  for (int y = first; y < end; ++y) {
    interleaver.masks(eyes, y, of_left, of_right);
    for (int x = 0; x < panel.width; ++x)
      for (int s = 0; s < 3; ++s) {
        const bool left = of_left[size_t(x)] >> shifts[size_t(s)] & 1,
                   right = of_right[size_t(x)] >> shifts[size_t(s)] & 1;
        dark += !left && !right;
        ++all;
        const double by_left = left || right ? visible_share(panel, eyes[0], x, y, s) : 0;
        const double by_right = left || right ? visible_share(panel, eyes[1], x, y, s) : 0;
        seen += by_left + by_right;
        wrong += left ? by_right : by_left;
      }
  }
  return {seen > 0 ? wrong / seen : 0, all > 0 ? double(dark) / double(all) : 0};
}

}  // namespace telesplat::stereo
