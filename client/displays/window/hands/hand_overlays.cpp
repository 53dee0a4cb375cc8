#include "client/displays/window/hands/hand_overlays.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <iterator>
#include <utility>

#include "common/core/within.h"
#include "common/image/canvas.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kMarkGround = 0xa0101418, kMarkInk = 0xfff0f0f0, kMarkRim = 0xff101418;
// People who do not see red or green can tell them apart (Okabe and Ito 2008: vermillion, bluish green, sky blue).
constexpr uint32_t kAxes[3] = {0xffd55e00, 0xff009e73, 0xff56b4e9};
constexpr int kPadding = 4;  // dots of a letter

constexpr const char* kNames[] = {"axes", "scale", "cursor", "fps"};
constexpr double kDraw_s = 0.05, kCount_s = 0.5;
constexpr int kGap = 4;  // pixels between pictures

// Stacks pictures one below the other, at the left.
image::View stack(const std::vector<image::View>& pictures) {
  int width = 1, height = -kGap;
  for (const auto& p : pictures) width = std::max(width, p.width), height += p.height + kGap;
  image::Canvas canvas(width, std::max(height, 1), 0);
  int y = 0;
  for (const auto& p : pictures) {
    canvas.place(p, 0, y);
    y += p.height + kGap;
  }
  return canvas.view();
}

}  // namespace

void draw_line(image::View& view, glm::dvec2 a, glm::dvec2 b, double thickness, uint32_t colour) {
  const glm::dvec2 along = b - a;
  const double length2 = std::max(glm::dot(along, along), 1e-9), length = std::sqrt(length2);
  const double lo_y = std::min(a.y, b.y) - thickness, hi_y = std::max(a.y, b.y) + thickness;
  const double lo_x = std::min(a.x, b.x) - thickness, hi_x = std::max(a.x, b.x) + thickness;
  // In each row, only pixels near the crossing with the line are tested.
  const bool level = std::abs(along.y) <= 1e-6 * length;
  const double reach = level ? hi_x - lo_x : thickness * length / std::abs(along.y);
  for (int y = std::max(int(lo_y), 0); y < std::min(int(hi_y) + 1, view.height); ++y) {
    const double at = level ? a.x : a.x + along.x * ((y + 0.5 - a.y) / along.y);
    const double from = std::max(lo_x, std::min(at - reach, hi_x)), to = std::min(hi_x, std::max(at + reach, lo_x));
    for (int x = std::max(int(from), 0); x < std::min(int(to) + 1, view.width); ++x) {
      const glm::dvec2 p(x + 0.5, y + 0.5);
      const double t = within(glm::dot(p - a, along) / length2, 0.0, 1.0);
      if (glm::distance(p, a + t * along) <= thickness / 2)
        view.colour[size_t(y) * size_t(view.width) + size_t(x)] = colour;
    }
  }
}

image::View axes_picture(const geometry::Camera& camera, const SceneTerms& terms, int side) {
  image::Canvas canvas(side, side, kMarkGround);
  image::View out = canvas.view();
  const glm::dmat3 to_camera(glm::mat3_cast(glm::conjugate(camera.pose.orientation)));
  std::array<glm::dvec3, 3> seen;
  for (int axis = 0; axis < 3; ++axis)
    seen[size_t(axis)] = to_camera * glm::normalize(glm::dvec3(terms.placement.data_to_room[axis]));
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](int a, int b) { return seen[size_t(a)].z < seen[size_t(b)].z; });
  const int scale = std::max(1, side / 48);
  const double reach = side * 0.36;
  const glm::dvec2 middle(side / 2.0, side / 2.0);
  for (const int axis : order) {
    const glm::dvec3& d = seen[size_t(axis)];
    const glm::dvec2 end = middle + reach * glm::dvec2(d.x, -d.y);
    draw_line(out, middle, end, side / 16.0 + 2, kMarkRim);
    draw_line(out, middle, end, side / 16.0, kAxes[axis]);
    image::Canvas letter(image::kGlyphWidth * scale, image::kGlyphHeight * scale, 0);
    letter.text(0, 0, std::string(1, scene::axis_letters(terms.placement.coordinates.space)[axis]), kMarkInk, scale);
    const glm::dvec2 at = middle + (reach + side * 0.08) * glm::dvec2(d.x, -d.y);
    image::blend(out, letter.view(), int(at.x) - image::kGlyphWidth * scale / 2,
                 int(at.y) - image::kGlyphHeight * scale / 2);
  }
  return out;
}

double middle_depth_m(const geometry::Camera& camera, const geometry::Box& box_room) {
  const glm::dvec3 ahead = camera.pose.orientation * glm::dvec3(0, 0, -1);
  return glm::dot(ahead, glm::dvec3(box_room.centre()) - camera.pose.position_room);
}

std::optional<ScaleBar> scale_bar(const geometry::Camera& camera, const SceneTerms& terms, double depth_m, int width) {
  if (!(depth_m > camera.near_m) || width < 1) return std::nullopt;
  const glm::dvec3 right = camera.pose.orientation * glm::dvec3(depth_m / camera.focal_x(), 0, 0);
  const double units_a_pixel = terms.placement.length_of(right);
  const double most = units_a_pixel * width;
  if (!(most > 0) || !std::isfinite(most)) return std::nullopt;
  const double power = std::pow(10, std::floor(std::log10(most)));
  double length = power;
  for (const double factor : {2.0, 5.0})
    if (factor * power <= most) length = factor * power;
  return ScaleBar{length, length / units_a_pixel, scene::length_text(length, terms.placement.unit)};
}

image::View scale_picture(const ScaleBar& bar, int scale) {
  const int padding = kPadding * scale, text = image::text_width(bar.text, scale);
  const int width = std::max(int(std::ceil(bar.pixels)), text) + 2 * padding;
  image::Canvas canvas(width, image::kGlyphHeight * scale + 3 * padding + 2 * scale, kMarkGround);
  canvas.text((width - text) / 2, padding, bar.text, kMarkInk, scale);
  image::View out = canvas.view();
  const double y = out.height - padding - scale, left = (width - bar.pixels) / 2, right = (width + bar.pixels) / 2;
  draw_line(out, {left, y}, {right, y}, scale, kMarkInk);
  for (const double x : {left, right}) draw_line(out, {x, y - 2 * scale}, {x, y + scale}, scale, kMarkInk);
  return out;
}

std::vector<std::string> cursor_lines(const std::optional<scene::ToldPlace>& place, const SceneTerms& terms) {
  if (!place) return {"nothing under the cursor"};
  std::vector<std::string> out{scene::place_text(terms.placement, place->data)};
  if (std::string value = scene::value_text(*place); !value.empty()) out.push_back(std::move(value));
  return out;
}

Status HandOverlays::show(const std::string& name, bool on) {
  bool found = false;
  for (const char* known : kNames) {
    if (name != "all" && name != known) continue;
    found = true;
    if (on)
      shown_.insert(known);
    else
      shown_.erase(known);
  }
  if (found) return ok_status();
  return Error{fmt::format("\"{}\" is none of axes, scale, cursor, fps and all", name.substr(0, 40))};
}

std::map<std::string, std::string> HandOverlays::values() const {
  std::map<std::string, std::string> out;
  for (const char* name : kNames) out[name] = shows(name) ? "on" : "off";
  return out;
}

void HandOverlays::toggle_all() {
  const bool on = shown_.size() < std::size(kNames);
  if (const Status s = show("all", on); !s) return;
}

void HandOverlays::on_pick(const std::optional<Pick>& pick) {
  place_ = pick && terms_ ? std::optional(meaning_of(*pick, *terms_)) : std::nullopt;
}

void HandOverlays::on_frame(double now_s, uint64_t frames) {
  if (now_s - counted_s_ < kCount_s) return;
  fps_ = frames > counted_ ? double(frames - counted_) / (now_s - counted_s_) : 0;
  counted_s_ = now_s;
  counted_ = frames;
}

// Equal states mean equal pictures.
std::string HandOverlays::state(const geometry::Camera& camera) const {
  std::string out;
  for (const auto& name : shown_) out += name + " ";
  const auto& [p, q] = camera.pose;
  if (shows("axes")) out += fmt::format("{} {} {} {} ", q.w, q.x, q.y, q.z);
  if (shows("scale")) out += fmt::format("{} {} {} {} {} ", p.x, p.y, p.z, camera.focal_x(), camera.width);
  if (shows("cursor") && place_) out += fmt::format("{} {} {} ", place_->data.x, place_->data.y, place_->data.z);
  if (shows("fps")) out += fmt::format("{:.0f}", fps_);
  return out;
}

image::View HandOverlays::picture(const geometry::Camera& camera, const geometry::Box& box_room) const {
  const int scale = within(camera.height / 400, 1, 4);
  std::vector<std::string> lines;
  if (shows("fps")) lines.push_back(fmt::format("{:.0f} fps", fps_));
  if (shows("cursor"))
    for (auto& line : cursor_lines(place_, *terms_)) lines.push_back(std::move(line));
  std::vector<image::View> parts;
  if (!lines.empty()) parts.push_back(panel_(lines, scale));
  if (shows("axes")) parts.push_back(axes_picture(camera, *terms_, 56 * scale));
  if (shows("scale"))
    if (const auto bar = scale_bar(camera, *terms_, middle_depth_m(camera, box_room), camera.width / 4))
      parts.push_back(scale_picture(*bar, scale));
  return stack(parts);
}

std::optional<image::View> HandOverlays::update(double now_s, const geometry::Camera& camera,
                                                const geometry::Box& box_room) {
  if (shown_.empty() || !terms_ || box_room.empty())
    return std::exchange(drawn_, std::string()).empty() ? std::nullopt : std::optional<image::View>(image::View{});
  if (now_s - drawn_s_ < kDraw_s) return std::nullopt;
  std::string now = state(camera);
  if (now == drawn_) return std::nullopt;
  drawn_ = std::move(now);
  drawn_s_ = now_s;
  return picture(camera, box_room);
}

}  // namespace telesplat::viewer
