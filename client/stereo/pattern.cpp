#include "client/stereo/pattern.h"

#include <algorithm>

#include "common/image/canvas.h"

namespace telesplat::stereo {
namespace {

constexpr uint32_t kWhite = 0xffffffffu, kRed = 0xffff0000u, kBlue = 0xff0000ffu;
constexpr uint32_t kGround = 0xff202020u, kLine = 0xff808080u;
constexpr int kColumns = 16, kRows = 10;

void fill(image::View& view, const geometry::Rect& rect, uint32_t colour) {
  for (int y = std::max(0, rect.y); y < std::min(view.height, rect.y + rect.height); ++y)
    for (int x = std::max(0, rect.x); x < std::min(view.width, rect.x + rect.width); ++x)
      view.colour[size_t(y) * size_t(view.width) + size_t(x)] = colour;
}

image::View calibration(int width, int height, uint32_t colour) {
  image::View view{width, height, std::vector<uint32_t>(size_t(width) * size_t(height), colour), {}};
  const int arm = std::max(1, std::min(width, height) / 6), thick = std::max(1, std::min(width, height) / 100);
  fill(view, {width / 2 - arm, height / 2 - thick / 2, 2 * arm, thick}, kWhite);
  fill(view, {width / 2 - thick / 2, height / 2 - arm, thick, 2 * arm}, kWhite);
  return view;
}

image::View test(int width, int height, const char* name, uint32_t colour, bool upper) {
  image::Canvas canvas(width, height, kGround);
  image::View view = canvas.view();
  const int thick = std::max(1, height / 400);
  for (int i = 1; i < kColumns; ++i) fill(view, {i * width / kColumns, 0, thick, height}, kLine);
  for (int i = 1; i < kRows; ++i) fill(view, {0, i * height / kRows, width, thick}, kLine);
  // Both eyes' halves together make a frame around the middle.
  const int bar = std::max(2, height / 40);
  fill(view, {width / 4, upper ? height / 4 : 3 * height / 4 - bar, width / 2, bar}, colour);
  image::Canvas named(width, height, kGround);
  named.place(view, 0, 0);
  const int scale = std::max(1, width / (12 * image::kGlyphAdvance));
  named.text((width - image::text_width(name, scale)) / 2,
             (upper ? height * 3 / 8 : height * 5 / 8) - image::kGlyphHeight * scale / 2, name, colour, scale);
  return named.view();
}

}  // namespace

const std::vector<std::string>& pattern_names() {
  static const std::vector<std::string> names{"off", "calibration", "test"};
  return names;
}

std::optional<Pattern> pattern_named(std::string_view name) {
  const auto& names = pattern_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return Pattern(found - names.begin());
}

std::array<image::View, 2> eye_patterns(Pattern pattern, int width, int height) {
  if (pattern == Pattern::kCalibration) return {calibration(width, height, kRed), calibration(width, height, kBlue)};
  return {test(width, height, "LEFT", 0xffffb000u, true), test(width, height, "RIGHT", 0xff40b0ffu, false)};
}

}  // namespace telesplat::stereo
