#include "client/stereo/autostereo/panel_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>

#include "common/core/whole_file.h"

namespace telesplat::stereo {
namespace {

Error wrong(const std::string& path, const toml::node& node, const std::string& what) {
  return Error{fmt::format("{}:{}: {}", path, node.source().begin.line, what)};
}

// Reads whole numbers of pixels: [width, height].
Status read_size(const toml::node& node, int& width, int& height) {
  const toml::array* pair = node.as_array();
  if (!pair || pair->size() != 2 || !pair->get(0)->is_integer() || !pair->get(1)->is_integer())
    return Error{"not [WIDTH, HEIGHT] in pixels"};
  const auto within = [](int64_t n) { return n >= 1 && n <= geometry::kMaxImageSide; };
  const int64_t w = **pair->get(0)->as_integer(), h = **pair->get(1)->as_integer();
  if (!within(w) || !within(h))
    return Error{fmt::format("{} x {} pixels, limits are 1 and {}", w, h, geometry::kMaxImageSide)};
  width = int(w), height = int(h);
  return ok_status();
}

Status read_subpixels(const toml::node& node, Subpixels& out) {
  const std::string text = node.value_or(std::string());
  if (text != "rgb" && text != "bgr" && text != "whole") return Error{"not \"rgb\", \"bgr\" or \"whole\""};
  out = text == "rgb" ? Subpixels::kRgb : text == "bgr" ? Subpixels::kBgr : Subpixels::kWhole;
  return ok_status();
}

using Reader = std::function<Status(const toml::node&)>;

Reader number(double& to, double factor = 1) {
  return [&to, factor](const toml::node& node) -> Status {
    const auto value = node.value<double>();
    if (!value || !std::isfinite(*value)) return Error{"not a number"};
    to = *value * factor;
    return ok_status();
  };
}

// Maps "table.key" to the function that reads it.
std::map<std::string, Reader> readers(Panel& p) {
  LineScreen& l = p.lines;
  return {{"panel.pixels", [&](const toml::node& n) { return read_size(n, p.width, p.height); }},
          {"panel.eye", [&](const toml::node& n) { return read_size(n, p.eye.width, p.eye.height); }},
          {"panel.pixel_mm", number(p.pixel_m, 1e-3)},
          {"panel.subpixels", [&](const toml::node& n) { return read_subpixels(n, p.subpixels); }},
          {"panel.distance_m", number(p.distance_m)},
          {"lines.pitch_mm", number(l.pitch_m, 1e-3)},
          {"lines.tilt_deg", number(l.tilt_deg)},
          {"lines.shift_mm", number(l.shift_m, 1e-3)},
          {"lines.gap_mm", number(l.gap_m, 1e-3)},
          {"lines.thickness_mm", number(l.thickness_m, 1e-3)},
          {"lines.index", number(l.index)},
          {"lines.opening", number(l.opening)},
          {"lines.guard", number(l.guard)}};
}

Status read_tables(const std::string& path, const toml::table& file, Panel& panel) {
  auto known = readers(panel);
  for (const auto& [group, node] : file) {
    const toml::table* table = node.as_table();
    if (!table || (group.str() != "panel" && group.str() != "lines"))
      return wrong(path, node, fmt::format("key {}: there are the tables [panel] and [lines] alone", group.str()));
    for (const auto& [key, value] : *table) {
      const auto found = known.find(fmt::format("{}.{}", group.str(), key.str()));
      if (found == known.end()) return wrong(path, value, fmt::format("[{}] has no key {}", group.str(), key.str()));
      if (const Status s = found->second(value); !s)
        return wrong(path, value, fmt::format("{}: {}", key.str(), s.error().text));
    }
  }
  for (const char* needed : {"pitch_mm", "thickness_mm"})
    if (!file["lines"][needed]) return Error{fmt::format("{}: [lines] needs {}", path, needed)};
  return ok_status();
}

}  // namespace

Result<Panel> read_panel(const std::string& path) {
  const auto text = read_whole(path, kMostDescriptionBytes);
  if (!text) return text.error();
  try {
    const toml::table file = toml::parse(*text, path);
    Panel panel;
    if (const Status s = read_tables(path, file, panel); !s) return s.error();
    if (const Status s = validate(panel); !s) return Error{fmt::format("{}: {}", path, s.error().text)};
    return panel;
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

}  // namespace telesplat::stereo
