#include "client/viewer/viewer_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/viewer/coupling/stage_table.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/metrics/process.h"

namespace telesplat::viewer {
namespace {

constexpr double kReportPeriod_s = 1.0;
constexpr int kMessagesAtOnce = 16;  // then requests and control have their turn
// Longest time until the worker looks at what the display did. Where the display waits, this time is lost in each
// cycle.
constexpr double kPoll_s = 0.01, kCoupledPoll_s = 0.001;
constexpr double kWallPoll_s = 0.003;  // views of a wall wait for each other at the master

wire::Hello make_hello(const ViewerWorker::Options& o) {
  wire::Hello hello;
  hello.role = "viewer";
  hello.name = o.service.name;
  hello.instance = net::make_instance_id();
  hello.facts = o.facts;
  return hello;
}

RequestOptions with_buffers(RequestOptions o, const CouplingGate& gate) {
  o.buffers = uint64_t(gate.buffers());
  return o;
}

}  // namespace

ViewerWorker::ViewerWorker(net::Context& context, const Options& options, CouplingGate& gate,
                           metrics::TableRecorder& frames, metrics::SpanRecorder& spans)
    : options_(options),
      gate_(gate),
      frames_(frames),
      spans_(spans),
      updates_table_("updates", update_columns()),
      link_(context, options.service.master, make_hello(options), options.service.give_up_after_s),
      feeds_(context, options.service.name),
      requester_(with_buffers(options.requests, gate), link_.instance()),
      started_s_(options.started_s > 0 ? options.started_s : monotonic_s()),
      instance_(link_.instance()) {
  link_.on_order([this](const wire::Order& order) { orders_.put(order); });
  link_.on_renewed([this](InstanceId instance) { renew(instance); });
  if (options_.own_thread) thread_ = std::thread([this] { loop(); });
}

ViewerWorker::~ViewerWorker() {
  stop();
  if (thread_.joinable()) thread_.join();
}

void ViewerWorker::on_expected(double t_s, const geometry::Pose& pose) {
  const std::lock_guard lock(mutex_);
  expected_ = {t_s, pose};
}

void ViewerWorker::on_jump() {
  const std::lock_guard lock(mutex_);
  jumped_ = true;
}

void ViewerWorker::on_pose(double now_s, const geometry::Camera& camera) {
  const std::lock_guard lock(mutex_);
  poses_.push_back({.t_s = now_s,
                    .camera = camera,
                    .expected = std::exchange(expected_, std::nullopt),
                    .jumped = std::exchange(jumped_, false)});
}

void ViewerWorker::on_first_points(double now_s) {
  if (first_points_s_ == 0) first_points_s_ = now_s - started_s_;
}

void ViewerWorker::on_frame(double now_s, const geometry::Camera& camera, EpochId epoch, const ShownUpdate& shown,
                            bool waited) {
  ++frames_shown_;
  if (const uint64_t before = epoch_shown_.exchange(epoch.value); before != 0 && before != epoch.value) ++epochs_shown_;
  const std::lock_guard lock(mutex_);
  poses_.push_back({now_s, camera, waited ? shown.requested_s : 0.0, shown.request,
                    std::exchange(expected_, std::nullopt), std::exchange(jumped_, false)});
}

void ViewerWorker::on_ask(uint64_t ask, const geometry::Camera& camera) {
  const std::lock_guard lock(mutex_);
  ask_ = {ask, camera};
}

void ViewerWorker::on_measured(const MeasuredFrame& f) {
  if (f.previous_s > 0) {
    const double gap_ms = (f.end_s - f.previous_s) * 1e3;
    inter_frame_ms_.add(f.end_s, gap_ms);
    if (gap_ms > longest_gap_ms_) longest_gap_ms_ = gap_ms;  // safe: only one thread displays
  }
  update_age_ms_.add(f.end_s, f.update_age_s * 1e3);
}

FrameFigures ViewerWorker::figures() const {
  const std::lock_guard lock(mutex_);
  return {.scene = scene_,
          .updates = updates_,
          .latency_ms = latency_ms_,
          .bytes_received = bytes_received_,
          .epochs_shown = epochs_shown_,
          .sampled_width = sampled_width_,
          .sampled_height = sampled_height_,
          .renderer = options_.renderer->get()};
}

std::shared_ptr<const wire::Welcome> ViewerWorker::session() const {
  const std::lock_guard lock(mutex_);
  return session_;
}

void ViewerWorker::set_sampling(const SamplingWish& wish) {
  const std::lock_guard lock(mutex_);
  sampling_ = wish;
}

// A person's wish overrides the session's setting.
void ViewerWorker::take_sampling() {
  std::optional<SamplingWish> wish;
  {
    const std::lock_guard lock(mutex_);
    wish = std::exchange(sampling_, std::nullopt);
  }
  if (!wish) return;
  if (wish->adaptive) options_.least_sampling = wish->least_sampling;
  requester_.set_sampling(*wish);
}

ShownScene ViewerWorker::shown_scene() const {
  const std::lock_guard lock(mutex_);
  return shown_scene_;
}

std::shared_ptr<const SceneTerms> ViewerWorker::terms() const {
  const std::lock_guard lock(mutex_);
  return terms_;
}

void ViewerWorker::loop() {
  net::lower_thread_priority(5);  // the display comes first
  try {
    net::take_turns(*this);
  } catch (const std::exception& e) {
    log::error("the viewer's worker failed: {}", e.what());
    failed_ = true;
    shutdown_ = true;
  }
}

std::optional<net::Wait> ViewerWorker::turn() {
  receive_control();
  receive();
  const double poll_s = gate_.waits() ? kCoupledPoll_s : options_.requests.wall.empty() ? kPoll_s : kWallPoll_s;
  const double now = monotonic_s();
  if (stop_) {
    report(now, true);
    link_.leave([this] { return status(); });
    return std::nullopt;
  }
  offset_s_ = link_.to_master_s(now) - now;
  link_.tick(now, [this] { return status(); });
  follow_session();
  change_coupling(now);
  take_sampling();
  request_views(now);
  report(now, false);
  net::Wait wait{{&link_.socket()}, std::min(poll_s, requester_.due_in_s(to_master_s(monotonic_s())).value_or(poll_s))};
  feeds_.add_to(wait.sockets);
  return wait;
}

void ViewerWorker::receive() {
  succession_.free_dropped();
  if (!received_ || !feeds_.connected()) return;
  received_->receive(kMessagesAtOnce);
  received_->tick(monotonic_s());
}

void ViewerWorker::receive_control() {
  link_.receive();
  for (auto& answer : orders_.take_answers()) link_.answer(answer.number, answer.ok, std::move(answer.text));
  link_code_ = link_.exit_code();
  if (!link_.shutdown_requested() || shutdown_) return;
  why_ = link_.shutdown_reason();
  shutdown_ = true;
}

// Content received so far belongs to the old instance: the next welcome begins anew.
void ViewerWorker::renew(InstanceId instance) {
  instance_ = instance;
  requester_.set_viewer(instance);
  pipeline_.reset();
}

void ViewerWorker::follow_session() {
  if (link_.version() == seen_version_) return;
  seen_version_ = link_.version();
  const wire::Welcome& session = *link_.session();
  const scene::SessionView view(session);
  follow_record(session);
  legends_.follow(session);
  requester_.set_min_scale(options_.least_sampling.value_or(session.settings.least_sampling));
  follow_coupling(session.settings);
  follow_pictures(view);
  if (std::exchange(session_epoch_, session.epoch) != session.epoch)
    requester_.on_new_epoch(to_master_s(monotonic_s()));
  requester_.set_steered(session.settings.steering);
  if (std::exchange(master_, session.master) != session.master) {
    all_again_ = true;  // the new master does not know the open requests
    if (received_) received_->on_new_master();
  }
  const auto pipeline = view.pipeline();
  if (!pipeline && !view.fact("kind").empty())
    log::error("the session's scene is of the kind \"{}\", which this viewer does not know", view.fact("kind"));
  // The display gets a session when its scene can be shown, or when it is known that it cannot.
  auto copy = std::make_shared<const wire::Welcome>(session);
  const bool has_scene = !session.box_room.empty() && pipeline;
  const Status followed = has_scene ? follow(*pipeline, session) : ok_status();
  {
    const std::lock_guard lock(mutex_);
    session_ = std::move(copy);
    if (has_scene && followed) {
      scene_ = view.fact("scene");
      terms_ = std::make_shared<const SceneTerms>(terms_of(session));
      shown_scene_ = {session.box_room, *pipeline};
    }
  }
  if (!followed)
    return log::error("the session as the master at {} tells of it cannot be shown: {}", options_.service.master,
                      followed.error().text);
  if (!has_scene) return;
  if (feeds_.connect(received_->feeds(), session)) received_->on_connected();
}

// Takes the wish of `telesplat ctl coupling`; if the master has no wish, the coupling stays.
void ViewerWorker::follow_coupling(const wire::SessionSettings& session) {
  const auto told = coupling_told(session.coupling, session.buffers);
  if (!told) return;
  if (told == wished_) return;
  wished_ = *told != gate_.state() ? told : std::nullopt;
  wished_since_s_ = monotonic_s();
}

// The session alone decides if views come as pictures, for as long as it lasts; the viewer's flags do not.
void ViewerWorker::follow_pictures(const scene::SessionView& session) {
  const auto pipeline = session.pipeline();
  const bool pictures = pipeline == scene::Pipeline::kPictures, shows = gate_.state().mode == CouplingMode::kImages;
  requester_.set_pictures(pictures);
  if (!pipeline || pictures == shows) return;
  const CouplingState now = pictures ? coupling_state(CouplingMode::kImages, 0) : CouplingState{};
  log::warn("coupling: {} instead of {}: so do the views of this session come", coupling_text(now),
            coupling_text(gate_.state()));
  requester_.set_buffers(uint64_t(now.buffers));
  gate_.change(now);
}

// Keeps as many views under way as servers and link need to stay busy.
void ViewerWorker::follow_depth(const metrics::StagesMs& stages, uint64_t ahead) {
  CouplingState state = gate_.state();
  if (state.mode != CouplingMode::kImages) return;
  depth_.answered({.latency_ms = metrics::sum_ms(stages, ""),
                   .queued_ms = metrics::sum_ms(stages, "queue_ms"),
                   .network_ms = metrics::sum_ms(stages, "network_ms"),
                   .ahead = int(ahead)});
  if (state.buffers == depth_.depth()) return;
  state.buffers = depth_.depth();
  requester_.set_buffers(uint64_t(state.buffers));
  gate_.change(state);
}

// Before the display begins to wait, the update under way is completed and shown, for kPatience_s at most. So no update
// is lost, and the first frame that waits does so for a request made after the change.
void ViewerWorker::change_coupling(double now_s) {
  if (!wished_) return;
  const CouplingState before = gate_.state(), after = *wished_;
  const bool begins_to_wait = !before.waits() && after.waits();
  if (begins_to_wait && requester_.answer_open() && now_s < wished_since_s_ + Coupling::kPatience_s) return;
  wished_.reset();
  log::info("coupling: {} instead of {}", coupling_text(after), coupling_text(before));
  requester_.set_buffers(uint64_t(after.buffers));
  if (begins_to_wait && received_) received_->on_coupling(after.buffers);
  gate_.change(after);
  if (!after.waits())
    for (const auto& [request, update] : std::exchange(complete_, {})) may_display(update);
  if (!begins_to_wait && received_) received_->on_coupling(after.buffers);
}

// The record must have its folder before any data are received.
void ViewerWorker::follow_record(const wire::Welcome& session) {
  if (!options_.record) return;
  const std::string before = options_.record->records_in();
  options_.record->follow(session);
  options_.received.events = options_.record->events();
  options_.received.slices = options_.record->slices();
  if (const std::string& now = options_.record->records_in(); now != before) link_.tell("records_in", now);
}

Status ViewerWorker::follow(scene::Pipeline pipeline, const wire::Welcome& session) {
  if (pipeline_ == pipeline) return received_->follow(session);
  auto next = make_received(pipeline, options_.received, links());
  if (const Status s = next->follow(session); !s) return s;
  if (received_) retire();
  pipeline_ = pipeline;
  received_ = next;
  succession_.begin(std::move(next));
  return ok_status();
}

// The scene is drawn by another Received from now on: requests are answered that way.
void ViewerWorker::retire() {
  received_->on_retired();
  feeds_.close();
  complete_.clear();
  gate_.with([](Coupling& c) { c.drop_complete(); });
  all_again_ = true;
  requester_.on_epoch(to_master_s(monotonic_s()));
}

ReceivedLinks ViewerWorker::links() {
  return {.viewer = link_.instance(),
          .gate = gate_,
          .feeds = feeds_,
          .spans = spans_,
          .on_part = [this](const ViewPart& part) { on_part(part); },
          .on_lost = [this](RequestId r) { lost_.push_back(r); },
          .on_epoch = [this] { requester_.on_epoch(to_master_s(monotonic_s())); },
          .requested_s = [this](RequestId r) { return requester_.requested_s(r); },
          .to_master_s = [this](double s) { return to_master_s(s); }};
}

void ViewerWorker::on_part(const ViewPart& part) {
  const double local_s = monotonic_s(), now_s = to_master_s(local_s);
  bytes_received_ += part.bytes;
  if (part.viewer != link_.instance()) return;
  // Rays beyond views answer no request: they must not keep a lost request from being repeated.
  if (!part.extra) gate_.with([&](Coupling& c) { c.progress(local_s); });
  const auto u = requester_.on_part(part, now_s);
  if (!u) return;
  updates_table_.add(update_row({*u, part}));
  const auto stages = stages_table_.complete({*u, part});
  spans_.add("view update", u->requested_s, u->complete_s, metrics::kOverlapping,
             {.frame = double(part.frame.value), .request = double(u->request.value)});
  const ShownUpdate update{u->request, u->requested_s, part.camera.pose, u->posed_s};
  if (stages) follow_depth(*stages, u->ahead);
  if (!gate_.waits()) may_display(update);
  {
    const std::lock_guard lock(mutex_);
    latency_ms_ = (u->complete_s - u->requested_s) * 1e3;
    ++updates_;
    latencies_ms_.add(local_s, latency_ms_);
  }
  if (!gate_.waits()) return;
  complete_[u->request] = update;
  received_->on_complete(u->request);
  gate_.with([&](Coupling& c) { release(c.completed(u->request, local_s)); });
}

void ViewerWorker::may_display(const ShownUpdate& update) {
  received_->on_update(update);
  succession_.on_update(update.request);
}

// Call it with the gate closed, before the display can take them.
void ViewerWorker::release(const std::vector<RequestId>& requests) {
  for (const RequestId request : requests) {
    may_display(complete_[request]);
    complete_.erase(complete_.begin(), complete_.upper_bound(request));
  }
}

void ViewerWorker::take_poses() {
  std::vector<SeenPose> poses;
  std::optional<std::pair<uint64_t, geometry::Camera>> ask;
  {
    const std::lock_guard lock(mutex_);
    poses.swap(poses_);
    ask = std::exchange(ask_, std::nullopt);
  }
  for (const auto& p : poses) {
    if (p.jumped) requester_.on_jump();
    requester_.on_pose(to_master_s(p.t_s), p.camera);
    if (p.expected) requester_.on_expected(to_master_s(p.expected->t_s), p.expected->pose);
    if (p.shown.value != 0) stages_table_.displayed(p.shown, to_master_s(p.t_s));
    if (p.waited_since_s > 0) requester_.on_displayed(to_master_s(p.t_s) - p.waited_since_s);
  }
  if (ask) requester_.on_ask(to_master_s(monotonic_s()), ask->first, ask->second);
  horizon_s_ = requester_.horizon_s();
}

void ViewerWorker::ask_again(double now_s) {
  std::vector<RequestId> again;
  gate_.with([&](Coupling& c) {
    std::vector<RequestId> released;
    again = c.overdue(now_s, released);
    release(released);
    for (const RequestId request : std::exchange(lost_, {}))
      if (c.is_open(request)) again.push_back(request);
    if (std::exchange(all_again_, false)) again = c.open();
  });
  for (const auto& request : requester_.again(again, to_master_s(now_s))) link_.socket().send(request);
}

void ViewerWorker::request_views(double now_s) {
  take_poses();
  horizon_s_ = requester_.horizon_s();
  if (!link_.session() || !feeds_.connected()) return;
  ask_again(now_s);
  if (wished_) return;  // no requests until the coupling has changed
  bool may_ask = gate_.may_ask();
  while (may_ask) {
    const auto request = requester_.next(to_master_s(now_s));
    if (!request) return;
    link_.socket().send(*request);
    tell_if_coarser(request->camera);
    {
      const std::lock_guard lock(mutex_);
      sampled_width_ = request->camera.width, sampled_height_ = request->camera.height;
    }
    may_ask = gate_.asked(request->request, now_s);
  }
}

// Warns once if the master samples coarser than the view asks for.
void ViewerWorker::tell_if_coarser(const geometry::Camera& camera) {
  const uint64_t most = link_.session()->settings.max_sampling_pixels;
  const uint64_t pixels = uint64_t(camera.width) * uint64_t(camera.height);
  if (pixels <= most || std::exchange(told_coarser_, true)) return;
  log::warn("views of {}x{} pixels are sampled coarser: the master's --max-sampling-pixels is {}", camera.width,
            camera.height, most);
}

void ViewerWorker::report(double now_s, bool last) {
  if (!last && now_s - last_report_s_ < kReportPeriod_s) return;
  last_report_s_ = now_s;
  if (last) take_poses();
  const InstanceId own = link_.instance();
  for (const auto& rows :
       {frames_.flush(own), updates_table_.flush(own), stages_table_.flush(own, last), spans_.flush(own)})
    if (rows) link_.socket().send(*rows);
  if (received_) received_->report();
}

// Adds recent figures and how long the display waits, for people who watch.
void ViewerWorker::add_recent(net::MasterLink::Values& values) const {
  const double now_s = monotonic_s();
  for (const auto& [name, recent] : {std::pair{"inter_frame", &inter_frame_ms_},
                                     {"update_latency", &latencies_ms_},
                                     {"update_age", &update_age_ms_}}) {
    const auto figures = recent->figures(now_s);
    if (figures.count == 0) continue;
    values[fmt::format("{}_ms", name)] = figures.median;
    values[fmt::format("{}_p95_ms", name)] = figures.p95;
  }
  const CouplingState coupling = gate_.state();
  values["coupling"] = double(coupling.mode);
  values["buffers"] = double(coupling.buffers);
  values["waits_s"] = waits_s_;
  if (const auto renderer = options_.renderer->get(); renderer.gl_ms > 0) {
    values["renderer_gl"] = renderer.kept == "gl";
    values["renderer_cpu_ms"] = renderer.cpu_ms;
    values["renderer_gl_ms"] = renderer.gl_ms;
  }
  values["longest_gap_ms"] = longest_gap_ms_;
}

// Adds mean errors of predicted poses: of view requests, and of displayed poses from a tracker.
void ViewerWorker::add_prediction(net::MasterLink::Values& values) const {
  const auto add = [&](const char* what, const tracking::PredictionMeter::Figures& f) {
    if (f.count == 0) return;
    constexpr double kDegrees = 180 / 3.14159265358979323846;
    values[fmt::format("{}s", what)] = double(f.count);
    values[fmt::format("{}_horizon_ms", what)] = f.horizon_s * 1e3;
    values[fmt::format("{}_error_mm", what)] = f.error_m * 1e3;
    values[fmt::format("{}_error_deg", what)] = f.error_rad * kDegrees;
    values[fmt::format("{}_none_mm", what)] = f.unpredicted_m * 1e3;
    values[fmt::format("{}_none_deg", what)] = f.unpredicted_rad * kDegrees;
  };
  add("prediction", requester_.prediction());
  if (!options_.poses) return;
  const TrackedHead::Figures head = options_.poses->figures();
  values["poses"] = double(head.poses);
  values["poses_late"] = double(head.late);
  values["poses_refused"] = double(head.refused);
  add("pose_prediction", head.prediction);
}

net::MasterLink::Values ViewerWorker::status() const {
  net::MasterLink::Values values{{"rss_mb", net::resident_mb()},
                                 {"peak_rss_mb", net::peak_resident_mb()},
                                 {"points", 0},
                                 {"model_bytes", 0},
                                 {"pixels", 0},
                                 {"points_received", 0},
                                 {"bytes_received", double(bytes_received_)},
                                 {"gaps_resynced", 0},
                                 {"updates", double(updates_)},
                                 {metrics::kUpdateRows, double(updates_table_.gone())},
                                 {metrics::kStageRows, double(stages_table_.gone())},
                                 {"frames", double(frames_shown_)},
                                 {"first_points_s", first_points_s_},
                                 {"epochs_shown", double(epochs_shown_)},
                                 {"epoch", double(epoch_shown_)},
                                 {"sequence", 0},
                                 {"messages_rejected", double(feeds_.rejected())}};
  if (received_) received_->add_status(values);
  if (options_.record) values[metrics::kRecordFailed] = double(options_.record->files_failed());
  add_recent(values);
  add_prediction(values);
  return values;
}

}  // namespace telesplat::viewer
