#include "tests/support/xr/config.h"

#include <fmt/format.h>

#include <charconv>
#include <functional>
#include <map>
#include <sstream>

namespace telesplat::xr_test {
namespace {

using Read = std::function<bool(const std::string&)>;

std::optional<double> number(std::string_view text) {
  double out = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && stop == text.data() + text.size() ? std::optional(out) : std::nullopt;
}

Read within(double& value, double least, double most) {
  return [&value, least, most](const std::string& text) {
    const auto v = number(text);
    if (v) value = *v;
    return v && *v >= least && *v <= most;
  };
}

Read whole(int& value, int least, int most) {
  return [&value, least, most](const std::string& text) {
    const auto v = number(text);
    if (v) value = int(*v);
    return v && *v == int(*v) && *v >= least && *v <= most;
  };
}

Read on_off(bool& value) {
  return [&value](const std::string& text) {
    value = text == "on";
    return text == "on" || text == "off";
  };
}

Read moment(std::optional<double>& value) {
  return [&value](const std::string& text) { return (value = number(text)).has_value(); };
}

Read span(std::optional<std::pair<double, double>>& value) {
  return [&value](const std::string& text) {
    const size_t dash = text.find('-');
    if (dash == text.npos) return false;
    const auto from = number(text.substr(0, dash)), to = number(text.substr(dash + 1));
    if (from && to) value = std::pair(*from, *to);
    return from && to && *from < *to;
  };
}

bool read_size(const std::string& text, Config& c) {
  const size_t x = text.find('x');
  return x != text.npos && whole(c.width, 16, 16384)(text.substr(0, x)) &&
         whole(c.height, 16, 16384)(text.substr(x + 1));
}

bool read_recentring(const std::string& text, Config& c) {
  const size_t colon = text.find(':');
  if (colon == text.npos || !moment(c.recentre_s)(text.substr(0, colon))) return false;
  std::istringstream list(text.substr(colon + 1));
  std::string part;
  int axis = 0;
  for (; axis < 3 && std::getline(list, part, ','); ++axis)
    if (!within(c.recentre_by_m[axis], -100, 100)(part)) return false;
  return axis == 3;
}

bool read_failure(const std::string& text, Config& c) {
  const size_t at = text.find('@');
  c.fails = text.substr(0, at);
  return at != text.npos && within(c.fails_s, 0, 1e6)(text.substr(at + 1));
}

Status read_trajectory(const std::string& text, Config& c) {
  if (text == "orbit") return ok_status();
  if (text == "still") {
    c.head = geometry::Trajectory::still(geometry::default_pose());
    return ok_status();
  }
  auto read = geometry::Trajectory::read_csv(text);
  if (!read) return read.error();
  c.head = std::move(*read);
  c.head.repeat();
  return ok_status();
}

}  // namespace

Result<Config> parse_config(const std::string& text) {
  Config c;
  const std::map<std::string, Read> keys{
      {"rate", within(c.rate_hz, 1, 1000)},
      {"size", [&](const std::string& t) { return read_size(t, c); }},
      {"fov", within(c.fov_deg, 20, 150)},
      {"cant", within(c.cant_deg, -20, 20)},
      {"eyes", within(c.eye_distance_m, 0, 0.2)},
      {"out", [&](const std::string& t) { return !(c.out = t).empty(); }},
      {"every", whole(c.every, 0, 1'000'000)},
      {"exr", on_off(c.exr)},
      {"stage", on_off(c.stage)},
      {"depth", on_off(c.depth)},
      {"hands", on_off(c.hands)},
      {"lost", moment(c.lost_s)},
      {"gone", moment(c.gone_s)},
      {"exit", moment(c.exit_s)},
      {"hidden", span(c.hidden_s)},
      {"untracked", span(c.untracked_s)},
      {"pressed", span(c.pressed_s)},
      {"discard", whole(c.discard_every, 0, 1'000'000)},
      {"recentre", [&](const std::string& t) { return read_recentring(t, c); }},
      {"fails", [&](const std::string& t) { return read_failure(t, c); }},
  };
  std::istringstream list(text);
  for (std::string entry; std::getline(list, entry, ';');) {
    if (entry.empty()) continue;
    const size_t equals = entry.find('=');
    const std::string key = entry.substr(0, equals), value = equals == entry.npos ? "" : entry.substr(equals + 1);
    if (key == "trajectory") {
      if (const Status s = read_trajectory(value, c); !s) return s.error();
      continue;
    }
    const auto found = keys.find(key);
    if (found == keys.end()) return Error{fmt::format("TELESPLAT_XR_TEST: there is no key {}", key)};
    if (!found->second(value)) return Error{fmt::format("TELESPLAT_XR_TEST: {}={} cannot be", key, value)};
  }
  return c;
}

}  // namespace telesplat::xr_test
