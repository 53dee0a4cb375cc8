#include "client/displays/window/hands/hand_overlays.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/core/within.h"
#include "common/image/canvas.h"

namespace telesplat::viewer {
namespace {

constexpr const char* kNames[] = {"axes", "scale", "cursor", "fps"};
constexpr double kDraw_s = 0.05, kCount_s = 0.5;
constexpr int kGap = 4;  // pixels between pictures

// One under the other, at the left.
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

// Two pictures of the same state are the same.
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
