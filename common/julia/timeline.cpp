#include "common/julia/timeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace telesplat::julia {
namespace {

constexpr size_t kMaxKeys = 4096;
constexpr double kMaxTime_s = 1e6;

Error unreadable(std::string_view part, const std::string& why) {
  return Error{fmt::format("animation \"{}\": {}", part.substr(0, 80), why)};
}

// Splits a text at separators; keeps empty pieces.
std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> out;
  for (size_t begin = 0;;) {
    const size_t end = text.find(separator, begin);
    out.push_back(text.substr(begin, end - begin));
    if (end == std::string_view::npos) return out;
    begin = end + 1;
  }
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

Result<double> number(std::string_view part, std::string_view text) {
  double value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value))
    return unreadable(part, fmt::format("\"{}\" is no finite number", text.substr(0, 40)));
  return value;
}

// Reads "10s" or "10".
Result<double> seconds(std::string_view part, std::string_view text) {
  auto digits = text;
  if (digits.ends_with('s')) digits.remove_suffix(1);
  const auto value = number(part, digits);
  if (!value) return unreadable(part, fmt::format("\"{}\" is no time in seconds, such as 10s", text.substr(0, 40)));
  if (!(*value >= 0 && *value <= kMaxTime_s))
    return unreadable(part, fmt::format("the time {} is outside 0..{} s", text.substr(0, 40), kMaxTime_s));
  return *value;
}

// Reads "-0.4:0.4:10s".
Status read_swing(std::string_view part, std::string_view text, Track& track) {
  const auto fields = split(text, ':');
  if (fields.size() != 3) return unreadable(part, "is not NAME=FROM:TO:SECONDS, such as c.y=-0.4:0.4:10s");
  const auto from = number(part, fields[0]), to = number(part, fields[1]);
  if (!from) return from.error();
  if (!to) return to.error();
  const auto time = seconds(part, fields[2]);
  if (!time) return time.error();
  if (*time <= 0) return unreadable(part, "takes 0 s, it must take longer");
  track.keys = {{0, *from}, {*time, *to}, {2 * *time, *from}};
  return ok_status();
}

// Reads "@0s:-0.4@5s:0.4".
Status read_keys(std::string_view part, std::string_view text, Track& track) {
  const auto frames = split(text.substr(1), '@');
  if (frames.size() > kMaxKeys)
    return unreadable(part, fmt::format("has {} key frames, at most {}", frames.size(), kMaxKeys));
  for (const auto frame : frames) {
    const auto fields = split(frame, ':');
    if (fields.size() != 2) return unreadable(part, fmt::format("\"@{}\" is not @SECONDS:VALUE", frame.substr(0, 40)));
    const auto time = seconds(part, fields[0]);
    if (!time) return time.error();
    const auto value = number(part, fields[1]);
    if (!value) return value.error();
    if (track.keys.empty() && *time != 0)
      return unreadable(part, fmt::format("the first key frame is at {} s, it must be at 0 s", *time));
    if (!track.keys.empty() && *time <= track.keys.back().t_s)
      return unreadable(
          part, fmt::format("the key frame at {} s does not come after that at {} s", *time, track.keys.back().t_s));
    track.keys.push_back({*time, *value});
  }
  if (track.keys.size() < 2) return unreadable(part, "has one key frame, at least 2 are needed");
  return ok_status();
}

// (1 - cos(pi x)) / 2 = sin(pi x / 2)^2 for x from 0 to 1, by the sine's Taylor polynomial: cos() has other last bits
// on processors without FMA, and all processes must compute the same scene.
double smooth(double x) {
  const double angle = 0.5 * glm::pi<double>() * std::min(x, 1 - x), square = angle * angle;
  double sine = 1;
  for (int n = 16; n > 0; n -= 2) sine = 1 - square / (n * (n + 1)) * sine;
  const double low = angle * angle * sine * sine;
  return x <= 0.5 ? low : 1 - low;
}

}  // namespace

double Track::value(double t_s) const {
  const double length = keys.back().t_s;
  const double t = std::isfinite(t_s) && t_s > 0 ? std::fmod(t_s, length) : 0;
  size_t next = 1;
  while (next + 1 < keys.size() && keys[next].t_s <= t) ++next;
  const Key &a = keys[next - 1], &b = keys[next];
  const double part = (t - a.t_s) / (b.t_s - a.t_s);
  return a.value + (b.value - a.value) * smooth(part);
}

std::map<std::string, double> Timeline::values(double t_s) const {
  std::map<std::string, double> out;
  for (const auto& track : tracks) out[track.name] = track.value(t_s);
  return out;
}

std::string Timeline::text() const {
  std::string out;
  for (const auto& track : tracks) {
    out += fmt::format("{}{}=", out.empty() ? "" : ";", track.name);
    const auto& k = track.keys;
    if (k.size() == 3 && k[0].value == k[2].value && k[2].t_s == 2 * k[1].t_s) {
      out += fmt::format("{}:{}:{}s", k[0].value, k[1].value, k[1].t_s);
      continue;
    }
    for (const auto& key : k) out += fmt::format("@{}s:{}", key.t_s, key.value);
  }
  return out;
}

Result<Timeline> parse_timeline(std::string_view text) {
  Timeline out;
  for (const auto piece : split(text, ';')) {
    const auto part = trimmed(piece);
    const size_t equals = part.find('=');
    if (equals == std::string_view::npos || equals == 0)
      return unreadable(part, "is not NAME=FROM:TO:SECONDS, such as c.y=-0.4:0.4:10s");
    Track track{std::string(part.substr(0, equals)), {}};
    const auto values = part.substr(equals + 1);
    const Status read = values.starts_with('@') ? read_keys(part, values, track) : read_swing(part, values, track);
    if (!read) return read.error();
    for (const auto& other : out.tracks)
      if (other.name == track.name) return unreadable(part, fmt::format("{} is animated twice", track.name));
    out.tracks.push_back(std::move(track));
  }
  return out;
}

}  // namespace telesplat::julia
