#include "common/image/legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "common/geometry/number_text.h"
#include "common/image/glyphs.h"

namespace telesplat::image {
namespace {

constexpr uint32_t kInk = 0xfff4f4f4, kRim = 0xd0101418, kEmpty = 0x90101418;
// Plate behind the legend: on a white ground, rims alone do not make small white letters readable.
constexpr uint32_t kPlate = 0xa0101418;
constexpr int kLeastTicks = 2, kMostTicks = 7;
constexpr size_t kMostTitleLines = 4;

// Number of digits behind the point that a multiple of `step` needs.
int decimals_of(double step) {
  for (int n = 0; n < 17; ++n) {
    const double scaled = step * std::pow(10.0, n);
    if (std::abs(scaled - std::round(scaled)) < 1e-6 * scaled) return n;
  }
  return 17;
}

// Power of ten that all labels are divided by, so that they have neither many digits nor many zeros.
int common_exponent(double lo, double hi) {
  const double largest = std::max(std::abs(lo), std::abs(hi));
  if (largest == 0 || (largest >= 1e-3 && largest < 1e6)) return 0;
  if (largest >= 1e6 && largest < 1e10 && hi - lo < 1e-3 * largest) return 0;  // dates: people read them whole
  return int(std::floor(std::log10(largest)));
}

// Multiplies by a power of ten, exactly if both are exact; beyond 10^300 in steps.
double times_power(double value, int exponent) {
  for (; exponent > 300; exponent -= 300) value *= 1e300;
  for (; exponent < -300; exponent += 300) value /= 1e300;
  return exponent < 0 ? value / std::pow(10.0, -exponent) : value * std::pow(10.0, exponent);
}

std::string number_text(double value, int decimals) {
  std::string out = fmt::format("{:.{}f}", value, decimals);
  if (std::none_of(out.begin(), out.end(), [](char c) { return c >= '1' && c <= '9'; }) && out[0] == '-')
    out.erase(0, 1);  // no minus zero
  return out;
}

// Multiples of `step`; empty if numbers lack the digits to tell them apart.
std::vector<Tick> multiples(double lo, double hi, double step) {
  std::vector<Tick> out;
  const double slack = (hi - lo) * 1e-9;
  const int decimals = decimals_of(step);
  for (double n = std::ceil((lo - slack) / step); out.size() < 100; ++n) {
    const double value = n * step;
    if (!(value <= hi + slack) || n + 1 == n) break;
    out.push_back({value, number_text(value, decimals)});
  }
  return out;
}

std::vector<std::string> wrapped(const std::string& title, size_t most_letters) {
  std::vector<std::string> lines{""};
  size_t letters = 0;
  for (std::string_view rest = title; !rest.empty();) {
    const std::string_view before = rest;
    const char32_t c = take_character(rest);
    const size_t word = std::min(before.find(' ', 1), before.size()) - 1;
    const bool breaks = letters == most_letters || (c == ' ' && letters + word > most_letters);
    if (breaks) {
      if (lines.size() == kMostTitleLines) {
        lines.back() += "..";
        break;
      }
      lines.emplace_back();
      letters = 0;
      if (c == ' ') continue;
    }
    lines.back() += before.substr(0, before.size() - rest.size());
    ++letters;
  }
  return lines;
}

// Sizes in pixels of a legend's parts.
struct Layout {
  int dot, line, bar_x, bar_y, bar_width, bar_height, width, height;
  std::vector<std::string> title;
  Ticks ticks;
};

Layout layout_of(const Legend& legend, int display_width, int display_height) {
  Layout l;
  l.dot = std::clamp(int(std::lround(std::min(display_width / 640.0, display_height / 400.0))), 1, 12);
  l.line = (kGlyphHeight + 3) * l.dot;
  const int rim = 2 * l.dot, most_width = std::max(display_width / 3, 10 * kGlyphAdvance * l.dot);
  l.title = wrapped(legend.title, size_t(std::max(8, most_width / (kGlyphAdvance * l.dot) - 1)));
  if (legend.title.empty()) l.title.clear();
  l.bar_height = std::max(4 * l.line, display_height * 2 / 5);
  l.bar_width = (legend.opacity.empty() ? 10 : 24) * l.dot;
  l.ticks = nice_ticks(legend.lo, legend.hi, std::clamp(l.bar_height / (2 * l.line), kLeastTicks, kMostTicks));
  if (l.ticks.exponent != 0) l.title.push_back(fmt::format("\u00d7 10^{}", l.ticks.exponent));
  l.bar_x = rim;
  l.bar_y = rim + int(l.title.size()) * l.line + (kGlyphHeight / 2 + 1) * l.dot;
  int text = 0;
  for (const auto& tick : l.ticks.all) text = std::max(text, text_width(tick.label, l.dot));
  l.width = l.bar_x + l.bar_width + 6 * l.dot + text + rim;
  for (const auto& line : l.title) l.width = std::max(l.width, text_width(line, l.dot) + 2 * rim);
  l.height = l.bar_y + l.bar_height + (kGlyphHeight / 2 + 1) * l.dot + rim;
  return l;
}

// Writes letters with a rim of one dot.
void write(Canvas& canvas, int x, int y, const std::string& text, int dot) {
  for (int dy = -dot; dy <= dot; dy += dot)
    for (int dx = -dot; dx <= dot; dx += dot) canvas.text(x + dx, y + dy, text, kRim, dot);
  canvas.text(x, y, text, kInk, dot);
}

View plain(int width, int height, uint32_t colour) { return Canvas(width, height, colour).view(); }

// The bar's pixels; with opacities, a curve of them over the values, filled with the values' colours.
View bar_of(const Legend& legend, int width, int height) {
  View out = plain(width, height, kEmpty);
  for (int y = 0; y < height; ++y) {
    const double at = height > 1 ? double(height - 1 - y) / (height - 1) : 1;
    int filled = width;
    if (!legend.opacity.empty()) {
      const double place = at * double(legend.opacity.size() - 1);
      const auto below = std::min(size_t(place), legend.opacity.size() - 1);
      const auto above = std::min(below + 1, legend.opacity.size() - 1);
      const double opacity =
          legend.opacity[below] + (legend.opacity[above] - legend.opacity[below]) * (place - double(below));
      filled = int(std::lround(opacity * width));
    }
    const uint32_t colour = 0xff000000 | legend.map.at(at);
    for (int x = 0; x < filled; ++x) out.colour[size_t(y) * width + x] = colour;
  }
  return out;
}

double place_on_bar(const Legend& legend, double value) {
  if (!(legend.hi > legend.lo)) return 0.5;
  // Divides by 2 first, because the difference of large numbers may be infinite.
  return std::clamp((value / 2 - legend.lo / 2) / (legend.hi / 2 - legend.lo / 2), 0.0, 1.0);
}

}  // namespace

std::string to_text(const Legend& legend) {
  std::string title = legend.title;
  for (char& c : title)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  std::string out = fmt::format("{}\n{}\n{}\n{}\n", title, legend.lo, legend.hi, colour::to_text(legend.map));
  for (const float o : legend.opacity) out += fmt::format("{} ", o);
  return out;
}

Result<Legend> legend_from_text(std::string_view text) {
  if (text.size() > kMaxLegendText)
    return Error{fmt::format("a legend of {} bytes, limit {}", text.size(), kMaxLegendText)};
  Legend out;
  out.title = take_until(text, '\n');
  const auto lo = number_from<double>(take_until(text, '\n')), hi = number_from<double>(take_until(text, '\n'));
  if (!lo || !hi || *lo > *hi) return Error{"a legend's range is not two numbers that ascend"};
  out.lo = *lo;
  out.hi = *hi;
  auto map = colour::from_text(take_until(text, '\n'));
  if (!map) return map.error();
  out.map = std::move(*map);
  while (!text.empty()) {
    const auto opacity = number_from<float>(take_until(text, ' '));
    if (!opacity || *opacity < 0 || *opacity > 1 || out.opacity.size() == kMaxLegendOpacities)
      return Error{fmt::format("a legend's opacities are not at most {} numbers from 0 to 1", kMaxLegendOpacities)};
    out.opacity.push_back(*opacity);
  }
  return out;
}

Ticks nice_ticks(double lo, double hi, int most) {
  CHECK(std::isfinite(lo) && std::isfinite(hi) && lo <= hi && most >= 2);
  Ticks out;
  out.exponent = common_exponent(lo, hi);
  const double a = times_power(lo, -out.exponent), b = times_power(hi, -out.exponent);
  if (a < b) {
    // Tries steps from the finest that may do, and takes the first with few enough ticks.
    const int power = int(std::floor(std::log10((b - a) / most)));
    for (int n = 0; n < 12; ++n) {
      constexpr double kFactors[] = {1, 2, 2.5, 5};
      auto ticks = multiples(a, b, times_power(kFactors[n % 4], power + n / 4));
      if (ticks.size() < 2) break;
      if (int(ticks.size()) > most) continue;
      out.all = std::move(ticks);
      break;
    }
  }
  if (out.all.empty()) {
    out.all.push_back({a, fmt::format("{:.6g}", a)});
    if (a < b) out.all.push_back({b, fmt::format("{:.6g}", b)});
  }
  for (Tick& tick : out.all) tick.value = std::clamp(times_power(tick.value, out.exponent), lo, hi);
  return out;
}

View legend_picture(const Legend& legend, int display_width, int display_height) {
  const Layout l = layout_of(legend, display_width, display_height);
  Canvas canvas(l.width, l.height, kPlate);
  int y = 2 * l.dot;
  for (const auto& line : l.title) {
    write(canvas, 2 * l.dot, y, line, l.dot);
    y += l.line;
  }
  const int dot = l.dot;
  canvas.place(plain(l.bar_width + 4 * dot, l.bar_height + 4 * dot, kRim), l.bar_x - 2 * dot, l.bar_y - 2 * dot);
  canvas.place(plain(l.bar_width + 2 * dot, l.bar_height + 2 * dot, kInk), l.bar_x - dot, l.bar_y - dot);
  canvas.place(bar_of(legend, l.bar_width, l.bar_height), l.bar_x, l.bar_y);
  for (const auto& tick : l.ticks.all) {
    const int at = l.bar_y + int(std::lround((1 - place_on_bar(legend, tick.value)) * (l.bar_height - 1)));
    const int x = l.bar_x + l.bar_width + dot;
    canvas.place(plain(3 * dot, 3 * dot, kRim), x, at - (3 * dot - 1) / 2);
    canvas.place(plain(2 * dot, dot, kInk), x, at - (dot - 1) / 2);
    write(canvas, x + 5 * dot, at - kGlyphHeight * dot / 2, tick.label, dot);
  }
  return canvas.view();
}

geometry::Rect legend_place(const View& picture, int display_width, int display_height) {
  const int margin = std::max(2, std::min(display_width, display_height) / 60);
  return {display_width - margin - picture.width, display_height - margin - picture.height, picture.width,
          picture.height};
}

void draw_legend(View& picture, const Legend& legend) {
  draw_legend(picture, legend, {picture.width, picture.height, 0, 0});
}

void draw_legend(View& picture, const Legend& legend, const DisplayPart& part) {
  const View over = legend_picture(legend, part.width, part.height);
  const auto place = legend_place(over, part.width, part.height);
  blend(picture, over, place.x - part.x, place.y - part.y);
}

}  // namespace telesplat::image
