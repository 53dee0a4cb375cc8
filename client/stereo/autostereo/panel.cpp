#include "client/stereo/autostereo/panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/stereo/autostereo/sight.h"

namespace telesplat::stereo {
namespace {

constexpr double kPanelDegree = 3.14159265358979323846 / 180;

}  // namespace

Status validate(const Panel& p) {
  const auto sides = [](const char* name, int width, int height) -> Status {
    for (const int side : {width, height})
      if (side < 1 || side > geometry::kMaxImageSide)
        return Error{fmt::format("{} is {} x {}, limits are 1 and {}", name, width, height, geometry::kMaxImageSide)};
    return ok_status();
  };
  if (const Status s = sides("pixels", p.width, p.height); !s) return s;
  if (const Status s = sides("eye", p.eye_size().width, p.eye_size().height); !s) return s;
  if (!(p.pixel_m >= 1e-6 && p.pixel_m <= 0.1))
    return Error{fmt::format("pixel_mm is {}, limits are 0.001 and 100", p.pixel_m * 1e3)};
  if (!(p.distance_m >= 0.05 && p.distance_m <= 100))
    return Error{fmt::format("distance_m is {}, limits are 0.05 and 100", p.distance_m)};
  if (const Status s = validate(p.lines); !s) return s;
  return validate(p, eyes_before(p, 0, p.distance_m));
}

Eyes eyes_before(const Panel&, double separation_m, double distance_m) {
  return {glm::dvec3(-0.5 * separation_m, 0, distance_m), glm::dvec3(0.5 * separation_m, 0, distance_m)};
}

Eyes eyes_of(const Panel& panel, const std::array<geometry::Camera, 2>& cameras) {
  Eyes out;
  for (size_t i = 0; i < 2; ++i) {
    const geometry::Camera& c = cameras[i];
    const double z = panel.width_m() / (c.right - c.left);
    out[i] = {-0.5 * (c.left + c.right) * z, -0.5 * (c.bottom + c.top) * z, z};
  }
  return out;
}

double nearest_eye_m(const Panel& panel) { return std::max(0.05, panel.lines.gap_m + panel.lines.thickness_m + 0.01); }

Status validate(const Panel& panel, const Eyes& eyes) {
  const double least = nearest_eye_m(panel) - 1e-9;
  for (const glm::dvec3& eye : eyes)
    if (!(eye.z >= least && eye.z <= 100))
      return Error{fmt::format("an eye is {:.3f} m before the display, limits are {:.2f} and 100", eye.z, least)};
  return ok_status();
}

glm::dvec2 place_of(const Panel& p, int x, int y, int subpixel) {
  const double within = p.subpixels == Subpixels::kWhole ? 0.5 : (subpixel + 0.5) / 3;
  return {(x + within - 0.5 * p.width) * p.pixel_m, (0.5 * p.height - y - 0.5) * p.pixel_m};
}

std::array<int, 3> shifts_of(Subpixels subpixels) {
  if (subpixels == Subpixels::kBgr) return {0, 8, 16};
  return {16, 8, 0};
}

PanelFigures figures_of(const Panel& p, double separation_m) {
  PanelFigures out;
  const double depth_m = optical_depth_m(p.lines),
               pitch_x_m = p.lines.pitch_m / std::cos(p.lines.tilt_deg * kPanelDegree);
  // At distance z from the pixels eyes that are e apart see a place's lines e * depth / z apart: half a pitch is best.
  out.best_distance_m = separation_m * depth_m / (0.5 * pitch_x_m);
  out.repeat_m = pitch_x_m * p.distance_m / depth_m;
  out.pixels_a_line = pitch_x_m / p.pixel_m;
  const Eyes eyes = eyes_before(p, separation_m, p.distance_m);
  const SeenShares shares = seen_shares(p, eyes);
  out.crosstalk = shares.crosstalk;
  out.dark = shares.dark;
  return out;
}

}  // namespace telesplat::stereo
