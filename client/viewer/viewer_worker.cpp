#include "client/viewer/viewer_worker.h"

#include <algorithm>

#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

constexpr double kReportPeriod_s = 1.0;
constexpr size_t kSummariesAtOnce = 8;
constexpr int kMessagesAtOnce = 16;  // then requests and control get their turn
// How long it takes until the worker looks at what the display did. Where the display waits, that is time lost in each cycle.
constexpr double kPoll_s = 0.01, kCoupledPoll_s = 0.001;

wire::Hello make_hello(const ReplicaWorker::Options& o) {
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

ReplicaWorker::ReplicaWorker(net::Context& context, const Options& options, ViewerCaches& caches,
                             metrics::TableRecorder& frames, metrics::SpanRecorder& spans)
    : context_(context),
      options_(options),
      caches_(caches),
      frames_(frames),
      spans_(spans),
      updates_table_("updates",
                     {"request", "frame", "requested_s", "first_s", "complete_s", "latency_ms", "start_up_ms", "tiles",
                      "samples", "points", "bytes", "eliminated", "sampling_width", "sampling_height", "epoch"}),
      link_(context, options.service.master, make_hello(options)),
      points_({link_.instance(), options.epoch_patience_s, options.events, caches.gate.waits()},
              {[this] {
                 return points::ModelConfig{link_.session()->box_room, int(link_.session()->octree_depth),
                                            !keeps_redundant_};
               },
               [this](InstanceId packer, Sequence after) {
                 if (state_) state_->send(wire::StateRequest{link_.instance(), packer, after});
               },
               [this](const ViewPart& part) { on_part(part); }, [this] { on_epoch(); },
               [this](double s) { return to_master_s(s); }},
              caches.points, caches.batches, spans),
      slices_({link_.instance(), uint64_t(caches.gate.buffers())},
              {[this](RequestId r) { return requester_.requested_s(r); },
               [this](RequestId r) { return caches_.gate.with([r](Coupling& c) { return c.is_open(r); }); },
               [this](const ViewPart& part) {
                 // The packer sends frames in order.
                 caches_.gate.with([&](Coupling& c) { c.skip_before(part.request); });
                 on_part(part);
               },
               [this] { on_epoch(); }, [this](double s) { return to_master_s(s); }},
              caches.slices, spans),
      requester_(with_buffers(options.requests, caches.gate), link_.instance()),
      started_s_(options.started_s > 0 ? options.started_s : monotonic_s()),
      thread_([this] { loop(); }) {}

ReplicaWorker::~ReplicaWorker() {
  stop_ = true;
  thread_.join();
}

void ReplicaWorker::on_pose(double now_s, const geometry::Camera& camera) {
  const std::lock_guard lock(mutex_);
  poses_.push_back({now_s, camera});
}

void ReplicaWorker::on_first_points(double now_s) {
  if (first_points_s_ == 0) first_points_s_ = now_s - started_s_;
}

void ReplicaWorker::on_frame(double now_s, const geometry::Camera& camera, EpochId epoch,
                             const ShownUpdate* waited_for) {
  ++frames_shown_;
  // Where nothing is held back it is the receiver of points that knows.
  if (const uint64_t before = epoch_shown_.exchange(epoch.value); before != 0 && before != epoch.value) ++epochs_shown_;
  const std::lock_guard lock(mutex_);
  poses_.push_back({now_s, camera, waited_for ? waited_for->requested_s : 0.0});
}

void ReplicaWorker::on_seen(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames) {
  const std::lock_guard lock(mutex_);
  seen_.add(clusters, frames);
}

ShownUpdate ReplicaWorker::last_update() const {
  const std::lock_guard lock(mutex_);
  return last_update_;
}

ReplicaWorker::Figures ReplicaWorker::figures() const {
  const std::lock_guard lock(mutex_);
  return {scene_, extent_m_, updates_, bytes_received_, latency_ms_, epochs_shown_};
}

void ReplicaWorker::loop() {
  net::lower_thread_priority(5);  // the display comes first
  const double poll_s = caches_.gate.waits() ? kCoupledPoll_s : kPoll_s;
  try {
    while (!stop_) {
      const double now = monotonic_s();
      link_.tick(now, [this] { return status(); });
      connect_if_changed();
      request_views(now);
      report(now, false);
      std::vector<net::Socket*> sockets{&link_.socket()};
      if (patches_) sockets.push_back(&*patches_);
      if (state_) sockets.push_back(&*state_);
      net::wait_readable_s(sockets, poll_s);
      receive_control();
      if (state_ && kind_ == SceneKind::kVolume) {
        slices_.receive(*state_, kMessagesAtOnce);
        slices_.tick(monotonic_s(), *state_);
      } else if (state_) {
        points_.receive_answers(*state_, kMessagesAtOnce);
        points_.receive_events(*patches_, kMessagesAtOnce);
        points_.tick(monotonic_s());  // by time: no message need come
        if (!caches_.gate.waits()) caches_.points.summarise(kSummariesAtOnce);
        caches_.points.free_dropped();
      }
    }
    report(monotonic_s(), true);
    link_.leave([this] { return status(); });
  } catch (const std::exception& e) {
    log::error("the viewer's worker failed: {}", e.what());
    shutdown_ = true;
  }
}

void ReplicaWorker::connect_if_changed() {
  if (link_.version() == seen_version_) return;
  seen_version_ = link_.version();
  const auto& session = *link_.session();
  const auto keep = session.settings.find("packing.keep_redundant");
  keeps_redundant_ = keep != session.settings.end() && keep->second != 0;
  offset_s_ = link_.to_master_s(0);
  if (std::exchange(master_, session.master) != session.master) {
    other_master_ = true;  // it knows nothing of what was asked for
    slices_.begin_anew();
  }
  if (session.box_room.empty()) return;
  const auto text = [](const std::map<std::string, std::string>& from, const char* key) {
    const auto it = from.find(key);
    return it == from.end() ? std::string() : it->second;
  };
  const glm::vec3 size = session.box_room.size();
  {
    const std::lock_guard lock(mutex_);
    scene_ = text(session.facts, "scene");
    extent_m_ = std::max({size.x, size.y, size.z});
  }
  const SceneKind kind = text(session.facts, "kind") == "volume" ? SceneKind::kVolume : SceneKind::kPoints;
  if (kind_ != SceneKind::kUnknown && kind_ != kind)
    return log::error("the session's scene is of another kind now: start this viewer again to see it");
  if (kind == SceneKind::kVolume)
    if (const Status s = slices_.set_session(session); !s)
      return log::error("the volume as the master tells of it cannot be shown: {}", s.error().text);
  kind_ = kind;
  connect(kind == SceneKind::kVolume ? std::string() : text(session.endpoints, "patches"),
          text(session.endpoints, "state"));
}

void ReplicaWorker::connect(const std::string& patches, const std::string& state) {
  const bool points = kind_ == SceneKind::kPoints;
  if (state.empty() || (points && patches.empty())) return;
  if (patches == patches_endpoint_ && state == state_endpoint_) return;
  patches_endpoint_ = patches;
  state_endpoint_ = state;
  const net::SocketOptions bulk{.high_water_mark = 4096,
                                .max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes};
  if (points) patches_.emplace(context_, net::Kind::kSub, options_.service.name + ":patches", bulk);
  state_.emplace(context_, net::Kind::kDealer, options_.service.name + ":state", bulk);
  if (patches_)
    if (const Status s = patches_->connect(patches); !s) log::error("{}", s.error().text);
  if (const Status s = state_->connect(state); !s) log::error("{}", s.error().text);
  if (points)
    points_.start();
  else
    slices_.begin_anew();
}

void ReplicaWorker::receive_control() {
  while (const auto message = link_.socket().receive())
    if (!link_.handle(*message, monotonic_s())) link_.socket().reject(*message, "its type is not expected here");
  if (link_.shutdown_requested()) shutdown_ = true;
}

void ReplicaWorker::on_epoch() { requester_.on_epoch(to_master_s(monotonic_s())); }

void ReplicaWorker::on_part(const ViewPart& part) {
  const double local_s = monotonic_s(), now_s = to_master_s(local_s);
  bytes_received_ += part.bytes;
  if (part.viewer != link_.instance()) return;
  caches_.gate.with([&](Coupling& c) { c.progress(local_s); });
  const auto u = requester_.on_part(part, now_s);
  if (!u) return;
  const double eliminated =
      kind_ == SceneKind::kPoints && u->samples ? 1.0 - double(u->points) / double(u->samples) : 0.0;
  updates_table_.add({double(u->request.value), double(part.frame.value), u->requested_s, u->first_s, u->complete_s,
                      (u->complete_s - u->requested_s) * 1e3, (u->first_s - u->requested_s) * 1e3, double(u->tiles),
                      double(u->samples), double(u->points), double(u->bytes), eliminated, double(part.camera.width),
                      double(part.camera.height), double(part.epoch.value)});
  spans_.add("view update", u->requested_s, u->complete_s, 2);
  const ShownUpdate update{u->request, u->requested_s, part.camera.pose};
  {
    const std::lock_guard lock(mutex_);
    last_update_ = update;
    latency_ms_ = (u->complete_s - u->requested_s) * 1e3;
    ++updates_;
  }
  if (!caches_.gate.waits()) return;
  complete_[u->request] = update;
  caches_.gate.with([&](Coupling& c) { release(c.completed(u->request, local_s)); });
}

// To be called before the display can take them: with the gate closed.
void ReplicaWorker::release(const std::vector<RequestId>& requests) {
  for (const RequestId request : requests) {
    caches_.batches.close(complete_[request]);
    complete_.erase(complete_.begin(), complete_.upper_bound(request));
  }
}

void ReplicaWorker::request_views(double now_s) {
  std::vector<SeenPose> poses;
  {
    const std::lock_guard lock(mutex_);
    poses.swap(poses_);
  }
  for (const auto& p : poses) {
    requester_.on_pose(to_master_s(p.t_s), p.camera);
    if (p.waited_since_s > 0) requester_.on_displayed(to_master_s(p.t_s) - p.waited_since_s);
  }
  if (!link_.session() || !state_) return;
  std::vector<RequestId> again;
  bool may_ask = true;
  caches_.gate.with([&](Coupling& c) {
    std::vector<RequestId> released;
    again = c.overdue(now_s, released);
    release(released);
    if (std::exchange(other_master_, false)) again = c.open();
    may_ask = c.may_ask();
  });
  for (const auto& request : requester_.again(again, to_master_s(now_s))) link_.socket().send(request);
  while (may_ask) {
    const auto request = requester_.next(to_master_s(now_s));
    if (!request) return;
    link_.socket().send(*request);
    caches_.gate.with([&](Coupling& c) {
      c.asked(request->request, now_s);
      may_ask = c.waits() && c.may_ask();
    });
  }
}

void ReplicaWorker::report(double now_s, bool last) {
  if (!last && now_s - last_report_s_ < kReportPeriod_s) return;
  last_report_s_ = now_s;
  for (const auto& rows :
       {frames_.flush(link_.instance()), updates_table_.flush(link_.instance()), spans_.flush(link_.instance())})
    if (rows) link_.socket().send(*rows);
  send_access_reports();
}

void ReplicaWorker::send_access_reports() {
  {
    const std::lock_guard lock(mutex_);
    std::swap(seen_, reported_);
  }
  for (auto& part : reported_.reports())
    if (state_) state_->send(wire::AccessReport{link_.instance(), std::move(part.clusters), std::move(part.frames)});
}

net::MasterLink::Values ReplicaWorker::status() const {
  const auto model = caches_.points.figures();
  const auto slices = caches_.slices.figures();
  const auto points = points_.figures();
  const auto volume = slices_.figures();
  const bool held = kind_ == SceneKind::kVolume || caches_.gate.waits();
  return {{"rss_mb", net::resident_mb()},
          {"peak_rss_mb", net::peak_resident_mb()},
          {"points", double(model.points)},
          {"model_bytes", double(model.bytes)},
          {"pixels", double(slices.pixels)},
          {"points_received", double(points.points_received)},
          {"bytes_received", double(bytes_received_)},
          {"gaps_resynced", double(points.gaps)},
          {"updates", double(updates_)},
          {"frames", double(frames_shown_)},
          {"first_points_s", first_points_s_},
          {"epochs_shown", double(held ? uint64_t(epochs_shown_) : points.epochs_shown)},
          {"epoch", double(held ? uint64_t(epoch_shown_) : points.epoch.value)},
          {"sequence", double(points.sequence.value)},
          {"messages_rejected", double((patches_ ? patches_->rejected() : 0) + (state_ ? state_->rejected() : 0) +
                                       points.decode_errors + volume.decode_errors)}};
}

}  // namespace telesplat::viewer
