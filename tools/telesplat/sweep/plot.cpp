#include "tools/telesplat/sweep/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/utf8.h"
#include "tools/common/text_table.h"

namespace telesplat::launcher {
namespace {

// Pixels of SVG.
constexpr double kLeft = 46, kRight = 8, kTop = 20, kBottom = 22, kHeight = 110;
constexpr double kLeastCategory = 62, kSeries = 15, kGap = 14, kWhisker = 3;
constexpr double kLetter = 6.2, kMostLetters = 24;  // of a category's name
constexpr double kAlike = 1e-9;
constexpr double kBeside = 7;  // between lines, so that their whiskers do not cover each other

double column_width(const Plot& plot) {
  double letters = 0;
  for (const std::string& name : plot.categories)
    letters = std::max(letters, std::min(double(name.size()), kMostLetters));
  return std::max({kLeastCategory, letters * kLetter + kGap, double(plot.series.size()) * kSeries + kGap});
}

class Drawing {
 public:
  Drawing(const Plot& plot, const Scale& scale) : plot_(plot), scale_(scale), column_(column_width(plot)) {
    width_ = kLeft + column_ * double(plot.categories.size()) + kRight;
  }

  std::string svg() {
    out_ = fmt::format(
        "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\">",
        width_, kTop + kHeight + kBottom, escaped(plot_.title));
    if (!plot_.title.empty()) add("<text class=\"t\" x=\"{:.1f}\" y=\"12\">{}</text>", kLeft, escaped(plot_.title));
    draw_axes();
    for (size_t s = 0; s < plot_.series.size(); ++s) draw_series(s);
    return out_ + "</svg>";
  }

 private:
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    out_ += fmt::format(format, std::forward<Args>(args)...);
  }
  double y(double value) const {
    const double share = (value - scale_.low) / (scale_.high - scale_.low);
    return kTop + kHeight * (1 - std::clamp(share, 0.0, 1.0));
  }
  double x(size_t category, size_t series) const {
    const double middle = kLeft + column_ * (double(category) + 0.5);
    return middle + (plot_.lines ? kBeside : kSeries) * (double(series) - (double(plot_.series.size()) - 1) / 2);
  }

  void draw_axes() {
    for (double v = scale_.low; v < scale_.high + scale_.step / 2; v += scale_.step) {
      add("<line class=\"g\" x1=\"{0:.1f}\" x2=\"{1:.1f}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>", kLeft, width_ - kRight,
          y(v));
      // 0 is 0, and not what adding up leaves of it.
      add("<text class=\"n\" x=\"{:.1f}\" y=\"{:.1f}\">{:.6g}</text>", kLeft - 5, y(v) + 3.5,
          std::abs(v) < scale_.step / 100 ? 0.0 : v);
    }
    const auto letters = size_t(std::max(4.0, column_ / kLetter));
    for (size_t c = 0; c < plot_.categories.size(); ++c)
      add("<text class=\"k\" x=\"{:.1f}\" y=\"{:.1f}\">{}<title>{}</title></text>", kLeft + column_ * (double(c) + 0.5),
          kTop + kHeight + 15, escaped(tools::shortened(plot_.categories[c], letters)), escaped(plot_.categories[c]));
  }

  void draw_series(size_t s) {
    const PlotSeries& series = plot_.series[s];
    if (plot_.lines) {
      std::string points;
      for (size_t c = 0; c < series.points.size(); ++c)
        if (series.points[c]) points += fmt::format("{:.1f},{:.1f} ", x(c, s), y(series.points[c]->median));
      add("<polyline class=\"l c{}\" points=\"{}\"/>", series.colour, points);
    }
    for (size_t c = 0; c < series.points.size(); ++c)
      if (series.points[c]) draw_point(*series.points[c], x(c, s), series.colour);
  }

  void draw_point(const PlotPoint& p, double at, int colour) {
    add("<g class=\"p c{}{}\" tabindex=\"0\" data-tip=\"{}\">", colour, p.noisy ? " noisy" : "", escaped(p.tip));
    if (plot_.lines)
      add("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\"/>", at, y(p.median));
    else
      add("<rect class=\"b\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>", at - kSeries / 2 + 1,
          y(p.median), kSeries - 2, std::max(0.5, y(scale_.low) - y(p.median)));
    const double low = y(p.least), high = y(p.most);
    add("<path class=\"w\" d=\"M{0:.1f} {2:.1f}H{1:.1f}M{3:.1f} {2:.1f}V{4:.1f}M{0:.1f} {4:.1f}H{1:.1f}\"/>",
        at - kWhisker, at + kWhisker, low, at, high);
    // What can be pointed at is larger than what is seen.
    add("<rect class=\"h\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/></g>", at - kSeries / 2,
        std::min(high, y(p.median)) - 6, kSeries,
        (plot_.lines ? std::max(low, y(p.median)) + 12 : y(scale_.low) + 6) - std::min(high, y(p.median)));
  }

  const Plot& plot_;
  const Scale& scale_;
  double column_, width_ = 0;
  std::string out_;
};

}  // namespace

Scale scale_of(double least, double most, bool from_zero) {
  if (from_zero) least = std::min(least, 0.0), most = std::max(most, 0.0);
  // What differs by rounding alone is one value: an axis cannot tell it apart.
  if (!(most - least > kAlike * std::max(std::abs(least), std::abs(most)))) {
    const double around = most != 0 ? std::abs(most) / 2 : 1;
    most += around;
    if (!from_zero) least -= around;
  }
  const double rough = (most - least) / 4, power = std::pow(10, std::floor(std::log10(rough)));
  double step = power;
  for (const double times : {2.0, 5.0, 10.0})
    if (step < rough * 0.999) step = power * times;
  return {std::floor(least / step + 1e-9) * step, std::ceil(most / step - 1e-9) * step, step};
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : to_utf8(text)) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else if (c == '\n')
      out += "&#10;";
    else if (static_cast<unsigned char>(c) >= ' ')
      out += c;
  }
  return out;
}

std::string to_svg(const Plot& plot, const Scale& scale) { return Drawing(plot, scale).svg(); }

}  // namespace telesplat::launcher
