#include "client/viewer/display/display_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

#include "client/viewer/display/eyes/eye_pictures.h"
#include "client/viewer/display/frame_rows.h"
#include "client/viewer/hands/errands.h"
#include "client/viewer/render/renderer.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr double kRestPeriod_s = 1.0 / 30, kLookAfterSurface_s = 0.1;
constexpr double kUnseen_s = 1;

bool told_to_stop(const ViewerWorker& worker, const DisplaySurface& surface) {
  return net::stop_requested() || worker.shutdown_requested() || surface.wants_to_stop();
}

// Samples that are finer than the drawn picture would come late and show nothing more.
geometry::Camera drawn_size(const geometry::Camera& camera, const DrawnFrame& drawn) {
  return drawn.halved ? geometry::half_size(camera) : camera;
}

// Sums the views of a headset's eyes: both are one frame of the tables.
void add(const DrawnFrame& other, DrawnFrame& sum) {
  sum.empty = sum.empty && other.empty;
  sum.stats += other.stats;
  sum.selected += other.selected, sum.drawn += other.drawn, sum.items += other.items;
  sum.detail = std::min(sum.detail, other.detail);
}

// Content that the worker received, and a source that draws it.
class DrawnScene {
 public:
  DrawnScene(ViewerWorker& worker, DisplaySurface& surface, const SourceMaker& make)
      : worker_(worker), surface_(surface), make_(make) {}

  /// Draws frames that show the update of this request from now on; from the same as before, unless the session changed
  /// between points and slice images, or a headset its pace. Error: it cannot be drawn.
  Status use(RequestId request) {
    auto received = worker_.received_at(request);
    const double pictures = surface_.pictures_a_second();
    if (received == received_ && pictures == pictures_a_second_) return ok_status();
    source_.reset();  // its renderer's context must be gone before another one is made
    received_ = std::move(received);
    pictures_a_second_ = pictures;
    auto made = make_(*received_, pictures);
    if (!made) return made.error();
    source_ = std::move(*made);
    return ok_status();
  }
  /// Tells the surface of the session and its scene, if they are new.
  void tell_surface() {
    auto session = worker_.session();  // first, so that the surface gets a session's scene before the session
    const ShownScene scene = worker_.shown_scene();
    if (!scene.box_room.empty() && scene != scene_) surface_.on_scene(scene_ = scene);
    if (session != session_) surface_.on_session(session_ = std::move(session));
  }
  /// The scene's box, as the surface knows it.
  const geometry::Box& box_room() const { return scene_.box_room; }
  bool can_draw() const { return source_ != nullptr; }
  /// Precondition: can_draw().
  ViewSource& source() const { return *source_; }
  Received& received() const { return *received_; }

 private:
  ViewerWorker& worker_;
  DisplaySurface& surface_;
  const SourceMaker& make_;
  std::shared_ptr<Received> received_;
  std::unique_ptr<ViewSource> source_;  // draws received_
  double pictures_a_second_ = 0;        // that source_ was made for
  ShownScene scene_;                    // as given to the surface; so is session_
  std::shared_ptr<const wire::Welcome> session_;
};

// A frame that is on display.
struct ShownFrame {
  geometry::Camera camera;
  geometry::Pose head;
  EpochId epoch;
  EyePair eyes;  // with stereo
};

class DisplayLoop {
 public:
  explicit DisplayLoop(const DisplayParts& parts)
      : o_(parts.options),
        surface_(parts.surface),
        gate_(parts.gate),
        worker_(parts.worker),
        wall_(parts.wall),
        rows_(parts.frames, parts.spans, parts.wall != nullptr),
        kept_(parts.options, parts.spool),
        drawn_(parts.worker, parts.surface, parts.make_source),
        eyes_(parts.options.stereo),
        look_(first_look(o_.render, o_.shading)),
        stall_(o_.most_wait_s) {}

  DisplayResult run() {
    if (!wait_for_scene()) return stopped_early();
    kept_.open();
    if (!draw_from(newest_drawn()) || !rest()) return stopped_early();
    if (!surface_.paces()) {
      worker_.on_first_points(monotonic_s());
      clock_.start(o_.span.clock_from_s > 0 ? o_.span.clock_from_s : monotonic_s());
    }
    if (wall_) swap_with_wall();
    while (!last_)
      if (ready())
        frame();
      else
        see_whether_over();
    rows_.flush();
    return result_;
  }

 private:
  DisplayResult stopped_early() {
    result_.interrupted = true;
    return result_;
  }

  // False: what shows this request cannot be drawn, result_ says why.
  bool draw_from(RequestId request) {
    const Status used = drawn_.use(request);
    if (!used) result_.error = used.error().text;
    return used.ok();
  }
  // Returns the request to draw next if the display does not wait.
  RequestId newest_drawn() const { return gate_.waits() ? RequestId{} : Succession::kNewest; }

  // Returns the camera of the frame that begins, after telling the surface what there is to show.
  geometry::Camera next_camera(double now_s, double t_s) {
    drawn_.tell_surface();
    if (const auto wish = surface_.take_sampling()) worker_.set_sampling(*wish);
    if (const auto wish = surface_.take_stereo()) eyes_ = EyePictures(*wish);
    return surface_.begin_frame(now_s, t_s, look_);
  }

  // True if a frame can be shown now. While a headset is not worn, no frame waits for it.
  bool ready() {
    const bool ready = surface_.ready();
    if (!ready) refuse_orders();
    if (surface_.take_jump()) worker_.on_jump();
    return ready;
  }
  // Sleeps until the next frame of a head that rests; a surface that paces frames waits by itself.
  void rest_until_next() const {
    if (!surface_.paces()) sleep_until(monotonic_s() + kRestPeriod_s);
  }
  void present(bool changed) {
    if (surface_.eyes())
      surface_.present_eyes(eye_views_);
    else
      surface_.present(view_, changed);
  }

  // Returns the camera to ask samplers for: this one, or one that covers what its eyes see.
  geometry::Camera asked(double now_s, double t_s, const geometry::Camera& camera, const geometry::Pose& head) {
    return eyes_.on() ? eyes_.begin(now_s, camera, head.orientation, t_s, drawn_.box_room()) : camera;
  }

  DrawnFrame draw(const FrameInput& input, bool kept) {
    if (const auto* eyes = surface_.eyes()) return draw_eyes(input, *eyes, kept);
    if (eyes_.on()) return eyes_.draw(drawn_.source(), input, kept_.spool() != nullptr, view_);
    // A view that may be recorded has room for depth all the time: growing it costs milliseconds.
    fit(view_, input.camera, kept_.spool() != nullptr);
    return drawn_.source().draw(input, view_);
  }

  // Draws each eye's picture at the size of a frame, with depth.
  DrawnFrame draw_eyes(FrameInput input, const std::array<geometry::Camera, 2>& eyes, bool kept) {
    input.with_depth = true;
    input.intact = false;
    std::array<splat::FrameTarget, 2> targets;
    for (size_t eye = 0; eye < 2; ++eye) {
      image::View& view = eye_views_[eye];
      fit(view, eyes[eye], true);
      targets[eye] = {view.width, view.height, view.colour.data(), view.depth_m.data()};
    }
    DrawnFrame out;
    if (alike(eyes)) {
      input.camera = between(eyes);
      out = drawn_.source().draw_pair(input, eyes, targets);
    } else {
      input.camera = eyes[0];
      out = drawn_.source().draw(input, eye_views_[0]);
      input.camera = eyes[1];
      add(drawn_.source().draw(input, eye_views_[1]), out);
    }
    if (kept) view_ = eye_views_[0];  // before the surface draws over it
    return out;
  }

  void clear(image::View& view, const geometry::Camera& camera, bool with_depth) {
    fit(view, camera, with_depth);
    std::fill(view.colour.begin(), view.colour.end(), look_.background);
    std::fill(view.depth_m.begin(), view.depth_m.end(), std::numeric_limits<float>::infinity());
  }

  // Shows an empty picture until the scene is known.
  bool wait_for_scene() {
    for (; !worker_.received_at({}) || worker_.shown_scene().box_room.empty(); rest_until_next()) {
      if (told_to_stop(worker_, surface_)) return false;
      if (!ready()) continue;
      const geometry::Camera camera = next_camera(monotonic_s(), -1);
      refuse_orders();
      if (!surface_.visible()) continue;
      if (const auto* eyes = surface_.eyes())
        for (size_t eye = 0; eye < 2; ++eye) clear(eye_views_[eye], (*eyes)[eye], true);
      else
        clear(view_, camera, false);
      present(true);
      surface_.report({.now_s = monotonic_s(), .session = worker_.figures()});
    }
    return true;
  }

  // Lets the head rest until the first view is complete. Its parts are shown as they come, unless the display waits for
  // whole updates.
  bool rest() {
    for (; !worker_.first_update_complete(); rest_until_next()) {
      if (told_to_stop(worker_, surface_)) return false;
      if (!ready()) continue;
      if (!draw_from(newest_drawn())) return false;
      const double now_s = monotonic_s();
      const geometry::Camera camera = next_camera(now_s, -1);
      tell_expected(now_s);
      worker_.on_pose(surface_.seen_s(now_s), asked(now_s, -1, camera, surface_.head()));
      const DrawnFrame drawn =
          draw({.begin_s = now_s, .camera = camera, .look = look_, .resting = true, .even_empty = surface_.visible()},
               false);
      if (drawn.empty && !surface_.visible()) {
        refuse_orders();
        continue;
      }
      present(true);
      if (!drawn.empty) worker_.on_first_points(monotonic_s());
      carry_out_orders({picked_with(camera), surface_.head(), drawn.epoch, eyes_.pair()});
      surface_.report({.now_s = monotonic_s(),
                       .frame = {.drawn = drawn},
                       .units = drawn_.source().units(),
                       .session = worker_.figures()});
    }
    return true;
  }

  // If each eye has a display of its own, places are those in the left eye's.
  geometry::Camera picked_with(const geometry::Camera& camera) const {
    return surface_.eyes() ? (*surface_.eyes())[0] : camera;
  }
  void tell_expected(double now_s) {
    if (const auto head = surface_.expected(now_s + worker_.horizon_s())) worker_.on_expected(head->at_s, head->pose);
  }

  // Ends a display whose frames are not shown, kUnseen_s after its duration.
  void see_whether_over() {
    if (told_to_stop(worker_, surface_)) result_.interrupted = last_ = true;
    last_ = last_ || (clock_.started() && o_.span.over(monotonic_s() - clock_.start_s() - kUnseen_s));
  }

  // Sets last_ if the frame that begins now is the last one.
  void see_whether_last(double t_s) {
    if (told_to_stop(worker_, surface_)) result_.interrupted = last_ = true;
    last_ = last_ || o_.span.over(t_s) || (o_.span.frames > 0 && result_.frames + 1 >= o_.span.frames);
  }

  struct Waited {
    double wait_s = 0;
    CouplingState coupling;
    bool for_update = false;  // the wait was for an update, and it came
  };
  // If the display waits for updates: waits until the next one is there, the wait has become too long, the coupling has
  // changed, or the run is at its end.
  Waited wait_for_update() {
    if (const CouplingState coupling = gate_.state(); !coupling.waits()) {
      end_stall();
      return {0, coupling};
    }
    const double begin_s = monotonic_s();
    for (;;) {
      const auto [coupling, request, last_sign_s, asked_for] = gate_.take(look_after_s());
      const double now_s = monotonic_s(), t_s = now_s - clock_.start_s();
      if (request || !coupling.waits()) end_stall();
      if (request && draw_from(*request)) drawn_.source().advance(*request);
      if (request || !coupling.waits()) return {monotonic_s() - begin_s, coupling, request.has_value()};
      if (told_to_stop(worker_, surface_) || o_.span.over(t_s)) return {now_s - begin_s, coupling};
      // A head that rests shows its picture; no request is open to wait for.
      if (coupling.mode == CouplingMode::kImages && !asked_for && now_s - begin_s >= kRestPeriod_s) {
        end_stall();
        return {now_s - begin_s, coupling};
      }
      const bool draws = stall_.waiting(now_s, begin_s, last_sign_s, coupling);
      tell_stall(now_s);
      if (draws) return {now_s - begin_s, coupling};
      const geometry::Camera camera = next_camera(now_s, t_s);
      worker_.on_pose(now_s, asked(now_s, t_s, camera, surface_.head()));
      if (drawn_.can_draw() && shown_.epoch.value > 0)
        carry_out_orders(shown_);
      else
        refuse_orders();
      if (view_intact_ && surface_.visible()) surface_.present(view_, coupling.mode != CouplingMode::kImages);
    }
  }

  // If servers draw, views are asked for at each refresh of the display with the head's pose, also at refreshes that
  // bring no new picture.
  double look_after_s() const {
    if (gate_.state().mode != CouplingMode::kImages) return kLookAfterSurface_s;
    return o_.target_fps > 0 ? std::min(1 / o_.target_fps, kLookAfterSurface_s) : kRestPeriod_s / 2;
  }

  void end_stall() {
    const double now_s = monotonic_s();
    stall_.over(now_s);
    tell_stall(now_s);
  }

  // Reports to the log, the window and the master.
  void tell_stall(double now_s) {
    if (const auto news = stall_.take_news()) log::warn("{}", *news);
    const double waits_s = stall_.told_s(now_s);
    if (waits_s == 0 && live_.waits_s == 0) return;
    worker_.on_waiting(waits_s);
    live_.now_s = now_s;
    live_.waits_s = waits_s;
    surface_.report(live_);
  }

  // Sends the wall's master this head's wish for the next frame, and takes its word. Returns when the frame at hand is
  // to be presented.
  WallPace::Swapped swap_with_wall() {
    const double now_s = monotonic_s(), t_s = now_s - clock_.start_s();
    next_camera(now_s, t_s);
    const bool one_head = !gate_.waits() && drawn_.received().shows_whole_frames();
    const auto swapped =
        wall_->drawn({t_s, surface_.head(), drawn_.received().newest_state(), one_head ? worker_.horizon_s() : 0},
                     [this] { return told_to_stop(worker_, surface_); });
    if (swapped.ask > 0) ask_for(swapped.ask, swapped.ask_head);
    return swapped;
  }

  // All viewers of the wall ask for views of this head now.
  void ask_for(uint64_t ask, const geometry::Pose& head) {
    geometry::Camera camera = surface_.camera_of(head);
    if (eyes_.on()) camera = eyes_.sampled(camera, head.orientation, wall_->turn().t_s, drawn_.box_room());
    worker_.on_ask(ask, camera);
  }

  // Sets the frame's camera, and the wall's state that it draws.
  void begin_view(double t_s, MeasuredFrame& m) {
    if (!wall_) {
      m.camera = next_camera(m.begin_s, t_s);
      m.head = surface_.head();
      m.posed = surface_.pose_moment().value_or(PoseMoment{m.begin_s});
      return;
    }
    const WallPace::Turn& turn = wall_->turn();
    if (!m.coupling.waits()) drawn_.received().show_state(turn.state);
    m.swap.frame = turn.frame;
    m.head = turn.head;
    // The display that leads took this pose after the frame before the last was presented. Its clock is ours, unless
    // viewers were started by hand.
    m.posed = {within(clock_.start_s() + turn.t_s, clock_.seen_before_s(), m.begin_s)};
    m.camera = surface_.camera_of(turn.head);
  }

  void draw_measured(uint32_t use, bool coverage, MeasuredFrame& m) {
    const bool same_size = view_.width == m.camera.width && view_.height == m.camera.height;
    m.drawn = draw({.begin_s = m.begin_s,
                    .camera = m.camera,
                    .look = m.look,
                    .with_depth = (use & (kVerify | kExr)) != 0,
                    .with_coverage = coverage,
                    .intact = view_intact_ && (same_size || eyes_.on())},
                   use != 0);
    m.end_s = monotonic_s();
    if (m.drawn.picture_of) m.posed = {m.drawn.update.posed_s - worker_.to_master_s(0)};
    if (eyes_.on()) m.stereo = {eyes_.mode(), eyes_.pair()};
  }

  void frame() {
    const Waited waited = wait_for_update();
    MeasuredFrame m{.number = result_.frames,
                    .start_s = clock_.start_s(),
                    .previous_s = clock_.previous_s(),
                    .wait_s = waited.wait_s,
                    .coupling = waited.coupling};
    if (!m.coupling.waits()) draw_from(Succession::kNewest);
    if (!drawn_.can_draw()) {
      result_.interrupted = last_ = true;
      return;
    }
    m.begin_s = monotonic_s();
    if (!clock_.started()) clock_.start(m.start_s = m.begin_s);
    const double t_s = wall_ ? wall_->turn().t_s : m.begin_s - clock_.start_s();
    see_whether_last(t_s);
    // The present view of what is cached now.
    begin_view(t_s, m);
    tell_expected(m.begin_s);
    const geometry::Camera sampled = asked(m.begin_s, t_s, m.camera, m.head);
    if (m.coupling.mode == CouplingMode::kImages) worker_.on_pose(m.posed.taken_s, sampled);
    m.look = look_;
    const uint32_t use = kept_.use_of(result_.frames, t_s, last_);
    const bool wished = surface_.wants_picture();
    const bool coverage = o_.transparent && ((use & kPicture) || wished);
    draw_measured(use, coverage, m);
    worker_.on_frame(surface_.seen_s(m.end_s), drawn_size(sampled, m.drawn), m.drawn.epoch, m.drawn.update,
                     waited.for_update);
    // A flat legend would lie in one eye's picture only, or be torn between both.
    const auto legend = eyes_.on() ? nullptr : worker_.legend_at(m.drawn.epoch);
    surface_.on_legend(legend);
    const WallPace::Swapped swapped = wall_ ? swap_with_wall() : WallPace::Swapped{};
    present(m.drawn.changed);
    clock_.seen(m, monotonic_s(), std::max(surface_.refresh_s(), o_.target_fps > 0 ? 1 / o_.target_fps : 0));
    if (!m.drawn.empty) worker_.on_first_points(m.seen.at_s);
    if (wished) surface_.take_picture(view_, coverage ? image::Alpha::kCoverage : image::Alpha::kNone);
    take_wished_picture(m.camera);
    m.presented_s = monotonic_s();
    surface_.measure(m.seen, m.presented_s);
    if (wall_) note_swap(swapped, m);
    m.filled = gate_.filled();
    drawn_.source().displayed();
    gate_.displayed();
    record(m);
    keep(use, t_s, m, o_.legend ? legend : nullptr);
    ++result_.frames;
    tell_of(m);
    carry_out_orders(shown_ = {picked_with(m.camera), m.head, m.drawn.epoch, eyes_.pair()});
    if ((wall_ && !swapped.alone) || surface_.paces()) return;
    if (o_.target_fps > 0)
      sleep_until(clock_.next_s(m.begin_s, o_.target_fps));
    else if (!m.drawn.changed)
      sleep_until(m.begin_s + kRestPeriod_s / 2);
  }

  void tell_of(const MeasuredFrame& m) {
    live_ = {m.presented_s,           result_.frames,   stall_.told_s(m.presented_s), m,
             drawn_.source().units(), worker_.figures()};
    surface_.report(live_);
  }

  // Draws a picture that is not the display's, with all detail. The frames after it wait that long.
  void take_wished_picture(geometry::Camera camera) {
    const auto wish = surface_.take_picture_wish(camera);
    if (!wish) return;
    image::View picture;
    fit(picture, camera, true);
    drawn_.source().draw({.begin_s = monotonic_s(),
                          .camera = camera,
                          .look = look_,
                          .with_depth = wish->exr,
                          .with_coverage = o_.transparent,
                          .resting = true},
                         picture);
    surface_.take_wished_picture(*wish, std::move(picture),
                                 o_.transparent ? image::Alpha::kCoverage : image::Alpha::kNone);
  }

  // Orders of other processes: refused while there is no frame, else carried out on the displayed one.
  void refuse_orders() {
    for (const wire::Order& order : worker_.orders().take_orders())
      worker_.orders().answer({order.number, false, order.command + ": nothing is shown yet"});
  }
  void carry_out_orders(const ShownFrame& frame) {
    surface_.on_terms(worker_.terms());
    if (const auto at = surface_.points_at()) {
      const auto aim = eyes_.aim(frame.camera, frame.eyes, *at);
      surface_.on_pick(drawn_.source().pick(aim.camera, aim.at_pix.x, aim.at_pix.y, kPickOpacity), frame.epoch);
    }
    const geometry::Camera display = eyes_.display(frame.camera);
    const auto pick = [&](double x, double y, double opacity) {
      const auto aim = eyes_.aim(frame.camera, frame.eyes, {x / display.width, y / display.height});
      return drawn_.source().pick(aim.camera, aim.at_pix.x, aim.at_pix.y, opacity);
    };
    for (const wire::Order& order : worker_.orders().take_orders()) {
      const auto done = carry_out(
          order, {.camera = display,
                  .head = frame.head,
                  .epoch = frame.epoch,
                  .terms = worker_.terms(),
                  .pick = pick,
                  .go = [&](const geometry::Pose& pose) { return surface_.go_to(pose); },
                  .set = [&](const std::string& name, const std::string& value) { return surface_.set(name, value); },
                  .pictures = gate_.state().mode == CouplingMode::kImages,
                  .measurements = surface_.measurements()});
      worker_.orders().answer({order.number, done.ok(), done ? *done : done.error().text});
    }
  }

  void record(MeasuredFrame& m) {
    m.begin_master_s = worker_.to_master_s(m.begin_s);
    m.update_age_s = worker_.to_master_s(m.end_s) - m.drawn.update.requested_s;
    rows_.add(m, m.begin_master_s - m.begin_s);
    worker_.on_measured(m);
    clock_.ended(m);
  }

  void note_swap(const WallPace::Swapped& swapped, MeasuredFrame& m) {
    wall_->presented(m.presented_s);
    m.swap.wait_s = swapped.wait_s;
    if (swapped.alone) m.swap.frame = 0;
    rows_.note_skew(swapped.skew_frame, swapped.skew_s);
  }

  // Hands the picture to the spool if it is to be kept.
  void keep(uint32_t use, double t_s, const MeasuredFrame& m, const std::shared_ptr<const image::Legend>& legend) {
    if (m.drawn.between_clips) use &= ~uint32_t{kVerify};  // no epoch looks like it
    view_intact_ = use == 0;
    if (!use) return;
    if (use & kPicture) kept_.on_picture(t_s);
    // A picture is compared with what its server was to draw; how old that is, other columns tell.
    geometry::Camera camera = m.drawn.picture_of.value_or(picked_with(m.camera));
    camera.width = view_.width, camera.height = view_.height;
    if (m.drawn.picture_of) use |= kPictureOnly;
    SpooledFrame frame{m.number, t_s,           use,    camera,
                       {},       m.drawn.epoch, legend, part_of_wall(camera.width, camera.height, o_.wall)};
    if (eyes_.on()) {
      if (use & kVerify) eyes_.keep(*kept_.spool(), frame);
      frame.use &= ~uint32_t{kVerify};
      if (!frame.use) return;
    }
    frame.view = std::move(view_);
    view_ = kept_.spool()->exchange(std::move(frame));
  }

  const DisplayOptions& o_;
  DisplaySurface& surface_;
  CouplingGate& gate_;
  ViewerWorker& worker_;
  WallPace* const wall_;  // null: the display is by itself
  FrameRows rows_;
  KeptFrames kept_;
  FrameClock clock_;
  DrawnScene drawn_;
  EyePictures eyes_;
  ShownFrame shown_;  // last
  Look look_;
  image::View view_;
  std::array<image::View, 2> eye_views_;  // if the surface has eyes
  bool view_intact_ = false;              // it holds what is on display
  DisplayResult result_;
  bool last_ = false;
  StallWatch stall_;
  FrameFigures live_;  // figures of the newest frame
};

}  // namespace

DisplayResult run_display(const DisplayParts& parts) { return DisplayLoop(parts).run(); }

}  // namespace telesplat::viewer
