#include "client/viewer/xr/xr_display.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "client/viewer/hands/errands.h"
#include "client/viewer/render/fit_view.h"
#include "client/viewer/xr/hand_rays.h"
#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

constexpr double kParallel = 1e-6, kSameFocal = 1e-4;
// Of a refresh, for drawing both eyes; the rest is for handing the pictures over, and for what else runs.
constexpr double kDrawingShare = 0.6, kShortest_s = 1.0 / 1000;
constexpr double kIdle_s = 0.02, kOpenAgain_s = 1.0, kLeave_s = 2.0, kPicturePeriod_s = 2.5;
constexpr uint32_t kHandColours[]{0x56b4e9, 0xe69f00};  // left, right; told apart by everyone
constexpr const char* kHandNames[]{"left", "right"};

void sleep_s(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

class XrDisplay {
 public:
  XrDisplay(const DisplayOptions& o, const XrOptions& xr, XrDevice& device, const XrSourceMaker& make_source,
            ViewerWorker& worker, metrics::TableRecorder& frames, metrics::SpanRecorder& spans,
            const std::function<FrameSpool*()>& spool, const std::function<void(const std::string&)>& tell)
      : o_(o),
        xr_(xr),
        device_(device),
        make_source_(make_source),
        worker_(worker),
        frames_(frames),
        spans_(spans),
        find_spool_(spool),
        tell_(tell),
        look_(first_look(o.render, o.shading)) {}

  DisplayResult run() {
    while (!last_ && result_.error.empty()) {
      if (told_to_stop()) {
        result_.interrupted = true;
        break;
      }
      // Frames that nobody sees end it too, if a little later.
      if (start_s_ > 0 && o_.duration_s > 0 && monotonic_s() > start_s_ + o_.duration_s + kOpenAgain_s) break;
      if (!session_) {
        open_session();
        continue;
      }
      session_step();
    }
    leave();
    return result_;
  }

 private:
  bool told_to_stop() const { return net::stop_requested() || worker_.shutdown_requested(); }

  void open_session() {
    if (monotonic_s() < open_at_s_) return sleep_s(kIdle_s);
    open_at_s_ = monotonic_s() + kOpenAgain_s;
    if (lost_)
      if (const Status s = device_.reopen(); !s) return tell_once(s.error().text);
    const gl::EglContext::Current current(device_.context());
    auto opened = HeadsetSession::open(device_.system(), device_.context(), xr_, o_.near_m);
    if (!opened) {
      lost_ = true;
      return tell_once(opened.error().text);
    }
    session_ = std::move(*opened);
    trouble_.clear();
    tell_(fmt::format("headset: {}, {}x{} pixels an eye{}", device_.system().name(), session_->width(),
                      session_->height(), session_->takes_depth() ? ", with depth" : ""));
    worker_.on_jump();
    last_display_s_ = 0;
  }

  // The same trouble every second is told once.
  void tell_once(const std::string& text) {
    if (text != std::exchange(trouble_, text)) tell_(fmt::format("no headset: {}; trying again every second", text));
  }

  void session_step() {
    {
      const gl::EglContext::Current current(device_.context());
      session_->poll();
    }
    for (const auto& line : session_->take_news()) tell_(line);
    if (session_->quits()) {
      result_.interrupted = last_ = true;
    } else if (session_->over()) {
      const gl::EglContext::Current current(device_.context());
      session_.reset();
      lost_ = true;
      open_at_s_ = monotonic_s() + kOpenAgain_s;
    } else if (session_->running()) {
      frame();
    } else {
      sleep_s(kIdle_s);
    }
    // Nobody waits for a headset that nobody wears.
    for (const wire::Order& order : worker_.orders().take_orders())
      worker_.orders().answer({order.number, false, order.command + ": the headset shows nothing now"});
  }

  // The runtime shall know that the application goes: states follow, for which there is little time.
  void leave() {
    const gl::EglContext::Current current(device_.context());
    source_.reset();
    if (!session_) return;
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

  // One choice of points serves both where they look the same way and their pixels are of one size; else each is
  // drawn by itself.
  static bool alike(const std::array<geometry::Camera, 2>& eyes) {
    const double turned = std::abs(glm::dot(eyes[0].pose.orientation, eyes[1].pose.orientation));
    return 1 - turned < kParallel && eyes[0].width == eyes[1].width && eyes[0].height == eyes[1].height &&
           std::abs(eyes[0].focal_x() / eyes[1].focal_x() - 1) < kSameFocal;
  }

  // What to draw from, once it is known; false: it cannot be drawn.
  bool follow_scene(double period_s) {
    auto received = worker_.received_at(Succession::kNewest);
    if (received == received_) return true;
    source_.reset();
    received_ = std::move(received);
    if (!received_) return true;
    const int pictures = as_pair_ ? 1 : 2;
    auto made = make_source_(*received_, pictures / (kDrawingShare * std::max(period_s, kShortest_s)));
    if (!made) {
      result_.error = made.error().text;
      return false;
    }
    source_ = std::move(*made);
    if (!spool_ && find_spool_) spool_ = find_spool_();
    return true;
  }

  void frame() {
    const gl::EglContext::Current current(device_.context());
    const auto begun = session_->begin_frame();
    if (!begun) return;
    MeasuredFrame m{.number = result_.frames, .start_s = start_s_, .previous_s = previous_s_};
    m.begin_s = monotonic_s();
    m.look = look_;
    count_missed(*begun, m);
    if (session_->take_recentring()) worker_.on_jump();
    const double located_s = monotonic_s();
    const auto eyes = session_->locate_eyes(begun->display_time);
    if (!eyes) return session_->end_frame(*begun, nullptr);
    // A pair has another share of a frame's time than two pictures, so its source is another one.
    if (const bool pair = alike(eyes->cameras); !received_ || (as_pair_ && !pair)) {
      as_pair_ = pair;
      received_.reset();
    }
    if (!follow_scene(begun->period_s)) return session_->end_frame(*begun, nullptr);
    left_ = eyes->cameras[0];
    follow_head(*begun, *eyes, m);
    if (!begun->renders) return session_->end_frame(*begun, nullptr);
    const bool counts = source_ && worker_.first_update_complete();
    if (counts && start_s_ == 0) m.start_s = start_s_ = m.begin_s;
    see_whether_last(counts ? m.begin_s - start_s_ : -1);
    const uint32_t use = counts ? use_of_frame(m.begin_s - start_s_) : 0;
    draw_eyes(*eyes, session_->locate_hands(begun->display_time), counts, use != 0, m);
    m.end_s = monotonic_s();
    if (counts)
      worker_.on_frame(begun->display_s, m.camera, m.drawn.epoch, m.drawn.update, false);
    else
      worker_.on_pose(begun->display_s, m.camera);
    session_->end_frame(*begun, &*eyes);
    m.presented_s = monotonic_s();
    m.lead_s = begun->display_s - m.presented_s;
    m.posed = {located_s, begun->display_s - located_s};
    m.refresh_s = begun->period_s;
    m.seen_s = seen_at(*begun, m.lead_s);
    if (!m.drawn.empty) worker_.on_first_points(m.presented_s);
    if (source_) carry_out_orders(m);
    if (counts) record(*begun, use, m);
  }

  // Places are the left eye's.
  void carry_out_orders(const MeasuredFrame& m) {
    for (const wire::Order& order : worker_.orders().take_orders()) {
      const auto done = carry_out(
          order, {.camera = left_,
                  .head = m.head,
                  .epoch = m.drawn.epoch,
                  .terms = worker_.terms(),
                  .pick = [&](double x, double y, double opacity) { return source_->pick(left_, x, y, opacity); },
                  .go = [](const geometry::Pose&) { return false; },
                  .set = [](const std::string&, const std::string&) -> Status {
                    return Error{"a headset's display keeps what it began with"};
                  }});
      worker_.orders().answer({order.number, done.ok(), done ? *done : done.error().text});
    }
  }

  void count_missed(const HeadsetSession::Frame& f, MeasuredFrame& m) {
    m.missed = refreshes_missed(last_display_s_, f.display_s, f.period_s);
    last_display_s_ = f.display_s;
  }

  // One that comes late is shown at a later refresh.
  static double seen_at(const HeadsetSession::Frame& f, double lead_s) {
    return f.display_s + (lead_s < 0 && f.period_s > 0 ? std::ceil(-lead_s / f.period_s) * f.period_s : 0);
  }

  // Poses are those of the moment at which they are seen. Where the head will be when an answer can be there is the
  // runtime's to say: it has more to tell it from than poses.
  void follow_head(const HeadsetSession::Frame& f, const HeadsetSession::Eyes& eyes, MeasuredFrame& m) {
    m.camera = both_eyes(eyes.cameras);
    m.head = m.camera.pose;
    const double ahead_s = m.begin_s + worker_.horizon_s();
    const auto head = session_->locate_head(f.display_time);
    const auto then = ahead_s > f.display_s ? session_->locate_head(device_.system().to_time(ahead_s)) : std::nullopt;
    if (head) m.head = *head;
    if (!head || !then) return;
    // both_eyes() stands still beside the head.
    const glm::dquat turn = then->orientation * glm::conjugate(head->orientation);
    worker_.on_expected(ahead_s, {then->position_room + turn * (m.camera.pose.position_room - head->position_room),
                                  glm::normalize(turn * m.camera.pose.orientation)});
  }

  void draw_eyes(const HeadsetSession::Eyes& eyes, const HandRays& rays, bool counts, bool kept, MeasuredFrame& m) {
    for (size_t eye = 0; eye < 2; ++eye) fit(views_[eye], eyes.cameras[eye], true);
    if (!source_)
      for (image::View& view : views_) {
        std::fill(view.colour.begin(), view.colour.end(), o_.shading.background);
        std::fill(view.depth_m.begin(), view.depth_m.end(), std::numeric_limits<float>::infinity());
      }
    else if (as_pair_)
      draw_pair(eyes.cameras, counts, m);
    else
      draw_each(eyes.cameras, counts, m);
    if (kept) kept_ = views_[0];  // records have no rays
    for (size_t eye = 0; eye < 2; ++eye) {
      // Where rays end is chosen in one picture, so that both eyes see the same.
      if (eye == 0) point(rays, views_[0], eyes.cameras[0]);
      for (size_t hand = 0; hand < rays.size(); ++hand)
        if (rays[hand])
          draw_line(views_[eye], eyes.cameras[eye], rays[hand]->pose.position_room, ends_[hand], kHandColours[hand]);
      session_->put(int(eye), views_[eye]);
    }
    if (counts) source_->displayed();
  }

  void draw_pair(const std::array<geometry::Camera, 2>& cameras, bool counts, MeasuredFrame& m) {
    std::array<splat::FrameTarget, 2> targets;
    for (size_t eye = 0; eye < 2; ++eye)
      targets[eye] = {views_[eye].width, views_[eye].height, views_[eye].colour.data(), views_[eye].depth_m.data()};
    m.drawn = source_->draw_pair({.begin_s = monotonic_s(),
                                  .camera = between(cameras),  // m.camera stands behind them
                                  .look = look_,
                                  .with_depth = true,
                                  .resting = !counts,
                                  .even_empty = true},
                                 cameras, targets);
  }

  void draw_each(const std::array<geometry::Camera, 2>& cameras, bool counts, MeasuredFrame& m) {
    for (size_t eye = 0; eye < 2; ++eye) {
      const DrawnFrame drawn = source_->draw({.begin_s = monotonic_s(),
                                              .camera = cameras[eye],
                                              .look = look_,
                                              .with_depth = true,
                                              .resting = !counts,
                                              .even_empty = true},
                                             views_[eye]);
      if (eye == 0)
        m.drawn = drawn;
      else
        add(drawn, m.drawn);
    }
  }

  // Both eyes are one frame of the tables.
  static void add(const DrawnFrame& other, DrawnFrame& sum) {
    sum.empty = sum.empty && other.empty;
    for (const auto figure : {&DrawnFrame::prepare_ms, &DrawnFrame::project_cpu_ms, &DrawnFrame::resolve_cpu_ms,
                              &DrawnFrame::fill_cpu_ms, &DrawnFrame::smooth_cpu_ms, &DrawnFrame::antialias_cpu_ms})
      sum.*figure += other.*figure;
    sum.selected += other.selected, sum.drawn += other.drawn, sum.items += other.items;
    sum.detail = std::min(sum.detail, other.detail);
  }

  // What controllers point at; who presses is told where that is.
  void point(const HandRays& rays, const image::View& view, const geometry::Camera& camera) {
    for (size_t hand = 0; hand < rays.size(); ++hand) {
      const bool pressed = rays[hand] && rays[hand]->pressed, before = std::exchange(pressed_[hand], pressed);
      const bool begins = pressed && !before;
      if (!rays[hand]) continue;
      const geometry::Pose& pose = rays[hand]->pose;
      const glm::dvec3 along = pose.orientation * glm::dvec3(0, 0, -1);
      const auto hit = first_hit(view, camera, pose.position_room, along);
      ends_[hand] = hit.value_or(pose.position_room + kFarthest_m * along);
      if (!begins) continue;
      tell_(hit ? fmt::format("the {} hand points at {:.3f},{:.3f},{:.3f} in the room", kHandNames[hand], hit->x,
                              hit->y, hit->z)
                : fmt::format("the {} hand points at nothing", kHandNames[hand]));
    }
  }

  void see_whether_last(double t_s) {
    if (t_s < 0) return;
    last_ = (o_.duration_s > 0 && t_s >= o_.duration_s) || (o_.frames > 0 && result_.frames + 1 >= o_.frames);
  }

  uint32_t use_of_frame(double t_s) const {
    if (!spool_) return 0;
    uint32_t use = 0;
    if (o_.picture_every ? result_.frames % o_.picture_every == 0 : t_s >= next_picture_s_ || last_)
      use |= o_.exr ? kPicture | kExr : kPicture;
    if (o_.verify_every && (result_.frames % o_.verify_every < o_.verify_row || last_)) use |= kVerify;
    return use;
  }

  void record(const HeadsetSession::Frame& f, uint32_t use, MeasuredFrame& m) {
    m.begin_master_s = worker_.to_master_s(m.begin_s);
    m.update_age_s = worker_.to_master_s(m.end_s) - m.drawn.update.requested_s;
    frames_.add(frame_row(m));
    worker_.on_measured(m);
    spans_.add("display frame", m.begin_master_s, worker_.to_master_s(m.presented_s), 0);
    previous_s_ = m.end_s;
    if (f.discarded) log::debug("the runtime discarded a frame");
    if (m.drawn.between_clips) use &= ~uint32_t{kVerify};  // there is no epoch that looks like it
    if (use) {
      const double t_s = m.begin_s - start_s_;
      if (use & kPicture) next_picture_s_ = (std::floor(t_s / kPicturePeriod_s) + 1) * kPicturePeriod_s;
      const auto legend = o_.legend ? worker_.legend_at(m.drawn.epoch) : nullptr;
      kept_ = spool_->exchange({m.number, t_s, use, left_, std::move(kept_), m.drawn.epoch, legend, {}});
    }
    ++result_.frames;
  }

  const DisplayOptions& o_;
  const XrOptions& xr_;
  XrDevice& device_;
  const XrSourceMaker& make_source_;
  ViewerWorker& worker_;
  metrics::TableRecorder& frames_;
  metrics::SpanRecorder& spans_;
  const std::function<FrameSpool*()>& find_spool_;
  const std::function<void(const std::string&)>& tell_;
  FrameSpool* spool_ = nullptr;
  Look look_;
  std::unique_ptr<HeadsetSession> session_;
  std::shared_ptr<Received> received_;
  std::unique_ptr<ViewSource> source_;  // draws received_
  image::View views_[2], kept_;
  geometry::Camera left_;             // of the frame at hand
  std::array<glm::dvec3, 2> ends_{};  // of the hands' rays
  std::array<bool, 2> pressed_{};
  DisplayResult result_;
  std::string trouble_;
  bool last_ = false, lost_ = false;
  bool as_pair_ = true;  // source_ draws both eyes at a time
  double open_at_s_ = 0, start_s_ = 0, previous_s_ = 0, last_display_s_ = 0, next_picture_s_ = 0;
};

}  // namespace

Result<std::unique_ptr<XrDevice>> XrDevice::open() {
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  auto out = std::make_unique<XrDevice>();
  out->context_ = std::move(*context);
  if (const Status s = out->reopen(); !s) return s.error();
  return out;
}

Status XrDevice::reopen() {
  const gl::EglContext::Current current(*context_);
  system_.reset();
  auto opened = XrSystem::open();
  if (!opened) return opened.error();
  system_ = std::move(*opened);
  return ok_status();
}

DisplayResult run_xr_display(const DisplayOptions& options, const XrOptions& xr, XrDevice& device,
                             const XrSourceMaker& make_source, ViewerWorker& worker, metrics::TableRecorder& frames,
                             metrics::SpanRecorder& spans, const std::function<FrameSpool*()>& spool,
                             const std::function<void(const std::string&)>& tell) {
  return XrDisplay(options, xr, device, make_source, worker, frames, spans, spool, tell).run();
}

}  // namespace telesplat::viewer
