#include "common/colour/paraview_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/colour/spaces.h"
#include "common/core/nearest.h"
#include "common/core/whole_file.h"

namespace telesplat::colour {
namespace {

using Json = nlohmann::json;

constexpr size_t kMaxFileBytes = 4u << 20;
constexpr size_t kMaxPoints = 1u << 14;  // in a file; maps are shortened before they are sent
constexpr int kMaxDepth = 16;
constexpr int kPieces = 16;  // straight pieces between two points, for spaces other than RGB

// The numbers of an array; nothing if it is no array of numbers.
std::optional<std::vector<double>> numbers(const Json& array) {
  if (!array.is_array()) return std::nullopt;
  std::vector<double> out;
  for (const Json& n : array) {
    if (!n.is_number()) return std::nullopt;
    out.push_back(n.get<double>());
    if (!std::isfinite(out.back()) || std::abs(out.back()) > kMaxMapValue) return std::nullopt;
  }
  return out;
}

Result<std::vector<double>> read_points(const Json& map, const char* key, const std::string& path) {
  const auto found = map.find(key);
  if (found == map.end()) return std::vector<double>{};
  auto out = numbers(*found);
  if (!out || out->empty() || out->size() % 4 != 0 || out->size() / 4 > kMaxPoints)
    return Error{
        fmt::format("{}: \"{}\" is no list of four numbers a point, at most {} points", path, key, kMaxPoints)};
  for (size_t n = 4; n < out->size(); n += 4)
    if ((*out)[n] < (*out)[n - 4])
      return Error{
          fmt::format("{}: \"{}\" has the value {} after {}; values ascend", path, key, (*out)[n], (*out)[n - 4])};
  return std::move(*out);
}

std::string name_of(const Json& map) {
  const auto found = map.is_object() ? map.find("Name") : map.end();
  if (!map.is_object() || found == map.end() || !found->is_string()) return {};
  return found->get<std::string>();
}

uint32_t code(const ParaviewMap::Colour& c) {
  uint32_t rgb = 0;
  for (const double v : {c.r, c.g, c.b}) rgb = rgb << 8 | uint32_t(std::clamp(v, 0.0, 1.0) * 255 + 0.5);
  return rgb;
}

Result<const Json*> choose(const Json& file, const std::string& path, std::string_view wanted) {
  if (wanted.empty()) return file.is_array() && !file.empty() ? &file.front() : &file;
  std::vector<std::string> names;
  const auto fits = [&](const Json& map) {
    names.push_back(name_of(map));
    return names.back() == wanted;
  };
  if (file.is_array()) {
    for (const Json& map : file)
      if (fits(map)) return &map;
  } else if (fits(file)) {
    return &file;
  }
  const std::vector<std::string_view> candidates(names.begin(), names.end());
  const auto nearest = nearest_word(wanted, candidates);
  return Error{
      fmt::format("{}: none of its {} colour maps is called \"{}\"{}", path, names.size(), wanted.substr(0, 80),
                  nearest && !nearest->empty() ? fmt::format(", did you mean \"{}\"?", nearest->substr(0, 80)) : "")};
}

Result<Space> read_space(const Json& map, const std::string& path) {
  const auto found = map.find("ColorSpace");
  if (found == map.end()) return Space::kRgb;
  const auto space = found->is_string() ? space_of(found->get<std::string>()) : std::nullopt;
  if (!space)
    return Error{fmt::format("{}: unknown \"ColorSpace\" {:.80}; known are RGB, HSV, Lab, Diverging and Step", path,
                             found->dump(-1, ' ', true, Json::error_handler_t::replace))};
  return *space;
}

// Converts points to straight pieces in RGB.
std::vector<ParaviewMap::Colour> straightened(const std::vector<ParaviewMap::Colour>& points, Space space) {
  if (space == Space::kRgb) return points;
  std::vector<ParaviewMap::Colour> out;
  const int pieces = points.size() > kMaxPoints / kPieces ? 1 : kPieces;  // more points lie close enough
  for (size_t n = 0; n < points.size(); ++n) {
    out.push_back(points[n]);
    if (n + 1 == points.size()) break;
    const auto &a = points[n], &b = points[n + 1];
    if (space == Space::kStep) out.push_back({b.value, a.r, a.g, a.b});
    for (int piece = 1; space != Space::kStep && piece < pieces; ++piece) {
      const double t = double(piece) / pieces;
      const Rgb c = between(space, {a.r, a.g, a.b}, {b.r, b.g, b.b}, t);
      out.push_back({a.value + (b.value - a.value) * t, c[0], c[1], c[2]});
    }
  }
  return out;
}

// The most important stops: the ends first, then always the one farthest from the line between those kept.
std::vector<ColourMap::Stop> most_important(const std::vector<ColourMap::Stop>& stops) {
  if (stops.size() <= kMaxStops) return stops;
  struct Piece {
    size_t begin, end, farthest;
    double off;
  };
  std::vector<Piece> pieces;
  const auto add = [&](size_t begin, size_t end) {
    const ColourMap line{"", {stops[begin], stops[end]}};
    Piece piece{begin, end, begin, -1};
    for (size_t n = begin + 1; n < end; ++n) {
      const uint32_t a = line.at(stops[n].x), b = stops[n].rgb;
      double off = 0;
      for (const int shift : {16, 8, 0}) off = std::max(off, std::abs(double(a >> shift & 255) - (b >> shift & 255)));
      if (off > piece.off) piece.off = off, piece.farthest = n;
    }
    if (piece.off > 0) pieces.push_back(piece);
  };
  std::vector<size_t> kept{0, stops.size() - 1};
  add(0, stops.size() - 1);
  while (!pieces.empty() && kept.size() < kMaxStops) {
    const auto worst =
        std::max_element(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) { return a.off < b.off; });
    const Piece piece = *worst;
    pieces.erase(worst);
    kept.push_back(piece.farthest);
    add(piece.begin, piece.farthest);
    add(piece.farthest, piece.end);
  }
  std::sort(kept.begin(), kept.end());
  std::vector<ColourMap::Stop> out;
  for (const size_t n : kept) out.push_back(stops[n]);
  return out;
}

Status check_limits(const ParaviewMap& map, const std::string& path) {
  for (const auto& c : map.colours)
    for (const double v : {c.r, c.g, c.b})
      if (v < 0 || v > 1) return Error{fmt::format("{}: \"RGBPoints\" has a colour of {}, limits are 0..1", path, v)};
  for (const auto& o : map.opacity)
    if (o.opacity < 0 || o.opacity > 1)
      return Error{fmt::format("{}: \"Points\" has an opacity of {}, limits are 0..1", path, o.opacity)};
  return ok_status();
}

Result<ParaviewMap> read_map(const Json& map, const std::string& path) {
  if (!map.is_object() || !map.contains("RGBPoints"))
    return Error{fmt::format("{}: no colour map of ParaView, which would have \"RGBPoints\"", path)};
  if (const auto indexed = map.find("IndexedColors"); indexed != map.end() && indexed->is_array() && !indexed->empty())
    return Error{fmt::format("{}: a map of categories (\"IndexedColors\"), not of values", path)};
  const auto rgb = read_points(map, "RGBPoints", path);
  if (!rgb) return rgb.error();
  if (rgb->empty()) return Error{fmt::format("{}: \"RGBPoints\" is empty", path)};
  const auto raw = read_points(map, "Points", path);
  if (!raw) return raw.error();
  const auto space = read_space(map, path);
  if (!space) return space.error();

  ParaviewMap out{name_of(map), {}, {}, {}};
  for (size_t n = 0; n < rgb->size(); n += 4)
    out.colours.push_back({(*rgb)[n], (*rgb)[n + 1], (*rgb)[n + 2], (*rgb)[n + 3]});
  for (size_t n = 0; n < raw->size(); n += 4)
    out.opacity.push_back(
        {(*raw)[n], (*raw)[n + 1], std::clamp((*raw)[n + 2], 1e-5, 1 - 1e-5), std::clamp((*raw)[n + 3], 0.0, 1.0)});
  if (const Status limits = check_limits(out, path); !limits) return limits.error();
  out.colours = straightened(out.colours, *space);
  if (const auto found = map.find("NanColor"); found != map.end())
    if (const auto c = numbers(*found); c && c->size() == 3) out.missing = code({0, (*c)[0], (*c)[1], (*c)[2]});
  return out;
}

}  // namespace

Result<std::string> read_map_file(const std::string& path) { return read_whole(path, kMaxFileBytes); }

Result<ParaviewMap> parse_paraview_map(std::string_view content, const std::string& path, std::string_view wanted) {
  int deepest = 0;
  const auto watch_depth = [&](int depth, Json::parse_event_t, Json&) {
    deepest = std::max(deepest, depth);
    return depth <= kMaxDepth;
  };
  const Json file = Json::parse(content, watch_depth, false);
  if (file.is_discarded() || deepest > kMaxDepth)
    return Error{fmt::format("{}: not JSON, or nested deeper than {}", path, kMaxDepth)};
  const auto map = choose(file, path, wanted);
  return map ? read_map(**map, path) : map.error();
}

Result<ColourMap> parse_colour_map(std::string_view content, const std::string& path, std::string_view wanted) {
  const auto map = parse_paraview_map(content, path, wanted);
  if (!map) return map.error();
  ColourMap out;
  for (const char c : map->name.empty() ? std::string_view("map") : std::string_view(map->name).substr(0, kMaxMapName))
    out.name += uint8_t(c) < 0x20 || uint8_t(c) >= 0x7f || c == '=' ? '?' : c;
  const double lo = map->colours.front().value, hi = map->colours.back().value;
  for (const auto& c : map->colours)
    out.stops.push_back({hi > lo ? std::clamp((c.value - lo) / (hi - lo), 0.0, 1.0) : 0.0, code(c)});
  // Keeps texts short: a millionth is finer than a pixel in any picture's colour bar.
  for (auto& stop : out.stops) stop.x = std::round(stop.x * 1e6) / 1e6;
  out.stops = most_important(out.stops);
  if (map->missing) out.missing = *map->missing;
  if (const Status valid = validate(out); !valid) return Error{path + ": " + valid.error().text};
  return out;
}

}  // namespace telesplat::colour
