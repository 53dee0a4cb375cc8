#include "client/viewer/viewer_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

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
      coupling_(gate),
      tables_(frames, spans),
      link_(context, options.service.master, make_hello(options), options.service.give_up_after_s),
      feeds_(context, options.service.name),
      requester_(with_buffers(options.requests, gate), link_.instance()),
      meter_(options.started_s > 0 ? options.started_s : monotonic_s()) {
  board_.instance = link_.instance();
  link_.on_order([this](const wire::Order& order) { orders_.put(order); });
  link_.on_renewed([this](InstanceId instance) { renew(instance); });
  if (options_.own_thread) thread_ = std::thread([this] { loop(); });
}

ViewerWorker::~ViewerWorker() {
  stop();
  if (thread_.joinable()) thread_.join();
}

void ViewerWorker::on_pose(double now_s, const geometry::Camera& camera) {
  news_.on_pose({.t_s = now_s, .camera = camera});
}

void ViewerWorker::on_frame(double now_s, const geometry::Camera& camera, EpochId epoch, const ShownUpdate& shown,
                            bool waited) {
  meter_.displayed(epoch);
  news_.on_pose({now_s, camera, waited ? shown.requested_s : 0.0, shown.request});
}

SessionFigures ViewerWorker::figures() const {
  SessionFigures out{.renderer = options_.renderer->get()};
  board_.add_figures(out);
  meter_.add_figures(out);
  return out;
}

// A person's wish overrides the session's setting.
void ViewerWorker::take_sampling() {
  const auto wish = news_.take_wish();
  if (!wish) return;
  if (wish->adaptive) options_.least_sampling = wish->least_sampling;
  requester_.set_sampling(*wish);
}

void ViewerWorker::loop() {
  net::lower_thread_priority(5);  // the display comes first
  try {
    net::take_turns(*this);
  } catch (const std::exception& e) {
    log::error("the viewer's worker failed: {}", e.what());
    end_.on_failure();
  }
}

std::optional<net::Wait> ViewerWorker::turn() {
  receive_control();
  receive();
  const double poll_s = coupling_.gate().waits()         ? kCoupledPoll_s
                        : options_.requests.wall.empty() ? kPoll_s
                                                         : kWallPoll_s;
  const double now = monotonic_s();
  if (end_.stops()) {
    report(now, true);
    link_.leave([this] { return status(); });
    return std::nullopt;
  }
  board_.offset_s = link_.to_master_s(now) - now;
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
  end_.set_link_code(link_.exit_code());
  if (link_.shutdown_requested() && !end_.shutdown()) end_.on_shutdown(link_.shutdown_reason());
}

// Content received so far belongs to the old instance: the next welcome begins anew.
void ViewerWorker::renew(InstanceId instance) {
  board_.instance = instance;
  requester_.set_viewer(instance);
  pipeline_.reset();
}

void ViewerWorker::follow_session() {
  if (std::exchange(followed_.version, link_.version()) == link_.version()) return;
  const wire::Welcome& session = *link_.session();
  const scene::SessionView view(session);
  follow_record(session);
  board_.legends.follow(session);
  requester_.set_min_scale(options_.least_sampling.value_or(session.settings.least_sampling));
  coupling_.follow(session.settings, monotonic_s());
  follow_pictures(view);
  if (std::exchange(followed_.epoch, session.epoch) != session.epoch)
    requester_.on_new_epoch(to_master_s(monotonic_s()));
  requester_.set_steered(session.settings.steering);
  if (std::exchange(followed_.master, session.master) != session.master) {
    open_.on_all_lost();  // the new master does not know the open requests
    if (received_) received_->on_new_master();
  }
  const auto pipeline = view.pipeline();
  if (!pipeline && !view.fact("kind").empty())
    log::error("the session's scene is of the kind \"{}\", which this viewer does not know", view.fact("kind"));
  // The display gets a session when its scene can be shown, or when it is known that it cannot.
  auto copy = std::make_shared<const wire::Welcome>(session);
  const bool has_scene = !session.box_room.empty() && pipeline;
  const Status followed = has_scene ? follow(*pipeline, session) : ok_status();
  if (has_scene && followed) {
    const SessionBoard::Scene scene{
        view.fact("scene"), std::make_shared<const SceneTerms>(terms_of(session)), {session.box_room, *pipeline}};
    board_.show(std::move(copy), &scene);
  } else {
    board_.show(std::move(copy), nullptr);
  }
  if (!followed)
    return log::error("the session as the master at {} tells of it cannot be shown: {}", options_.service.master,
                      followed.error().text);
  if (!has_scene) return;
  if (feeds_.connect(received_->feeds(), session)) received_->on_connected();
}

// The session alone decides if views come as pictures, for as long as it lasts; the viewer's flags do not.
void ViewerWorker::follow_pictures(const scene::SessionView& session) {
  const auto pipeline = session.pipeline();
  const bool pictures = pipeline == scene::Pipeline::kPictures;
  requester_.set_pictures(pictures);
  const auto now = pipeline ? coupling_.follow_pictures(pictures) : std::nullopt;
  if (!now) return;
  log::warn("coupling: {} instead of {}: so do the views of this session come", coupling_text(*now),
            coupling_text(coupling_.gate().state()));
  set_coupling(*now);
}

void ViewerWorker::set_coupling(const CouplingState& state) {
  requester_.set_buffers(uint64_t(state.buffers));
  coupling_.gate().change(state);
}

void ViewerWorker::change_coupling(double now_s) {
  const auto after = coupling_.next(requester_.answer_open(), now_s);
  if (!after) return;
  const CouplingState before = coupling_.gate().state();
  const bool begins_to_wait = !before.waits() && after->waits();
  log::info("coupling: {} instead of {}", coupling_text(*after), coupling_text(before));
  if (begins_to_wait && received_) received_->on_coupling(after->buffers);
  set_coupling(*after);
  if (!after->waits())
    for (const auto& [request, update] : open_.take_complete()) may_display(update);
  if (!begins_to_wait && received_) received_->on_coupling(after->buffers);
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
  open_.take_complete();
  coupling_.gate().with([](Coupling& c) { c.drop_complete(); });
  open_.on_all_lost();
  requester_.on_epoch(to_master_s(monotonic_s()));
}

ReceivedLinks ViewerWorker::links() {
  return {.viewer = link_.instance(),
          .gate = coupling_.gate(),
          .feeds = feeds_,
          .spans = tables_.spans(),
          .on_part = [this](const ViewPart& part) { on_part(part); },
          .on_lost = [this](RequestId r) { open_.on_lost(r); },
          .on_epoch = [this] { requester_.on_epoch(to_master_s(monotonic_s())); },
          .requested_s = [this](RequestId r) { return requester_.requested_s(r); },
          .to_master_s = [this](double s) { return to_master_s(s); }};
}

void ViewerWorker::on_part(const ViewPart& part) {
  const double local_s = monotonic_s(), now_s = to_master_s(local_s);
  CouplingGate& gate = coupling_.gate();
  meter_.received(part.bytes);
  if (part.viewer != link_.instance()) return;
  // Rays beyond views answer no request: they must not keep a lost request from being repeated.
  if (!part.extra) gate.with([&](Coupling& c) { c.progress(local_s); });
  const auto u = requester_.on_part(part, now_s);
  if (!u) return;
  const auto stages = tables_.complete(*u, part);
  const ShownUpdate update{u->request, u->requested_s, part.camera.pose, u->posed_s};
  if (const auto state = stages ? coupling_.answered(*stages, u->ahead) : std::nullopt) set_coupling(*state);
  if (!gate.waits()) may_display(update);
  meter_.completed(local_s, (u->complete_s - u->requested_s) * 1e3);
  if (!gate.waits()) return;
  open_.on_complete(update);
  received_->on_complete(u->request);
  gate.with([&](Coupling& c) { release(c.completed(u->request, local_s)); });
}

void ViewerWorker::may_display(const ShownUpdate& update) {
  received_->on_update(update);
  succession_.on_update(update.request);
}

// Call it with the gate closed, before the display can take them.
void ViewerWorker::release(const std::vector<RequestId>& requests) {
  for (const RequestId request : requests) may_display(open_.release(request));
}

void ViewerWorker::take_news() {
  const auto [poses, ask] = news_.take();
  for (const auto& p : poses) {
    if (p.jumped) requester_.on_jump();
    requester_.on_pose(to_master_s(p.t_s), p.camera);
    if (p.expected) requester_.on_expected(to_master_s(p.expected->t_s), p.expected->pose);
    if (p.shown.value != 0) tables_.displayed(p.shown, to_master_s(p.t_s));
    if (p.waited_since_s > 0) requester_.on_displayed(to_master_s(p.t_s) - p.waited_since_s);
  }
  if (ask) requester_.on_ask(to_master_s(monotonic_s()), ask->number, ask->camera);
  board_.horizon_s = requester_.horizon_s();
}

void ViewerWorker::ask_again(double now_s) {
  std::vector<RequestId> again;
  coupling_.gate().with([&](Coupling& c) {
    std::vector<RequestId> released;
    again = c.overdue(now_s, released);
    release(released);
    again = open_.take_lost(c, std::move(again));
  });
  for (const auto& request : requester_.again(again, to_master_s(now_s))) link_.socket().send(request);
}

void ViewerWorker::request_views(double now_s) {
  take_news();
  if (!link_.session() || !feeds_.connected()) return;
  ask_again(now_s);
  if (coupling_.waits()) return;  // no requests until the coupling has changed
  bool may_ask = coupling_.gate().may_ask();
  while (may_ask) {
    const auto request = requester_.next(to_master_s(now_s));
    if (!request) return;
    link_.socket().send(*request);
    tell_if_coarser(request->camera);
    board_.show_size(request->camera.width, request->camera.height);
    may_ask = coupling_.gate().asked(request->request, now_s);
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
  if (!tables_.due(now_s, last)) return;
  if (last) take_news();
  tables_.send(link_, last);
  if (received_) received_->report();
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
                                 {"gaps_resynced", 0},
                                 {"sequence", 0},
                                 {"messages_rejected", double(feeds_.rejected())}};
  tables_.add_status(values);
  meter_.add_status(values);
  if (received_) received_->add_status(values);
  if (options_.record) values[metrics::kRecordFailed] = double(options_.record->files_failed());
  meter_.add_recent(values);
  const CouplingState coupling = coupling_.gate().state();
  values["coupling"] = double(coupling.mode);
  values["buffers"] = double(coupling.buffers);
  if (const auto renderer = options_.renderer->get(); renderer.gl_ms > 0) {
    values["renderer_gl"] = renderer.kept == "gl";
    values["renderer_cpu_ms"] = renderer.cpu_ms;
    values["renderer_gl_ms"] = renderer.gl_ms;
  }
  add_prediction(values);
  return values;
}

}  // namespace telesplat::viewer
