#include "client/displays/xr/xr_surface.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "client/displays/xr/hands.h"
#include "client/viewer/display/frame_table.h"
#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

// Share of a refresh period that both eyes may take to draw.
constexpr double kDrawingShare = 0.6, kShortest_s = 1.0 / 1000;
constexpr double kIdle_s = 0.02, kOpenAgain_s = 1.0, kLeave_s = 2.0;
constexpr uint32_t kHandColours[]{0x56b4e9, 0xe69f00};  // left, right; all people can tell them apart
constexpr const char* kHandNames[]{"left", "right"};

void sleep_s(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

}  // namespace

Result<std::unique_ptr<XrSurface>> XrSurface::open(const XrOptions& options, double near_m, Tell tell) {
  std::unique_ptr<XrSurface> out(new XrSurface(options, near_m, std::move(tell)));
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  out->context_ = std::move(*context);
  if (const Status s = out->open_system(); !s) return s.error();
  return out;
}

XrSurface::~XrSurface() {
  if (!session_) return;
  const gl::EglContext::Current current(*context_);
  session_->request_exit();
  for (const double until_s = monotonic_s() + kLeave_s;
       monotonic_s() < until_s && !session_->over() && !session_->quits() && session_->running();) {
    session_->poll();
    if (!session_->running()) break;
    const auto frame = session_->begin_frame();
    if (frame) session_->end_frame(*frame, nullptr);
  }
  session_->poll();
  session_.reset();
}

Status XrSurface::open_system() {
  const gl::EglContext::Current current(*context_);
  system_.reset();
  auto opened = XrSystem::open();
  if (!opened) return opened.error();
  system_ = std::move(*opened);
  return ok_status();
}

void XrSurface::open_session() {
  if (monotonic_s() < open_at_s_) return;
  open_at_s_ = monotonic_s() + kOpenAgain_s;
  // The same trouble is reported once, not every second.
  const auto fails = [&](const std::string& text) {
    if (text != std::exchange(trouble_, text)) tell_(fmt::format("no headset: {}; trying again every second", text));
  };
  if (lost_)
    if (const Status s = open_system(); !s) return fails(s.error().text);
  const gl::EglContext::Current current(*context_);
  auto opened = HeadsetSession::open(*system_, *context_, options_, near_m_);
  if (!opened) {
    lost_ = true;
    return fails(opened.error().text);
  }
  session_ = std::move(*opened);
  trouble_.clear();
  tell_(fmt::format("headset: {}, {}x{} pixels an eye{}", system_->name(), session_->width(), session_->height(),
                    session_->takes_depth() ? ", with depth" : ""));
  jumped_ = true;
  last_display_s_ = 0;
}

// Serves the session. True if it shows frames.
bool XrSurface::follow_session() {
  if (!session_) open_session();
  if (!session_) return false;
  const gl::EglContext::Current current(*context_);
  session_->poll();
  for (const auto& line : session_->take_news()) tell_(line);
  quits_ = quits_ || session_->quits();
  if (quits_ || !session_->over()) return !quits_ && session_->running();
  session_.reset();
  lost_ = true;
  open_at_s_ = monotonic_s() + kOpenAgain_s;
  return false;
}

bool XrSurface::ready() {
  located_.reset();
  if (follow_session()) return begin();
  if (!quits_) sleep_s(kIdle_s);
  return false;
}

// Waits for the runtime. A frame without eyes, or one that is not shown, ends at once.
bool XrSurface::begin() {
  const gl::EglContext::Current current(*context_);
  const auto begun = session_->begin_frame();
  if (!begun) return false;
  frame_ = *begun;
  if (frame_.discarded) log::debug("the runtime discarded a frame");
  missed_ = refreshes_missed(last_display_s_, frame_.display_s, frame_.period_s);
  last_display_s_ = frame_.display_s;
  jumped_ = session_->take_recentring() || jumped_;
  located_s_ = monotonic_s();
  located_ = session_->locate_eyes(frame_.display_time);
  if (!located_ || !frame_.renders) {
    located_.reset();
    session_->end_frame(frame_, nullptr);
    return false;
  }
  pace_.follow(alike(located_->cameras), frame_.period_s);
  camera_ = both_eyes(located_->cameras);
  head_ = session_->locate_head(frame_.display_time).value_or(camera_.pose);
  return true;
}

// A pair takes another share of a frame's time than two pictures. Runtimes' periods differ a little between frames.
void EyePace::follow(bool pair, double period_s) {
  if (pictures_a_second_ > 0 && (pair || !as_pair_)) return;
  as_pair_ = pair;
  pictures_a_second_ = (pair ? 1 : 2) / (kDrawingShare * std::max(period_s, kShortest_s));
}

// The runtime predicts the head better than poses do: it knows more about it.
std::optional<ExpectedHead> XrSurface::expected(double at_s) {
  if (!session_ || at_s <= frame_.display_s) return std::nullopt;
  const auto head = session_->locate_head(frame_.display_time);
  const auto then = session_->locate_head(system_->to_time(at_s));
  if (!head || !then) return std::nullopt;
  // camera_ keeps its place beside the head.
  const glm::dquat turn = then->orientation * glm::conjugate(head->orientation);
  return ExpectedHead{at_s,
                      {then->position_room + turn * (camera_.pose.position_room - head->position_room),
                       glm::normalize(turn * camera_.pose.orientation)}};
}

void XrSurface::present_eyes(std::array<image::View, 2>& views) {
  const gl::EglContext::Current current(*context_);
  const HandRays rays = session_->locate_hands(frame_.display_time);
  pointers_.point(rays, views[0], located_->cameras[0], tell_);  // both eyes see rays that end at one place
  for (size_t eye = 0; eye < 2; ++eye) {
    pointers_.draw(rays, views[eye], located_->cameras[eye]);
    session_->put(int(eye), views[eye]);
  }
  session_->end_frame(frame_, &*located_);
}

void HandPointers::draw(const HandRays& rays, image::View& view, const geometry::Camera& camera) const {
  for (size_t hand = 0; hand < rays.size(); ++hand)
    if (rays[hand]) draw_line(view, camera, rays[hand]->pose.position_room, ends_[hand], kHandColours[hand]);
}

void HandPointers::point(const HandRays& rays, const image::View& view, const geometry::Camera& camera,
                         const Tell& tell) {
  for (size_t hand = 0; hand < rays.size(); ++hand) {
    const bool pressed = rays[hand] && rays[hand]->pressed, before = std::exchange(pressed_[hand], pressed);
    const bool begins = pressed && !before;
    if (!rays[hand]) continue;
    const geometry::Pose& pose = rays[hand]->pose;
    const glm::dvec3 along = pose.orientation * glm::dvec3(0, 0, -1);
    const auto hit = first_hit(view, camera, pose.position_room, along);
    ends_[hand] = hit.value_or(pose.position_room + kFarthest_m * along);
    if (!begins) continue;
    tell(hit ? fmt::format("the {} hand points at {:.3f},{:.3f},{:.3f} in the room", kHandNames[hand], hit->x, hit->y,
                           hit->z)
             : fmt::format("the {} hand points at nothing", kHandNames[hand]));
  }
}

// A frame that is handed over late is shown at a later refresh.
void XrSurface::measure(Seen& seen, double presented_s) {
  const double period_s = frame_.period_s, lead_s = frame_.display_s - presented_s;
  const double late_s = lead_s < 0 && period_s > 0 ? std::ceil(-lead_s / period_s) * period_s : 0;
  seen = {frame_.display_s + late_s, period_s, lead_s, missed_};
}

// The options take over the size of a headset's pictures. Eyes never stand still, so there are no still pictures.
Result<std::unique_ptr<DisplaySurface>> open_headset(ViewerOptions& o, const DisplayHelp& help) {
  auto opened = XrSurface::open(o.xr.options, o.display.near_m, help.tell);
  if (!opened) return Error{"--xr: " + opened.error().text};
  o.display.width = (*opened)->eye_size().width;
  o.display.height = (*opened)->eye_size().height;
  o.display.still_samples = 1;
  return std::unique_ptr<DisplaySurface>(std::move(*opened));
}

}  // namespace telesplat::viewer
