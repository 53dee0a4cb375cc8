#include "common/links/link.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

namespace telesplat::links {
namespace {

struct Unit {
  std::string_view name;
  double size;
};
constexpr std::array kTimes{Unit{"us", 1e-6}, Unit{"ms", 1e-3}, Unit{"s", 1}};
constexpr std::array kRates{Unit{"kbit", 1e3}, Unit{"mbit", 1e6}, Unit{"gbit", 1e9}};
constexpr double kLeastBetweenStalls_s = 0.01, kMostStalled = 0.99;
constexpr double kLongest_s = 10, kMostBetweenStalls_s = 3600, kLeastRate = 1e4, kMostRate = 1e11;
constexpr double kShortestQueue_s = 0.1;

// Reads a number with one of these units; nothing: the text has another form.
std::optional<double> measure(std::string_view text, const std::array<Unit, 3>& units) {
  double number = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  const std::string_view unit(stop, size_t(text.data() + text.size() - stop));
  for (const Unit& u : units)
    if (u.name == unit) return number * u.size;
  return std::nullopt;
}

Error wrong(std::string_view key, std::string_view value, std::string_view why) {
  return Error{fmt::format("{}={}: {}", key, value, why)};
}

Result<double> time_of(std::string_view key, std::string_view value) {
  const auto s = measure(value, kTimes);
  if (!s) return wrong(key, value, "is no time; a number and us, ms or s");
  if (!(*s >= 0 && *s <= kLongest_s)) return wrong(key, value, fmt::format("not in 0..{}s", kLongest_s));
  return *s;
}

Result<double> rate_of(std::string_view key, std::string_view value) {
  double none = 1;
  const auto [stop, error] = std::from_chars(value.data(), value.data() + value.size(), none);
  const bool zero = error == std::errc() && stop == value.data() + value.size() && none == 0;
  const auto rate = zero ? std::optional(0.0) : measure(value, kRates);
  if (!rate) return wrong(key, value, "is no rate; a number and kbit, mbit or gbit (a second)");
  if (!(*rate >= kLeastRate && *rate <= kMostRate))
    return wrong(key, value, "not in 10kbit..100gbit; leave rate out for a link without a limit");
  return *rate;
}

// Reads "2s/30s".
Status read_stall(Link& link, std::string_view value) {
  const size_t slash = value.find('/');
  const auto part = [&](size_t from, size_t n) { return measure(value.substr(from, n), kTimes); };
  const auto stall = slash == value.npos ? std::nullopt : part(0, slash);
  const auto every = slash == value.npos ? std::nullopt : part(slash + 1, value.npos);
  if (!stall || !every) return wrong("stall", value, "is not FOR/EVERY, two times such as 2s/30s");
  if (!(*stall > 0 && *every >= kLeastBetweenStalls_s && *stall <= kMostStalled * *every &&
        *every <= kMostBetweenStalls_s))
    return wrong("stall", value,
                 fmt::format("FOR must be above 0 and at most {} of EVERY, EVERY {}s to {}s", kMostStalled,
                             kLeastBetweenStalls_s, kMostBetweenStalls_s));
  link.stall_s = *stall;
  link.stall_every_s = *every;
  return ok_status();
}

Status read_part(Link& link, std::string_view key, std::string_view value) {
  if (key == "stall") return read_stall(link, value);
  double* const target = key == "rtt" ? &link.rtt_s : key == "jitter" ? &link.jitter_s : nullptr;
  if (!target && key != "rate")
    return Error{fmt::format("{}: no such property of a link; rtt, rate, jitter and stall are", key)};
  const auto read = target ? time_of(key, value) : rate_of(key, value);
  if (!read) return read.error();
  (target ? *target : link.rate_bit_s) = *read;
  return ok_status();
}

// Reads "20mbit", "50ms", "50ms:100mbit".
Result<Link> parse_short(std::string_view text) {
  Link out;
  const size_t colon = text.find(':');
  const std::string_view first = text.substr(0, colon);
  const bool is_rate = colon == text.npos && measure(first, kRates).has_value();
  if (!is_rate && !measure(first, kTimes))
    return Error{
        fmt::format("{}: is no link; local, RATE (20mbit), RTT:RATE (50ms:100mbit) and "
                    "rtt=40ms,rate=100mbit,jitter=5ms,stall=2s/30s are",
                    text.substr(0, 80))};
  if (const Status s = read_part(out, is_rate ? "rate" : "rtt", first); !s) return s.error();
  if (colon == text.npos) return out;
  if (const Status s = read_part(out, "rate", text.substr(colon + 1)); !s) return s.error();
  return out;
}

std::string number_with(double value, const std::array<Unit, 3>& units) {
  const Unit* best = &units.front();
  for (const Unit& u : units)
    if (value >= u.size * (1 - 1e-9)) best = &u;
  return fmt::format("{:.6g}{}", value / best->size, best->name);
}

}  // namespace

std::string_view name_of(Place place) {
  switch (place) {
    case Place::kViewer:
      return "viewer";
    case Place::kSampler:
      return "sampler";
    case Place::kData:
      return "data";
  }
  return {};
}

Result<Link> parse(std::string_view text) {
  if (text == "local") return Link{};
  if (text.find('=') == text.npos) return parse_short(text);
  Link out;
  for (size_t from = 0; from <= text.size();) {
    const size_t comma = std::min(text.find(',', from), text.size());
    const std::string_view part = text.substr(from, comma - from);
    from = comma + 1;
    const size_t equals = part.find('=');
    if (equals == part.npos)
      return Error{fmt::format("{}: is not PROPERTY=VALUE, as in rtt=40ms,rate=100mbit", part.substr(0, 80))};
    if (const Status s = read_part(out, part.substr(0, equals), part.substr(equals + 1)); !s) return s.error();
  }
  return out;
}

Result<PlacedLink> parse_placed(std::string_view text) {
  PlacedLink out;
  const size_t colon = text.find(':');
  for (const Place place : {Place::kViewer, Place::kSampler, Place::kData})
    if (colon != text.npos && text.substr(0, colon) == name_of(place)) {
      out.place = place;
      text.remove_prefix(colon + 1);
      break;
    }
  auto link = parse(text);
  if (!link) return link.error();
  out.link = *link;
  return out;
}

std::string text_of(const Link& link) {
  if (link.is_local()) return "local";
  std::string out;
  const auto add = [&](std::string_view key, const std::string& value) {
    out += fmt::format("{}{}={}", out.empty() ? "" : ",", key, value);
  };
  if (link.rtt_s > 0) add("rtt", number_with(link.rtt_s, kTimes));
  if (link.rate_bit_s > 0) add("rate", number_with(link.rate_bit_s, kRates));
  if (link.jitter_s > 0) add("jitter", number_with(link.jitter_s, kTimes));
  if (link.stall_s > 0)
    add("stall", fmt::format("{}/{}", number_with(link.stall_s, kTimes), number_with(link.stall_every_s, kTimes)));
  return out;
}

uint64_t queue_bytes(const Link& link) {
  return uint64_t(link.rate_bit_s / 8 * std::max(link.rtt_s, kShortestQueue_s));
}

}  // namespace telesplat::links
