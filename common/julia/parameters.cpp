#include "common/julia/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

namespace telesplat::julia {
namespace {

constexpr std::string_view kPalettes[] = {"ember", "ocean", "forest", "spectrum", "ivory", "dusk", "copper", "ice"};
constexpr std::string_view kColours[] = {"distance", "trap", "trap-plane"};

constexpr ParameterInfo kInfos[] = {
    {"c.x", -4, 4, false, true, "i part of the constant c"},
    {"c.y", -4, 4, false, true, "j part of the constant c"},
    {"c.z", -4, 4, false, true, "k part of the constant c"},
    {"c.w", -4, 4, false, true, "real part of the constant c"},
    {"slice.offset", -4, 4, false, true, "distance of the slice from 0 along its normal"},
    {"slice.turn-x", -360, 360, false, true, "turn of the slice in the plane (1, k), degrees"},
    {"slice.turn-y", -360, 360, false, true, "turn of the slice in the plane (i, k), degrees"},
    {"slice.turn-z", -360, 360, false, true, "turn of the slice in the plane (j, k), degrees"},
    {"iterations", 1, 4096, true, true, "iterations after which an orbit counts as inside"},
    {"bailout", 2, 1e6, false, true, "|q| beyond which an orbit has escaped"},
    {"lod", 0.05, 16, false, true, "pixel footprints from the set at which its surface is"},
    {"bound", 0, 8, false, false, "half side of the cube that is shown; 0: the set's own box"},
    {"colour", 0, double(std::size(kColours) - 1), true, true, "what a point's colour is made from"},
    {"palette", 0, double(std::size(kPalettes) - 1), true, true, "palette"},
    {"colour.scale", 0.01, 100, false, true, "runs through the palette from 0 to the set's radius"},
    {"colour.shift", -100, 100, false, true, "where in the palette 0 lies"},
    {"ambient", 0, 1, false, true, "strength of the ambient occlusion"},
    {"shadow", 0, 1, false, true, "strength of the soft shadow"},
};

struct Access {
  double (*get)(const Parameters&);
  void (*set)(Parameters&, double);
};
constexpr Access kAccess[] = {
    {[](const Parameters& p) { return p.c.x; }, [](Parameters& p, double v) { p.c.x = v; }},
    {[](const Parameters& p) { return p.c.y; }, [](Parameters& p, double v) { p.c.y = v; }},
    {[](const Parameters& p) { return p.c.z; }, [](Parameters& p, double v) { p.c.z = v; }},
    {[](const Parameters& p) { return p.c.w; }, [](Parameters& p, double v) { p.c.w = v; }},
    {[](const Parameters& p) { return p.slice_offset; }, [](Parameters& p, double v) { p.slice_offset = v; }},
    {[](const Parameters& p) { return p.slice_turn_deg.x; }, [](Parameters& p, double v) { p.slice_turn_deg.x = v; }},
    {[](const Parameters& p) { return p.slice_turn_deg.y; }, [](Parameters& p, double v) { p.slice_turn_deg.y = v; }},
    {[](const Parameters& p) { return p.slice_turn_deg.z; }, [](Parameters& p, double v) { p.slice_turn_deg.z = v; }},
    {[](const Parameters& p) { return double(p.iterations); }, [](Parameters& p, double v) { p.iterations = int(v); }},
    {[](const Parameters& p) { return p.bailout; }, [](Parameters& p, double v) { p.bailout = v; }},
    {[](const Parameters& p) { return p.lod; }, [](Parameters& p, double v) { p.lod = v; }},
    {[](const Parameters& p) { return p.bound; }, [](Parameters& p, double v) { p.bound = v; }},
    {[](const Parameters& p) { return double(p.colour); }, [](Parameters& p, double v) { p.colour = Colour(int(v)); }},
    {[](const Parameters& p) { return double(p.palette); }, [](Parameters& p, double v) { p.palette = int(v); }},
    {[](const Parameters& p) { return p.colour_scale; }, [](Parameters& p, double v) { p.colour_scale = v; }},
    {[](const Parameters& p) { return p.colour_shift; }, [](Parameters& p, double v) { p.colour_shift = v; }},
    {[](const Parameters& p) { return p.ambient; }, [](Parameters& p, double v) { p.ambient = v; }},
    {[](const Parameters& p) { return p.shadow; }, [](Parameters& p, double v) { p.shadow = v; }},
};
static_assert(std::size(kInfos) == std::size(kAccess));

// Index of the name; std::size(kInfos) if it is unknown.
size_t index_of(std::string_view name) {
  return size_t(std::find_if(std::begin(kInfos), std::end(kInfos), [&](const auto& i) { return i.name == name; }) -
                std::begin(kInfos));
}

Status check_value(const ParameterInfo& info, double value) {
  if (!(value >= info.least && value <= info.most))  // false for NaN, too
    return Error{fmt::format("{} is {}, limits are {}..{}", info.name, value, info.least, info.most)};
  if (info.whole && value != std::floor(value))
    return Error{fmt::format("{} is {}, but takes whole numbers {}..{}", info.name, value, info.least, info.most)};
  return ok_status();
}

constexpr const char* kPlacementNames[] = {"room.x", "room.y", "room.z", "room.scale"};

}  // namespace

std::span<const ParameterInfo> parameter_infos() { return kInfos; }
std::span<const std::string_view> palette_names() { return kPalettes; }
std::span<const std::string_view> colour_names() { return kColours; }

Status set(Parameters& parameters, std::string_view name, double value) {
  const size_t i = index_of(name);
  if (i == std::size(kInfos)) {
    std::string names;
    for (const auto& info : kInfos) names += fmt::format("{}{}", names.empty() ? "" : ", ", info.name);
    return Error{fmt::format("{}: no parameter of a Julia set; there are {}", name.substr(0, 64), names)};
  }
  if (const Status s = check_value(kInfos[i], value); !s) return s;
  kAccess[i].set(parameters, value);
  return ok_status();
}

double get(const Parameters& parameters, std::string_view name) {
  const size_t i = index_of(name);
  CHECK(i < std::size(kInfos));
  return kAccess[i].get(parameters);
}

std::map<std::string, double> to_map(const Parameters& parameters) {
  std::map<std::string, double> out;
  for (size_t i = 0; i < std::size(kInfos); ++i) out.emplace(kInfos[i].name, kAccess[i].get(parameters));
  return out;
}

Result<Parameters> from_map(const std::map<std::string, double>& values) {
  Parameters out;
  for (const auto& [name, value] : values) {
    if (index_of(name) == std::size(kInfos)) continue;
    if (const Status s = set(out, name, value); !s) return s.error();
  }
  return out;
}

Status validate(const Parameters& parameters) {
  for (size_t i = 0; i < std::size(kInfos); ++i)
    if (const Status s = check_value(kInfos[i], kAccess[i].get(parameters)); !s) return s;
  const double r = radius(parameters.c);
  if (std::abs(parameters.slice_offset) > r)
    return Error{fmt::format("slice.offset is {}, but with this c the set ends at {:.4g} from 0: the slice is empty",
                             parameters.slice_offset, r)};
  if (parameters.bailout < r)
    return Error{fmt::format("bailout is {}, but with this c the set may reach to {:.4g}, the least bailout here",
                             parameters.bailout, r)};
  return ok_status();
}

Slice slice(const Parameters& parameters) {
  // Without turns X is the real axis, Y is i, Z is j, and k is the normal. A turn in the plane (a, k) takes a towards k
  // and k towards -a.
  const auto turned = [&](glm::dvec4 v) {
    const int axes[] = {3, 0, 1};
    for (int turn = 0; turn < 3; ++turn) {
      const double angle = glm::radians(parameters.slice_turn_deg[turn]), cos = std::cos(angle), sin = std::sin(angle);
      const double a = v[axes[turn]], k = v.z;
      v[axes[turn]] = cos * a - sin * k;
      v.z = sin * a + cos * k;
    }
    return v;
  };
  return {parameters.slice_offset * turned({0, 0, 1, 0}),
          {turned({0, 0, 0, 1}), turned({1, 0, 0, 0}), turned({0, 1, 0, 0})}};
}

std::map<std::string, double> to_map(const Placement& p) {
  return {{kPlacementNames[0], p.centre.x},
          {kPlacementNames[1], p.centre.y},
          {kPlacementNames[2], p.centre.z},
          {kPlacementNames[3], p.scale}};
}

Result<Placement> placement_from_map(const std::map<std::string, double>& values, const geometry::Box& box_room) {
  double v[4];
  for (int i = 0; i < 4; ++i) {
    const auto found = values.find(kPlacementNames[i]);
    if (found == values.end()) return Error{fmt::format("{} is missing", kPlacementNames[i])};
    v[i] = found->second;
    if (!std::isfinite(v[i])) return Error{fmt::format("{} is {}, not a finite number", kPlacementNames[i], v[i])};
  }
  if (!(v[3] > 0)) return Error{fmt::format("{} is {}, it must be above 0", kPlacementNames[3], v[3])};
  return Placement{{v[0], v[1], v[2]}, v[3], box_room};
}

}  // namespace telesplat::julia
