// ParaView's colour maps as it exports them (vtkPVTransferFunction presets): a list of maps, each with "RGBPoints"
// (value, r, g, b a point) and, sometimes, "Points" (value, opacity, midpoint, sharpness a point).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/volume/transfer/text.h"

namespace telesplat::volume {
namespace {

using Json = nlohmann::json;

constexpr size_t kMaxPoints = 1u << 14;  // in a file; what travels is shortened afterwards
constexpr int kMaxDepth = 16;

struct Opacity {
  double value, opacity, midpoint, sharpness;
};
struct Colour {
  double value, r, g, b;
};

// The numbers of an array of them; nothing if it is none.
std::optional<std::vector<double>> numbers(const Json& array) {
  if (!array.is_array()) return std::nullopt;
  std::vector<double> out;
  for (const Json& n : array) {
    if (!n.is_number()) return std::nullopt;
    out.push_back(n.get<double>());
    if (!std::isfinite(out.back()) || std::abs(out.back()) > kMaxTransferValue) return std::nullopt;
  }
  return out;
}

Result<std::vector<double>> read_points(const Json& map, const char* key, const std::string& name) {
  const auto found = map.find(key);
  if (found == map.end()) return std::vector<double>{};
  auto out = numbers(*found);
  if (!out || out->empty() || out->size() % 4 != 0 || out->size() / 4 > kMaxPoints)
    return Error{
        fmt::format("{}: \"{}\" is no list of four numbers a point, at most {} points", name, key, kMaxPoints)};
  for (size_t n = 4; n < out->size(); n += 4)
    if ((*out)[n] < (*out)[n - 4])
      return Error{
          fmt::format("{}: \"{}\" has the value {} after {}; values ascend", name, key, (*out)[n], (*out)[n - 4])};
  return std::move(*out);
}

// vtkPiecewiseFunction between two points: the midpoint is where it is half way; sharpness 0 is linear, 1 a step at the
// midpoint. Between 0.01 and 0.99 VTK draws a Hermite curve through a position that the sharpness bends.
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

// As straight pieces.
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

// Colours and opacities at all values that one of them has a point at; jumps of either stay jumps.
TransferFunction joined(const std::vector<Colour>& colours, const std::vector<Opacity>& opacities) {
  TransferFunction colour, opacity;
  for (const auto& c : colours) colour.points.push_back({c.value, float(c.r), float(c.g), float(c.b), 0});
  for (const auto& o : opacities) opacity.points.push_back({o.value, 0, 0, 0, float(o.opacity)});
  std::vector<double> values;
  for (const auto& p : colour.points) values.push_back(p.value);
  for (const auto& p : opacity.points) values.push_back(p.value);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());

  // Just below a value a jump has its first point's colour or opacity.
  const auto below = [](const TransferFunction& f, double value) {
    const auto at =
        std::lower_bound(f.points.begin(), f.points.end(), value, [](const auto& p, double v) { return p.value < v; });
    return at != f.points.end() && at->value == value ? *at : f.at(value);
  };
  TransferFunction out;
  const auto add = [&](double value, const TransferFunction::Point& c, const TransferFunction::Point& o) {
    // 8 bits a channel: colours were chosen on screens, and the text stays short.
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

Result<TransferFunction> parse_paraview_json(std::string_view content, const std::string& name,
                                             const ValueRange& range) {
  int deepest = 0;
  const auto watch_depth = [&](int depth, Json::parse_event_t, Json&) {
    deepest = std::max(deepest, depth);
    return depth <= kMaxDepth;
  };
  const Json file = Json::parse(content, watch_depth, false);
  if (file.is_discarded() || deepest > kMaxDepth)
    return Error{fmt::format("{}: not JSON, or nested deeper than {}", name, kMaxDepth)};
  const Json& map = file.is_array() && !file.empty() ? file.front() : file;
  if (!map.is_object() || !map.contains("RGBPoints"))
    return Error{fmt::format("{}: no colour map of ParaView, which would have \"RGBPoints\"", name)};
  if (const auto indexed = map.find("IndexedColors"); indexed != map.end() && indexed->is_array() && !indexed->empty())
    return Error{fmt::format("{}: a map of categories (\"IndexedColors\"), not of values", name)};

  const auto rgb = read_points(map, "RGBPoints", name);
  if (!rgb) return rgb.error();
  if (rgb->empty()) return Error{fmt::format("{}: \"RGBPoints\" is empty", name)};
  const auto raw = read_points(map, "Points", name);
  if (!raw) return raw.error();

  std::vector<Colour> colours;
  for (size_t n = 0; n < rgb->size(); n += 4)
    colours.push_back({(*rgb)[n], (*rgb)[n + 1], (*rgb)[n + 2], (*rgb)[n + 3]});
  std::vector<Opacity> opacities;
  for (size_t n = 0; n < raw->size(); n += 4)
    opacities.push_back(
        {(*raw)[n], (*raw)[n + 1], std::clamp((*raw)[n + 2], 1e-5, 1 - 1e-5), std::clamp((*raw)[n + 3], 0.0, 1.0)});
  for (const Colour& c : colours)
    for (const double v : {c.r, c.g, c.b})
      if (v < 0 || v > 1) return Error{fmt::format("{}: \"RGBPoints\" has a colour of {}, limits are 0..1", name, v)};
  for (const Opacity& o : opacities)
    if (o.opacity < 0 || o.opacity > 1)
      return Error{fmt::format("{}: \"Points\" has an opacity of {}, limits are 0..1", name, o.opacity)};

  // A map from 0 to 1 (or -1 to 1, as older ones of ParaView have it) is one for any range.
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

}  // namespace telesplat::volume
