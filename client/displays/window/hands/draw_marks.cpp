// Draws measurements into the picture: a cross at each place, a line between neighbours, numbers beside them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "client/displays/window/hands/hand_overlays.h"
#include "client/viewer/hands/measurements.h"
#include "common/image/canvas.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kGround = 0xc0101418, kInk = 0xfff0f0f0, kRim = 0xff101418;
constexpr uint32_t kMark = 0xfff0e442;  // yellow of Okabe and Ito's palette
constexpr int kCross = 5;               // half a cross, dots of a letter

struct Line {
  glm::dvec2 from, to;
};
struct Label {
  glm::dvec2 at;  // its middle
  std::string text;
};
struct Marks {
  std::vector<glm::dvec2> places;
  std::vector<Line> lines;
  std::vector<Label> labels;
};

// Projects a place in front of the near plane to pixels. Nothing: it lies behind that plane.
std::optional<glm::dvec2> seen(const geometry::Camera& camera, const glm::dvec3& room) {
  const auto [x, y, w] = camera.room_to_pixel();
  const glm::dvec4 h(room, 1);
  const double depth_m = glm::dot(w, h);
  if (!(depth_m > camera.near_m)) return std::nullopt;
  return glm::dvec2(glm::dot(x, h), glm::dot(y, h)) / depth_m;
}

// Returns the part of a line in a rectangle from 0 to `size` (Liang and Barsky 1984).
std::optional<Line> clipped(const Line& line, const glm::dvec2& size) {
  const glm::dvec2 along = line.to - line.from;
  double begin = 0, end = 1;
  for (int a = 0; a < 2; ++a) {
    if (along[a] == 0) {
      if (line.from[a] < 0 || line.from[a] > size[a]) return std::nullopt;
      continue;
    }
    const double lo = -line.from[a] / along[a], hi = (size[a] - line.from[a]) / along[a];
    begin = std::max(begin, std::min(lo, hi)), end = std::min(end, std::max(lo, hi));
  }
  if (begin >= end) return std::nullopt;
  return Line{line.from + begin * along, line.from + end * along};
}

Marks marks_of(const Measurements& measurements, const geometry::Camera& camera, int scale) {
  Marks out;
  const glm::dvec2 size(camera.width, camera.height);
  const double aside = (kCross + 4) * scale;
  for (const auto& row : measurements.rows()) {
    std::vector<scene::ToldPlace> places;
    for (const auto& place : row) places.push_back(place.told);
    const scene::Measured m = scene::measure(places, measurements.placement());
    std::optional<glm::dvec2> before;
    for (size_t i = 0; i < row.size(); ++i) {
      const auto at = seen(camera, row[i].told.room);
      if (at && glm::all(glm::greaterThanEqual(*at, glm::dvec2(0))) && glm::all(glm::lessThan(*at, size))) {
        out.places.push_back(*at);
        std::string text = std::to_string(row[i].number);
        // The angle at a place belongs to it and both of its neighbours.
        if (i > 0 && i + 1 < row.size() && std::isfinite(m.angles_deg[i - 1]))
          text += fmt::format("  {:.1f} deg", m.angles_deg[i - 1]);
        out.labels.push_back({*at + glm::dvec2(0, -aside), text});
      }
      if (at && before)
        if (const auto line = clipped({*before, *at}, size)) {
          out.lines.push_back(*line);
          out.labels.push_back(
              {(line->from + line->to) * 0.5, scene::length_text(m.distances[i - 1], measurements.placement().unit)});
        }
      before = at;
    }
  }
  return out;
}

}  // namespace

MarksPicture draw_marks(const Measurements& measurements, const geometry::Camera& camera, int scale) {
  const Marks marks = marks_of(measurements, camera, scale);
  const int padding = 2 * scale, text_height = image::kGlyphHeight * scale + 2 * padding;
  // The rectangle that holds all marks, within the window.
  glm::dvec2 lo(1e9), hi(-1e9);
  const auto add = [&](const glm::dvec2& at, const glm::dvec2& half) {
    lo = glm::min(lo, at - half), hi = glm::max(hi, at + half);
  };
  for (const auto& place : marks.places) add(place, glm::dvec2((kCross + 2) * scale));
  for (const auto& line : marks.lines) add(line.from, glm::dvec2(3 * scale)), add(line.to, glm::dvec2(3 * scale));
  for (const auto& label : marks.labels)
    add(label.at, glm::dvec2(image::text_width(label.text, scale) / 2 + padding + 1, text_height / 2 + 1));
  lo = glm::floor(glm::max(lo, glm::dvec2(0))), hi = glm::ceil(glm::min(hi, glm::dvec2(camera.width, camera.height)));
  if (lo.x >= hi.x || lo.y >= hi.y) return {};
  MarksPicture out{image::Canvas(int(hi.x - lo.x), int(hi.y - lo.y), 0).view(), int(lo.x), int(lo.y)};
  for (const int part : {3, 1})  // a dark rim below, for contrast on every ground
    for (const auto& line : marks.lines)
      draw_line(out.view, line.from - lo, line.to - lo, part * scale, part == 1 ? kMark : kRim);
  for (const int part : {3, 1})
    for (const auto& place : marks.places)
      for (const glm::dvec2 arm : {glm::dvec2(kCross * scale, 0), glm::dvec2(0, kCross * scale)})
        draw_line(out.view, place - lo - arm, place - lo + arm, part * scale, part == 1 ? kMark : kRim);
  for (const auto& label : marks.labels) {
    const int width = image::text_width(label.text, scale);
    image::Canvas text(width + 2 * padding, text_height, kGround);
    text.text(padding, padding, label.text, kInk, scale);
    const glm::dvec2 at = label.at - lo - glm::dvec2(text.view().width, text.view().height) * 0.5;
    image::blend(out.view, text.view(), int(std::floor(at.x)), int(std::floor(at.y)));
  }
  return out;
}

}  // namespace telesplat::viewer
