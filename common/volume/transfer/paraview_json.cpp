// ParaView's colour maps as transfer functions: common/colour reads the file; opacities become piecewise linear here.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/colour/paraview_json.h"
#include "common/volume/transfer/function.h"

namespace telesplat::volume {
namespace {

using Colour = colour::ParaviewMap::Colour;
using Opacity = colour::ParaviewMap::Opacity;

// vtkPiecewiseFunction between two points: half way at the midpoint; sharpness 0 is linear, 1 a step at the midpoint.
// Between 0.01 and 0.99 VTK draws a Hermite curve through a position that the sharpness bends.
double between(const Opacity& a, const Opacity& b, double s) {
  s = s < a.midpoint ? 0.5 * s / a.midpoint : 0.5 + 0.5 * (s - a.midpoint) / (1 - a.midpoint);
  if (a.sharpness > 0.99) return s < 0.5 ? a.opacity : b.opacity;
  if (a.sharpness < 0.01) return a.opacity + (b.opacity - a.opacity) * s;
  const double bend = 1 + 10 * a.sharpness;
  s = s < 0.5 ? 0.5 * std::pow(s * 2, bend) : 1 - 0.5 * std::pow((1 - s) * 2, bend);
  const double ss = s * s, sss = ss * s;
  const double rise = b.opacity - a.opacity, slope = (1 - a.sharpness) * rise;
  const double opacity = (2 * sss - 3 * ss + 1) * a.opacity + (3 * ss - 2 * sss) * b.opacity +
                         (sss - 2 * ss + s) * slope + (sss - ss) * slope;
  return std::clamp(opacity, std::min(a.opacity, b.opacity), std::max(a.opacity, b.opacity));
}

// Approximates the curves by straight pieces.
std::vector<Opacity> straightened(const std::vector<Opacity>& points) {
  std::vector<Opacity> out;
  for (size_t n = 0; n < points.size(); ++n) {
    out.push_back(points[n]);
    if (n + 1 == points.size()) break;
    const Opacity &a = points[n], &b = points[n + 1];
    const auto add = [&](double s, double opacity) {
      out.push_back({a.value + (b.value - a.value) * s, opacity, 0.5, 0});
    };
    if (a.sharpness > 0.99) {
      add(a.midpoint, a.opacity);
      add(a.midpoint, b.opacity);
    } else if (a.sharpness >= 0.01) {
      for (int piece = 1; piece < 8; ++piece) add(piece / 8.0, between(a, b, piece / 8.0));
    } else if (a.midpoint != 0.5) {
      add(a.midpoint, (a.opacity + b.opacity) / 2);
    }
  }
  return out;
}

// Combines colours and opacities at all values at which either has a point; jumps of either stay jumps.
TransferFunction joined(const std::vector<Colour>& colours, const std::vector<Opacity>& opacities) {
  TransferFunction colour, opacity;
  for (const auto& c : colours) colour.points.push_back({c.value, float(c.r), float(c.g), float(c.b), 0});
  for (const auto& o : opacities) opacity.points.push_back({o.value, 0, 0, 0, float(o.opacity)});
  std::vector<double> values;
  for (const auto& p : colour.points) values.push_back(p.value);
  for (const auto& p : opacity.points) values.push_back(p.value);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());

  // Returns the colour or opacity just below a value: at a jump, that of its first point.
  const auto below = [](const TransferFunction& f, double value) {
    const auto at =
        std::lower_bound(f.points.begin(), f.points.end(), value, [](const auto& p, double v) { return p.value < v; });
    return at != f.points.end() && at->value == value ? *at : f.at(value);
  };
  TransferFunction out;
  const auto add = [&](double value, const TransferFunction::Point& c, const TransferFunction::Point& o) {
    // Rounds to 8 bits a channel: colours were chosen on screens, and the text stays short.
    const auto round = [](float v) { return std::floor(std::clamp(v, 0.0f, 1.0f) * 255 + 0.5f) / 255.0f; };
    const float opaque = float(std::floor(double(std::clamp(o.opacity, 0.0f, 1.0f)) * 1e5 + 0.5) / 1e5);
    const TransferFunction::Point p{value, round(c.r), round(c.g), round(c.b), opaque};
    if (out.points.empty() || !(out.points.back() == p)) out.points.push_back(p);
  };
  for (const double value : values) {
    add(value, below(colour, value), below(opacity, value));
    add(value, colour.at(value), opacity.at(value));
  }
  return out;
}

}  // namespace

Result<TransferFunction> parse_paraview_json(std::string_view content, const std::string& name, const ValueRange& range,
                                             std::string_view wanted) {
  auto map = colour::parse_paraview_map(content, name, wanted);
  if (!map) return map.error();
  std::vector<Colour>& colours = map->colours;
  std::vector<Opacity>& opacities = map->opacity;

  // A map from 0 to 1 (or -1 to 1, as in older ParaView) fits any range.
  const double lo = colours.front().value, hi = colours.back().value;
  const bool normalised = (lo == 0 || lo == -1) && hi == 1 && range.hi - range.lo > 2;
  const auto placed = [&](double v) {
    return normalised ? range.lo + (v - lo) / (hi - lo) * (range.hi - range.lo) : v;
  };
  for (Colour& c : colours) c.value = placed(c.value);
  for (Opacity& o : opacities) o.value = placed(o.value);
  if (opacities.empty()) opacities = {{colours.front().value, 0, 0.5, 0}, {colours.back().value, 1, 0.5, 0}};

  TransferFunction out = shortened(joined(colours, straightened(opacities)), kMaxTransferText);
  if (const Status valid = validate(out); !valid) return Error{name + ": " + valid.error().text};
  return out;
}

std::string to_paraview_json(const TransferFunction& transfer, std::string_view name) {
  std::string quoted;
  for (const char c : name)
    if (c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ') quoted += c;
  std::string colours, opacities;
  for (const auto& p : transfer.points) {
    const char* comma = colours.empty() ? "" : ",";
    colours += fmt::format("{}\n      {}, {}, {}, {}", comma, p.value, p.r, p.g, p.b);
    opacities += fmt::format("{}\n      {}, {}, 0.5, 0.0", comma, p.value, p.opacity);
  }
  return fmt::format(
      "[\n  {{\n    \"ColorSpace\": \"RGB\",\n    \"Name\": \"{}\",\n    \"Points\": [{}\n    ],\n    \"RGBPoints\": "
      "[{}\n    ]\n  }}\n]\n",
      quoted, opacities, colours);
}

}  // namespace telesplat::volume
