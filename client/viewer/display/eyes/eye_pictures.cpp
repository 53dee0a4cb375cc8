#include "client/viewer/display/eyes/eye_pictures.h"

#include <filesystem>
#include <utility>

#include "client/viewer/render/renderer.h"
#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

constexpr double kLookAfterPanel_s = 0.5;

}  // namespace

// A person who calibrates a panel edits its file and sees the result at once.
void EyePictures::follow_panel_file(double now_s) {
  const auto& o = rig_.options();
  if (!o.panel || o.panel_file.empty() || now_s - looked_s_ < kLookAfterPanel_s) return;
  const bool first = looked_s_ < 0;
  looked_s_ = now_s;
  std::error_code error;
  const auto written = std::filesystem::last_write_time(o.panel_file, error).time_since_epoch().count();
  if (error || written == panel_time_) return;
  panel_time_ = written;
  if (first) return;
  if (const Status s = rig_.read_panel_again(); !s)
    log::warn("{}", s.error().text);
  else
    log::info("{} was read again", o.panel_file), panel_changed_ = true;
}

geometry::Camera EyePictures::begin(double now_s, const geometry::Camera& head, const glm::dquat& turned, double t_s,
                                    const geometry::Box& scene_room) {
  follow_panel_file(now_s);
  pair_ = rig_.eyes(head, turned, t_s, scene_room);
  return EyeRig::sampled(pair_, scene_room);
}

geometry::Camera EyePictures::sampled(const geometry::Camera& head, const glm::dquat& turned, double t_s,
                                      const geometry::Box& scene_room) {
  return EyeRig::sampled(rig_.eyes(head, turned, t_s, scene_room), scene_room);
}

// Places of both pictures in a display that has one beside or above the other.
std::array<splat::FrameTarget, 2> EyePictures::parts_of(image::View& view) const {
  const int width = pair_.head.width, height = pair_.head.height;
  const bool beside = rig_.options().mode != stereo::Mode::kTopBottom;
  const size_t pitch = size_t(view.width), second = beside ? size_t(width) : pitch * size_t(height);
  std::array<splat::FrameTarget, 2> out{splat::FrameTarget{width, height, view.colour.data(), nullptr, pitch},
                                        {width, height, view.colour.data() + second, nullptr, pitch}};
  if (rig_.options().swap_eyes) std::swap(out[0].colour, out[1].colour);
  return out;
}

DrawnFrame EyePictures::draw(ViewSource& source, FrameInput input, bool spooled, image::View& view) {
  input.camera = pair_.head;
  const auto size = rig_.composed_size(pair_.head.width, pair_.head.height);
  const auto& o = rig_.options();
  const bool same_size = view.width == size.width && view.height == size.height;
  input.intact = input.intact && same_size;
  const bool halves =
      o.mode == stereo::Mode::kSideBySide || o.mode == stereo::Mode::kTopBottom || o.mode == stereo::Mode::kQuadBuffer;
  if (halves && source.draws_into_parts() && !input.with_depth && !input.with_coverage &&
      o.pattern == stereo::Pattern::kNone) {
    view.width = size.width, view.height = size.height;
    view.colour.resize(size_t(size.width) * size_t(size.height));
    return source.draw_pair(input, pair_.eyes, parts_of(view));
  }
  std::array<splat::FrameTarget, 2> targets;
  for (size_t i = 0; i < 2; ++i) {
    image::View& eye = views_[i];
    input.intact = input.intact && eye.width == pair_.head.width && eye.height == pair_.head.height;
    fit(eye, pair_.head, spooled);
    targets[i] = {eye.width, eye.height, eye.colour.data(), input.with_depth ? eye.depth_m.data() : nullptr};
  }
  DrawnFrame drawn = source.draw_pair(input, pair_.eyes, targets);
  if (drawn.empty && !input.even_empty) return drawn;
  if (rig_.draw_pattern(views_) || std::exchange(panel_changed_, false)) drawn.changed = true, drawn.still = false;
  if (drawn.changed || !input.intact) rig_.compose(pair_, views_, input.with_depth, view);
  return drawn;
}

EyePictures::Aim EyePictures::aim(const geometry::Camera& head, const EyePair& pair, const glm::dvec2& share) const {
  if (!on()) return {head, share * glm::dvec2(head.width, head.height)};
  const auto& o = rig_.options();
  const bool beside = o.mode == stereo::Mode::kSideBySide || o.mode == stereo::Mode::kSideBySideHalf;
  const bool above = o.mode == stereo::Mode::kTopBottom || o.mode == stereo::Mode::kTopBottomHalf;
  const glm::dvec2 size(pair.head.width, pair.head.height);
  if (!beside && !above) return {pair.head, share * size};
  const bool second = beside ? share.x >= 0.5 : share.y >= 0.5;
  const glm::dvec2 parts(beside ? 2 : 1, above ? 2 : 1), begin(second && beside, second && above);
  return {pair.eyes[second != o.swap_eyes ? 1 : 0], (share * parts - begin) * size};
}

geometry::Camera EyePictures::display(const geometry::Camera& head) const {
  geometry::Camera out = head;
  if (!on() || rig_.options().mode == stereo::Mode::kQuadBuffer) return out;
  const stereo::Size size = rig_.composed_size(head.width, head.height);
  out.width = size.width, out.height = size.height;
  return out;
}

void EyePictures::keep(FrameSpool& spool, const SpooledFrame& frame) {
  for (size_t i = 0; i < views_.size(); ++i) {
    SpooledFrame eye = frame;
    eye.use = kVerify;
    eye.eye = uint32_t(i + 1);
    eye.camera = pair_.eyes[i];
    eye.view = std::move(views_[i]);
    eye.legend = nullptr;
    views_[i] = spool.exchange(std::move(eye));
  }
}

}  // namespace telesplat::viewer
