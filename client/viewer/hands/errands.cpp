#include "client/viewer/hands/errands.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/scene/session.h"
#include "common/scene/settings.h"

namespace telesplat::viewer {
namespace {

using Json = nlohmann::ordered_json;

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> out;
  for (;;) {
    const size_t end = text.find(at);
    if (const auto part = text.substr(0, end); !part.empty()) out.push_back(part);
    if (end == text.npos) return out;
    text.remove_prefix(end + 1);
  }
}

// Reads pixels, or a percentage of them.
std::optional<double> coordinate(std::string_view text, int size) {
  if (!text.ends_with('%')) return number(text);
  const auto share = number(text.substr(0, text.size() - 1));
  return share ? std::optional(*share / 100 * size) : std::nullopt;
}

Result<glm::dvec2> place(std::string_view text, const geometry::Camera& camera) {
  const auto parts = split(text, ',');
  const auto x = parts.size() == 2 ? coordinate(parts[0], camera.width) : std::nullopt;
  const auto y = parts.size() == 2 ? coordinate(parts[1], camera.height) : std::nullopt;
  if (!x || !y)
    return Error{fmt::format("pick: \"{}\" is not X,Y in pixels, or in per cent of the display", text.substr(0, 40))};
  if (!(*x >= 0 && *x <= camera.width && *y >= 0 && *y <= camera.height))
    return Error{fmt::format("pick: {:g},{:g} lies outside of the display, which has {} x {} pixels", *x, *y,
                             camera.width, camera.height)};
  return glm::dvec2(*x, *y);
}

struct Pointed {
  glm::dvec2 pixel;
  std::optional<Pick> pick;
};

// Picks at the places that an order names.
Result<std::vector<Pointed>> point(const wire::Order& order, const FrameHands& hands, double& opacity) {
  if (!hands.terms) return Error{"pick: nothing is shown yet"};
  if (hands.pictures) return Error{"pick: views come as pictures (--coupling images), which have no depth"};
  const std::string at = scene::value_or(order.arguments, "at", std::string());
  const auto wanted = split(at, ' ');
  if (wanted.empty() || wanted.size() > kMostPicks)
    return Error{fmt::format("pick: {} places, one to {} are possible", wanted.size(), kMostPicks)};
  opacity = kPickOpacity;
  if (const auto given = order.arguments.find("opacity"); given != order.arguments.end()) {
    const auto read = number(given->second);
    if (!read || !(*read > 0 && *read <= 1))
      return Error{fmt::format("pick: the opacity {} is not above 0 and up to 1", given->second.substr(0, 40))};
    opacity = *read;
  }
  std::vector<Pointed> out;
  for (const auto text : wanted) {
    const auto pixel = place(text, hands.camera);
    if (!pixel) return pixel.error();
    out.push_back({*pixel, hands.pick(pixel->x, pixel->y, opacity)});
  }
  return out;
}

Result<std::string> pick(const wire::Order& order, const FrameHands& hands) {
  double opacity = 0;
  const auto pointed = point(order, hands, opacity);
  if (!pointed) return pointed.error();
  Json picks = Json::array();
  for (const Pointed& p : *pointed) {
    if (!p.pick) {
      picks.push_back(nullptr);
      continue;
    }
    Json told = scene::to_json(meaning_of(*p.pick, *hands.terms), hands.terms->placement);
    told["colour"] = fmt::format("#{:06x}", p.pick->colour);
    told["depth_m"] = p.pick->depth_m;
    told["spacing_m"] = p.pick->spacing_m;
    told["pixel"] = {p.pixel.x, p.pixel.y};
    told["probe"] = scene::to_arguments(probe_of(*p.pick, hands.epoch, opacity));
    picks.push_back(std::move(told));
  }
  return Json{{"picks", std::move(picks)},
              {"epoch", hands.epoch.value},
              {"placement", Json::parse(scene::to_text(hands.terms->placement))}}
      .dump(-1, ' ', false, Json::error_handler_t::replace);
}

Status add_places(const wire::Order& order, const FrameHands& hands) {
  double opacity = 0;
  const auto pointed = point(order, hands, opacity);
  if (!pointed) return pointed.error();
  for (const Pointed& p : *pointed)
    if (!p.pick) return Error{fmt::format("measure: nothing lies at {:g},{:g}", p.pixel.x, p.pixel.y)};
  hands.measurements->begin_row();
  for (const Pointed& p : *pointed)
    if (const auto number = hands.measurements->add(*p.pick, *hands.terms, hands.epoch, opacity); !number)
      return number.error();
  hands.measurements->begin_row();
  return ok_status();
}

Result<std::string> measure(const wire::Order& order, const FrameHands& hands) {
  if (!hands.measurements) return Error{"measure: this viewer has no window; ctl pick measures without one"};
  Measurements& all = *hands.measurements;
  const std::string what = scene::value_or(order.arguments, "do", std::string());
  auto done = ok_status();
  if (what == "csv") return Json{{"csv", all.csv()}}.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (what == "add") {
    done = add_places(order, hands);
  } else if (what == "remove") {
    const std::string text = scene::value_or(order.arguments, "number", std::string());
    const auto which = number(text);
    done = which && *which >= 0 && *which < 1e15
               ? all.remove(uint64_t(*which))
               : Status(Error{fmt::format("measure: \"{}\" is no place's number", text.substr(0, 40))});
  } else if (what == "clear") {
    all.clear();
  } else if (what != "list") {
    return Error{fmt::format("measure: \"{}\" is none of list, add, remove, clear and csv", what.substr(0, 40))};
  }
  if (!done) return done.error();
  return all.list();
}

std::string where(const FrameHands& hands) {
  const auto& [p, q] = hands.head;
  return Json{{"position", {p.x, p.y, p.z}},
              {"orientation", {q.w, q.x, q.y, q.z}},
              {"width", hands.camera.width},
              {"height", hands.camera.height},
              {"epoch", hands.epoch.value}}
      .dump();
}

Result<std::string> go(const wire::Order& order, const FrameHands& hands) {
  const std::string text = scene::value_or(order.arguments, "pose", std::string());
  const auto parts = split(text, ',');
  double v[7];
  for (size_t i = 0; i < 7; ++i) {
    const auto read = parts.size() == 7 ? number(parts[i]) : std::nullopt;
    if (!read) return Error{fmt::format("go: \"{}\" is not seven numbers px,py,pz,qw,qx,qy,qz", text.substr(0, 80))};
    v[i] = *read;
  }
  geometry::Camera camera = hands.camera;
  camera.pose = {{v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]}};
  if (const Status s = geometry::validate(camera); !s) return Error{"go: " + s.error().text};
  camera.pose.orientation = glm::normalize(camera.pose.orientation);
  if (!hands.go(camera.pose))
    return Error{"go: this viewer's head follows its trajectory; a window's camera can be sent"};
  return std::string("{}");
}

Result<std::string> set(const wire::Order& order, const FrameHands& hands) {
  const auto argument = [&](const char* name) { return scene::value_or(order.arguments, name, std::string()); };
  const bool overlay = order.command == "overlay";
  const std::string value = argument(overlay ? "on" : "value");
  if (overlay && value != "on" && value != "off")
    return Error{fmt::format("overlay: \"{}\" is not on or off", value.substr(0, 40))};
  if (const Status s = hands.set(overlay ? argument("name") : order.command, value); !s)
    return Error{order.command + ": " + s.error().text};
  return std::string("{}");
}

}  // namespace

Result<std::string> carry_out(const wire::Order& order, const FrameHands& hands) {
  if (order.command == "pick") return pick(order, hands);
  if (order.command == "where") return where(hands);
  if (order.command == "go") return go(order, hands);
  if (order.command == "measure") return measure(order, hands);
  if (const auto* setting = scene::setting_of_order(order.command);
      setting && setting->keeper == scene::Keeper::kViewer)
    return set(order, hands);
  return Error{fmt::format("a viewer does not know the order '{}'", order.command.substr(0, 64))};
}

}  // namespace telesplat::viewer
