#include "common/colour/spaces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace telesplat::colour {
namespace {

using std::numbers::pi;

Rgb mix(const Rgb& a, const Rgb& b, double t) {
  return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

// CIE L*a*b* of the white point D65.
constexpr Rgb kWhite = {0.9505, 1.0, 1.089};

Rgb lab_of(const Rgb& rgb) {
  Rgb c;
  for (int i = 0; i < 3; ++i) c[i] = rgb[i] > 0.04045 ? std::pow((rgb[i] + 0.055) / 1.055, 2.4) : rgb[i] / 12.92;
  const Rgb xyz = {0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2], 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2],
                   0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]};
  Rgb f;
  for (int i = 0; i < 3; ++i) {
    const double v = xyz[i] / kWhite[i];
    f[i] = v > 0.008856 ? std::cbrt(v) : 7.787 * v + 16.0 / 116;
  }
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

Rgb rgb_of_lab(const Rgb& lab) {
  const double y = (lab[0] + 16) / 116;
  const Rgb f = {lab[1] / 500 + y, y, y - lab[2] / 200};
  Rgb xyz;
  for (int i = 0; i < 3; ++i) {
    const double cube = f[i] * f[i] * f[i];
    xyz[i] = kWhite[i] * (cube > 0.008856 ? cube : (f[i] - 16.0 / 116) / 7.787);
  }
  Rgb c = {3.2406 * xyz[0] - 1.5372 * xyz[1] - 0.4986 * xyz[2], -0.9689 * xyz[0] + 1.8758 * xyz[1] + 0.0415 * xyz[2],
           0.0557 * xyz[0] - 0.2040 * xyz[1] + 1.0570 * xyz[2]};
  for (double& v : c) v = v > 0.0031308 ? 1.055 * std::pow(v, 1 / 2.4) - 0.055 : 12.92 * v;
  const double most = std::max({c[0], c[1], c[2], 1.0});  // as in VTK: too bright colours keep their hue
  for (double& v : c) v = std::max(0.0, v / most);
  return c;
}

Rgb hsv_of(const Rgb& c) {
  const double most = std::max({c[0], c[1], c[2]}), least = std::min({c[0], c[1], c[2]}), d = most - least;
  if (d <= 0) return {0, 0, most};
  double h = most == c[0] ? (c[1] - c[2]) / d : most == c[1] ? 2 + (c[2] - c[0]) / d : 4 + (c[0] - c[1]) / d;
  if (h < 0) h += 6;
  return {h / 6, d / most, most};
}

Rgb rgb_of_hsv(const Rgb& hsv) {
  const auto channel = [&](double n) {
    const double k = std::fmod(n + hsv[0] * 6, 6);
    return hsv[2] - hsv[2] * hsv[1] * std::max(0.0, std::min({k, 4 - k, 1.0}));
  };
  return {channel(5), channel(3), channel(1)};
}

Rgb between_hues(Rgb a, Rgb b, double t, bool wrap) {
  a = hsv_of(a);
  b = hsv_of(b);
  if (wrap && std::abs(a[0] - b[0]) > 0.5) (a[0] < b[0] ? a : b)[0] += 1;
  Rgb c = mix(a, b, t);
  if (c[0] >= 1) c[0] -= 1;
  return rgb_of_hsv(c);
}

// Moreland, "Diverging Color Maps for Scientific Visualization", ISVC 2009: Msh are polar coordinates of L*a*b*.
struct Msh {
  double m = 0, s = 0, h = 0;
};

Msh msh_of(const Rgb& rgb) {
  const Rgb lab = lab_of(rgb);
  Msh out;
  out.m = std::hypot(lab[0], lab[1], lab[2]);
  if (out.m > 0.001) out.s = std::acos(std::min(1.0, lab[0] / out.m));
  if (out.s > 0.001) out.h = std::atan2(lab[2], lab[1]);
  return out;
}

// Hue at the unsaturated end that makes the path from a saturated colour look straight.
double hue_for(const Msh& saturated, double unsaturated_m) {
  if (saturated.m >= unsaturated_m - 0.1) return saturated.h;
  const double m = saturated.m;
  const double spin = saturated.s * std::sqrt(unsaturated_m * unsaturated_m - m * m) / (m * std::sin(saturated.s));
  return saturated.h > -pi / 3 ? saturated.h + spin : saturated.h - spin;
}

Rgb between_diverging(const Rgb& from, const Rgb& to, double t) {
  Msh a = msh_of(from), b = msh_of(to);
  double angle = std::abs(a.h - b.h);
  angle = std::min(angle, 2 * pi - angle);
  if (a.s > 0.05 && b.s > 0.05 && angle > pi / 3) {
    const Msh middle{std::max({a.m, b.m, 88.0}), 0, 0};
    if (t < 0.5)
      b = middle, t = 2 * t;
    else
      a = middle, t = 2 * t - 1;
  }
  if (a.s < 0.05 && b.s > 0.05)
    a.h = hue_for(b, a.m);
  else if (b.s < 0.05 && a.s > 0.05)
    b.h = hue_for(a, b.m);
  const double m = a.m + (b.m - a.m) * t, s = a.s + (b.s - a.s) * t, h = a.h + (b.h - a.h) * t;
  return rgb_of_lab({m * std::cos(s), m * std::sin(s) * std::cos(h), m * std::sin(s) * std::sin(h)});
}

}  // namespace

std::optional<Space> space_of(std::string_view word) {
  constexpr std::pair<std::string_view, Space> kWords[] = {
      {"RGB", Space::kRgb},    {"HSV", Space::kHsv},           {"HSVNoWrap", Space::kHsvNoWrap}, {"Lab", Space::kLab},
      {"CIELAB", Space::kLab}, {"Lab/CIEDE2000", Space::kLab}, {"Diverging", Space::kDiverging}, {"Step", Space::kStep},
  };
  for (const auto& [name, space] : kWords)
    if (name == word) return space;
  return std::nullopt;
}

Rgb between(Space space, const Rgb& a, const Rgb& b, double t) {
  switch (space) {
    case Space::kRgb:
      return mix(a, b, t);
    case Space::kHsv:
      return between_hues(a, b, t, true);
    case Space::kHsvNoWrap:
      return between_hues(a, b, t, false);
    case Space::kLab:
      return rgb_of_lab(mix(lab_of(a), lab_of(b), t));
    case Space::kDiverging:
      return between_diverging(a, b, t);
    case Space::kStep:
      return t < 1 ? a : b;
  }
  return a;
}

}  // namespace telesplat::colour
