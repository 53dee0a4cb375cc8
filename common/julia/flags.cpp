#include "common/julia/flags.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <glm/glm.hpp>

namespace telesplat::julia {
namespace {

template <class Names>
std::string joined(const Names& names) {
  std::string out;
  for (const auto& n : names) out += fmt::format("{}{}", out.empty() ? "" : ", ", n);
  return out;
}

// Also reads "nan" and "inf", so that the parameter's own limits refuse them.
Result<double> read_number(std::string_view name, const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end) return Error{fmt::format("{} is \"{}\", not a number", name, text.substr(0, 40))};
  return value;
}

// "i,j,k,real"
Status read_constant(const std::string& text, Parameters& p) {
  const char* names[] = {"c.x", "c.y", "c.z", "c.w"};
  size_t begin = 0;
  for (int i = 0; i < 4; ++i) {
    const size_t comma = text.find(',', begin);
    if ((comma == std::string::npos) != (i == 3))
      return Error{fmt::format("c is \"{}\", not four numbers i,j,k,real", text.substr(0, 80))};
    const auto value = read_number(names[i], text.substr(begin, comma - begin));
    if (!value) return value.error();
    if (const Status s = set(p, names[i], *value); !s) return s;
    begin = comma + 1;
  }
  return ok_status();
}

// Names the parameter that makes a slice empty: one without which it has points, else the constant. at: when.
std::string why_empty(const Parameters& p, const std::string& at) {
  Parameters other = p;
  other.bound = 0;
  if (p.bound > 0 && !bounds(other).empty())
    return fmt::format("bound is {}: the cube of that size{} holds no point of the set", p.bound, at);
  other.slice_offset = 0;
  if (p.slice_offset != 0 && !bounds(other).empty())
    return fmt::format("slice.offset is {}: the slice{} holds no point of the set", p.slice_offset, at);
  return fmt::format(
      "c is {},{},{},{}: the slice{} holds no point of the set, which is dust where |c| is much above 1, and here it "
      "is "
      "{:.3g}",
      p.c.x, p.c.y, p.c.z, p.c.w, at, glm::length(p.c));
}

// Help text: the parameter, its limits, and its value in the first preset.
std::string help_of(const ParameterInfo& info) {
  const Parameters& defaults = presets().front().parameters;
  std::string limits = fmt::format("{}..{}", info.least, info.most),
              usual = fmt::format("{}", get(defaults, info.name));
  if (info.name == "palette") limits = joined(palette_names()), usual = palette_names()[size_t(defaults.palette)];
  if (info.name == "colour") limits = joined(colour_names()), usual = colour_names()[size_t(defaults.colour)];
  const std::string text = fmt::format("{}: {}", info.text, limits);
  return info.name.starts_with("c.") ? text : fmt::format("{}; first preset: {}", text, usual);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> parameters_not_given() {
  std::vector<std::pair<std::string, std::string>> out;
  for (const auto& info : parameter_infos()) out.emplace_back(info.name, "");
  return out;
}

bool SceneOptions::any() const {
  return !preset.empty() || !c.empty() || !animate.empty() ||
         std::any_of(values.begin(), values.end(), [](const auto& v) { return !v.second.empty(); });
}

options::Table scene_table(SceneOptions& o) {
  std::vector<std::string_view> names;
  for (const auto& p : presets()) names.push_back(p.name);
  options::Table table{
      {.flag = "--preset", .value = &o.preset, .help = fmt::format("{}; default: {}", joined(names), names.front())},
      {.flag = "--c", .value = &o.c, .help = "the constant: i,j,k,real, each -4..4"},
      {.flag = "--animate",
       .value = &o.animate,
       .help = "parameters that change: NAME=FROM:TO:SECONDS (and back, over and over) or NAME=@0s:VALUE@5s:VALUE..., "
               "several with ; between them; off: nothing"},
  };
  for (size_t i = 0; i < o.values.size(); ++i)
    table.push_back(
        {.flag = "--" + o.values[i].first, .value = &o.values[i].second, .help = help_of(parameter_infos()[i])});
  for (options::Row& row : table) {
    row.fits = {telesplat::scene::Kind::kJulia};
    row.group = "Julia sets";
  }
  return table;
}

Result<double> read_value(std::string_view name, const std::string& text) {
  const auto names = name == "palette"  ? palette_names()
                     : name == "colour" ? colour_names()
                                        : std::span<const std::string_view>{};
  const auto found = std::find(names.begin(), names.end(), text);
  if (found != names.end()) return double(found - names.begin());
  auto value = read_number(name, text);
  if (!value && !names.empty())
    return Error{fmt::format("{} is \"{}\", not one of {}", name, text.substr(0, 40), joined(names))};
  return value;
}

Result<Scene> read_scene(const SceneOptions& o) {
  Scene out;
  const std::string preset = o.preset.empty() ? std::string(presets().front().name) : o.preset;
  const auto chosen = preset_named(preset);
  if (!chosen) return chosen.error();
  out.parameters = *chosen;
  out.title = fmt::format("{}{}", kSceneWord, o.c.empty() || !o.preset.empty() ? " (" + preset + ")" : "");
  if (!o.c.empty())
    if (const Status s = read_constant(o.c, out.parameters); !s) return s.error();
  for (const auto& [name, text] : o.values) {
    if (text.empty()) continue;
    const auto value = read_value(name, text);
    if (!value) return value.error();
    if (const Status s = set(out.parameters, name, *value); !s) return s.error();
  }
  if (const Status s = validate(out.parameters); !s) return s.error();
  if (o.animate.empty() || o.animate == "off") return out;
  auto timeline = parse_timeline(o.animate);
  if (!timeline) return timeline.error();
  out.timeline = std::move(*timeline);
  if (const size_t bytes = out.timeline.text().size(); bytes > kMaxAnimation)
    return Error{fmt::format("the animation is a text of {} bytes, limit {}", bytes, kMaxAnimation)};
  if (const Status s = validate(out.parameters, out.timeline); !s) return s.error();
  out.parameters = *parameters_at(out.parameters, out.timeline, 0);
  return out;
}

std::vector<std::string> to_flags(SceneOptions o) {
  SceneOptions none;
  return options::arguments(scene_table(o), scene_table(none));
}

std::string describe_presets() {
  std::string out = "preset       c = (i, j, k, real)                 palette    what it looks like\n";
  for (const auto& p : presets()) {
    const auto& c = p.parameters.c;
    out += fmt::format("{:12} {:36} {:10} {}\n", p.name, fmt::format("{}, {}, {}, {}", c.x, c.y, c.z, c.w),
                       palette_names()[size_t(p.parameters.palette)], p.text);
  }
  return out;
}

Result<Placement> place(const Scene& scene, double room_size_m, const std::function<void(size_t, size_t)>& progress) {
  const AnimatedBounds found = animated_bounds(scene.parameters, scene.timeline, progress);
  if (!found.box.empty()) return place(found.box, room_size_m);
  const Parameters p = *parameters_at(scene.parameters, scene.timeline, found.empty_at_s);
  const std::string at = scene.timeline.empty() ? "" : fmt::format(", at {:.4g} s of the animation,", found.empty_at_s);
  return Error{why_empty(p, at)};
}

}  // namespace telesplat::julia
