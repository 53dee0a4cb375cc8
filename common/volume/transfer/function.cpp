#include "common/volume/transfer/function.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>

#include "common/colour/paraview_json.h"
#include "common/geometry/number_text.h"

namespace telesplat::volume {
namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const size_t begin = text.find_first_not_of(kBlank);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

// Reads "#rrggbb" or "r/g/b", each 0 to 1.
bool read_colour(std::string_view text, TransferFunction::Point& point) {
  float* const channels[] = {&point.r, &point.g, &point.b};
  if (text.size() == 7 && text[0] == '#') {
    uint32_t rgb = 0;
    const auto read = std::from_chars(text.data() + 1, text.data() + 7, rgb, 16);
    if (read.ec != std::errc{} || read.ptr != text.data() + 7) return false;
    for (int c = 0; c < 3; ++c) *channels[c] = float(rgb >> (16 - 8 * c) & 255) / 255.0f;
    return true;
  }
  if (std::count(text.begin(), text.end(), '/') != 2) return false;
  for (float* const channel : channels) {
    const auto value = number_from<float>(trimmed(take_until(text, '/')));
    if (!value) return false;
    *channel = *value;
  }
  return true;
}

Result<TransferFunction::Point> read_point(std::string_view text, const ValueRange& range) {
  const auto refuse = [&](std::string_view what, std::string_view part, std::string_view form) {
    return Error{fmt::format("transfer function: \"{}\" has the {} \"{}\", not {}", text.substr(0, 80), what,
                             part.substr(0, 40), form)};
  };
  if (std::count(text.begin(), text.end(), ':') != 2)
    return Error{fmt::format("transfer function: \"{}\" is no point value:colour:opacity", text.substr(0, 80))};
  std::string_view rest = text;
  TransferFunction::Point point;
  const std::string_view at = trimmed(take_until(rest, ':')), colour = trimmed(take_until(rest, ':')),
                         opacity = trimmed(take_until(rest, ':'));
  const bool percent = at.ends_with('%');
  const auto value = number_from<double>(percent ? trimmed(at.substr(0, at.size() - 1)) : at);
  if (!value) return refuse("value", at, "a number or a percentage");
  point.value = percent ? range.lo + (range.hi - range.lo) * (*value / 100) : *value;
  if (!read_colour(colour, point)) return refuse("colour", colour, "#rrggbb or three numbers r/g/b");
  const auto alpha = number_from<float>(opacity);
  if (!alpha) return refuse("opacity", opacity, "a number");
  point.opacity = *alpha;
  return point;
}

bool in_unit(float v) { return v >= 0 && v <= 1; }  // false for NaN, too

// Writes "#rrggbb" if all channels are whole 255ths.
std::string colour_text(const TransferFunction::Point& p) {
  uint32_t rgb = 0;
  for (const float c : {p.r, p.g, p.b}) {
    const float scaled = std::floor(c * 255.0f + 0.5f);
    if (!in_unit(c) || scaled / 255.0f != c || std::signbit(c)) return fmt::format("{}/{}/{}", p.r, p.g, p.b);
    rgb = rgb << 8 | uint32_t(scaled);
  }
  return fmt::format("#{:06x}", rgb);
}

TransferFunction::Point mix(const TransferFunction::Point& a, const TransferFunction::Point& b, double value) {
  const float t = float((value - a.value) / (b.value - a.value));
  const auto between = [t](float from, float to) { return from + (to - from) * t; };
  return {value, between(a.r, b.r), between(a.g, b.g), between(a.b, b.b), between(a.opacity, b.opacity)};
}

// Largest difference, in any channel, of the points between `begin` and `end` from the line through these two. Sets
// `farthest` to that point.
double distance_from_line(const std::vector<TransferFunction::Point>& points, size_t begin, size_t end,
                          size_t& farthest) {
  double most = -1;
  const auto& a = points[begin];
  const auto& b = points[end];
  for (size_t n = begin + 1; n < end; ++n) {
    const auto& p = points[n];
    const auto q = b.value > a.value ? mix(a, b, p.value) : a;
    double off = std::max({std::abs(p.r - q.r), std::abs(p.g - q.g), std::abs(p.b - q.b)});
    off = std::max(off, 4.0 * std::abs(p.opacity - q.opacity));  // weighs more: opacities add up along a ray
    if (off > most) most = off, farthest = n;
  }
  return most;
}

}  // namespace

TransferFunction::Point TransferFunction::at(double value) const {
  const auto above =
      std::upper_bound(points.begin(), points.end(), value, [](double v, const Point& p) { return v < p.value; });
  Point out;
  if (above == points.begin() || std::isnan(value))
    out = points.front();
  else if (above == points.end())
    out = points.back();
  else
    out = mix(*std::prev(above), *above, value);
  out.value = value;
  return out;
}

Status validate(const TransferFunction& transfer) {
  if (transfer.points.empty()) return Error{"transfer function: no points, at least one"};
  if (transfer.points.size() > kMaxTransferPoints)
    return Error{fmt::format("transfer function: {} points, limit {}", transfer.points.size(), kMaxTransferPoints)};
  double before = -kMaxTransferValue;
  for (const auto& p : transfer.points) {
    if (!(std::abs(p.value) <= kMaxTransferValue))
      return Error{fmt::format("transfer function: a point has the value {}, limits are {}..{}", p.value,
                               -kMaxTransferValue, kMaxTransferValue)};
    if (p.value < before)
      return Error{fmt::format("transfer function: value {} follows {}; values ascend", p.value, before)};
    before = p.value;
    if (!in_unit(p.r) || !in_unit(p.g) || !in_unit(p.b))
      return Error{fmt::format("transfer function: the point at {} has the colour {}/{}/{}, limits are 0..1", p.value,
                               p.r, p.g, p.b)};
    if (!in_unit(p.opacity))
      return Error{
          fmt::format("transfer function: the point at {} has the opacity {}, limits are 0..1", p.value, p.opacity)};
  }
  return ok_status();
}

Result<TransferFunction> parse_transfer(std::string_view text, const ValueRange& range) {
  if (text.size() > kMaxTransferText)
    return Error{fmt::format("transfer function: a text of {} bytes, limit {}", text.size(), kMaxTransferText)};
  TransferFunction out;
  std::string_view rest = trimmed(text);
  if (rest.empty()) return Error{"transfer function: an empty text, no point value:colour:opacity"};
  while (!rest.empty()) {
    const auto point = read_point(trimmed(take_until(rest, ',')), range);
    if (!point) return point.error();
    out.points.push_back(*point);
  }
  if (const Status valid = validate(out); !valid) return valid.error();
  return out;
}

std::string to_text(const TransferFunction& transfer) {
  std::string out;
  for (const auto& p : transfer.points)
    out += fmt::format("{}{}:{}:{}", out.empty() ? "" : ", ", p.value, colour_text(p), p.opacity);
  return out;
}

// Douglas and Peucker, "Algorithms for the Reduction of the Number of Points Required to Represent a Digitized Line",
// Cartographica 10(2), 1973; adds the farthest point of all first, so that the result is the best so far at any
// number of points.
TransferFunction shortened(const TransferFunction& transfer, size_t max_bytes) {
  if (to_text(transfer).size() <= max_bytes || transfer.points.size() < 3) return transfer;
  const auto& points = transfer.points;
  struct Piece {
    size_t begin, end, farthest;
    double off;
  };
  std::vector<Piece> pieces;
  const auto add = [&](size_t begin, size_t end) {
    size_t farthest = begin;
    const double off = distance_from_line(points, begin, end, farthest);
    if (off >= 0) pieces.push_back({begin, end, farthest, off});
  };
  std::vector<size_t> kept{0, points.size() - 1};
  size_t bytes = 0;
  const auto cost = [&](size_t n) { return to_text({{points[n]}}).size() + 2; };
  for (const size_t n : kept) bytes += cost(n);
  add(0, points.size() - 1);
  while (!pieces.empty()) {
    const auto worst =
        std::max_element(pieces.begin(), pieces.end(), [](const auto& a, const auto& b) { return a.off < b.off; });
    const Piece piece = *worst;
    bytes += cost(piece.farthest);
    if (bytes > max_bytes) break;
    pieces.erase(worst);
    kept.push_back(piece.farthest);
    add(piece.begin, piece.farthest);
    add(piece.farthest, piece.end);
  }
  std::sort(kept.begin(), kept.end());
  TransferFunction out;
  for (const size_t n : kept) out.points.push_back(points[n]);
  return out;
}

Result<TransferFunction> resolve_transfer(const std::string& text, const ValueRange& range) {
  const std::string_view word = trimmed(text);
  const size_t end = word.find(".json");
  if (end != word.npos && (word.size() == end + 5 || word[end + 5] == ':')) {
    const std::string path(word.substr(0, end + 5));
    const auto content = colour::read_map_file(path);
    if (!content) return content.error();
    return parse_paraview_json(*content, path, range, word.size() > end + 6 ? word.substr(end + 6) : "");
  }
  return word.find(':') == word.npos ? transfer_preset(word, range) : parse_transfer(word, range);
}

float extinction(float opacity) { return opacity >= kLeastOpacity ? -std::log1p(-std::min(opacity, kMaxOpacity)) : 0; }

std::vector<LevelColour> level_colours(const TransferFunction& transfer, const Levels& levels) {
  std::vector<LevelColour> out(size_t(levels.count));
  for (int l = 0; l < levels.count; ++l) {
    const auto p = transfer.at(levels.value(l));
    LevelColour& colour = out[size_t(l)];
    colour = {p.r, p.g, p.b, extinction(p.opacity)};
  }
  return out;
}

}  // namespace telesplat::volume
