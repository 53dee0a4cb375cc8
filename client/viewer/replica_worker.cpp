#include "client/viewer/replica_worker.h"

#include <algorithm>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"

namespace telesplat::viewer {
namespace {

constexpr double kReportPeriod_s = 1.0, kAnswerPatience_s = 2.0;
constexpr int kMessagesAtOnce = 16;  // then requests and control get their turn

wire::Hello make_hello(const ReplicaWorker::Options& o) {
  wire::Hello hello;
  hello.role = "viewer";
  hello.name = o.service.name;
  hello.instance = net::make_instance_id();
  hello.facts = o.facts;
  return hello;
}

}  // namespace

ReplicaWorker::ReplicaWorker(net::Context& context, const Options& options, ModelCache& cache,
                             metrics::TableRecorder& frames, metrics::SpanRecorder& spans)
    : context_(context),
      options_(options),
      cache_(cache),
      frames_(frames),
      spans_(spans),
      updates_table_("updates",
                     {"request", "frame", "requested_s", "first_s", "complete_s", "latency_ms", "start_up_ms", "tiles",
                      "samples", "points", "bytes", "eliminated", "sampling_width", "sampling_height", "epoch"}),
      link_(context, options.service.master, make_hello(options)),
      sequencer_({[this](const ModelEvent& e) { apply(e); },
                  [this] {
                    points::ModelConfig config{link_.session()->box_room, int(link_.session()->octree_depth)};
                    begin_replica(config, {}, {});
                    if (options_.events) options_.events->begin_replica(config);
                  },
                  [this](InstanceId packer, Sequence after) {
                    asked_s_ = monotonic_s();
                    if (state_) state_->send(wire::StateRequest{link_.instance(), packer, after});
                  }}),
      switch_(options.epoch_patience_s),
      requester_(options.requests, link_.instance()),
      started_s_(options.started_s > 0 ? options.started_s : monotonic_s()),
      thread_([this] { loop(); }) {}

ReplicaWorker::~ReplicaWorker() {
  stop_ = true;
  thread_.join();
}

void ReplicaWorker::on_pose(double now_s, const geometry::Camera& camera) {
  const std::lock_guard lock(mutex_);
  poses_.emplace_back(now_s, camera);
}

void ReplicaWorker::on_first_points(double now_s) {
  if (first_points_s_ == 0) first_points_s_ = now_s - started_s_;
}

void ReplicaWorker::on_frame(double now_s, const geometry::Camera& camera, const splat::DrawList& list) {
  on_pose(now_s, camera);
  ++frames_shown_;
  const std::lock_guard lock(mutex_);
  seen_.add(list.clusters_seen, list.frames_seen);
}

ReplicaWorker::LastUpdate ReplicaWorker::last_update() const {
  const std::lock_guard lock(mutex_);
  return last_update_;
}

ReplicaWorker::Figures ReplicaWorker::figures() const {
  const std::lock_guard lock(mutex_);
  return {scene_, extent_m_, updates_, bytes_received_, latency_ms_, epochs_shown_};
}

void ReplicaWorker::loop() {
  net::lower_thread_priority(5);  // the display comes first
  try {
    while (!stop_) {
      const double now = monotonic_s();
      link_.tick(now, [this] { return status(); });
      connect_if_changed();
      request_view(now);
      report(now, false);
      if (sequencer_.waiting() && now - asked_s_ > kAnswerPatience_s) sequencer_.retry();
      std::vector<net::Socket*> sockets{&link_.socket()};
      if (patches_) sockets.push_back(&*patches_);
      if (state_) sockets.push_back(&*state_);
      net::wait_readable(sockets, 10);
      receive_control();
      receive_answers();
      receive_events();
      show_if_due();  // by time: no message need come
      cache_.free_dropped();
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
  const auto endpoint = [&](const char* key) {
    const auto it = session.endpoints.find(key);
    return it == session.endpoints.end() ? std::string() : it->second;
  };
  const std::string patches = endpoint("patches"), state = endpoint("state");
  if (!session.box_room.empty()) {
    const auto named = session.facts.find("scene");
    const glm::vec3 size = session.box_room.size();
    const std::lock_guard lock(mutex_);
    scene_ = named == session.facts.end() ? std::string() : named->second;
    extent_m_ = std::max({size.x, size.y, size.z});
  }
  if (patches.empty() || state.empty() || session.box_room.empty()) return;
  if (patches == patches_endpoint_ && state == state_endpoint_) return;
  patches_endpoint_ = patches;
  state_endpoint_ = state;
  const net::SocketOptions bulk{.high_water_mark = 4096,
                                .max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes};
  patches_.emplace(context_, net::Kind::kSub, options_.service.name + ":patches", bulk);
  state_.emplace(context_, net::Kind::kDealer, options_.service.name + ":state", bulk);
  for (const auto& [socket, address] : {std::pair{&*patches_, patches}, std::pair{&*state_, state}})
    if (const Status s = socket->connect(address); !s) log::error("{}", s.error().text);
  sequencer_.start();
}

void ReplicaWorker::receive_control() {
  while (const auto message = link_.socket().receive())
    if (!link_.handle(*message, monotonic_s())) link_.socket().reject(*message, "its type is not expected here");
  if (link_.shutdown_requested()) shutdown_ = true;
}

void ReplicaWorker::receive_events() {
  if (!patches_) return;
  for (int n = 0; n < kMessagesAtOnce; ++n) {
    const auto message = patches_->receive();
    if (!message) return;
    net::dispatch<wire::Patch, wire::Forget, wire::EpochBegin, wire::StateMark>(*patches_, *message, [&](auto& m) {
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::StateMark>)
        sequencer_.on_mark(m);
      else
        sequencer_.on_published({m, message->owner});
    });
  }
}

void ReplicaWorker::receive_answers() {
  if (!state_) return;
  for (int n = 0; n < kMessagesAtOnce; ++n) {
    const auto message = state_->receive();
    if (!message) return;
    asked_s_ = monotonic_s();  // an answer that is coming in is not late
    net::dispatch<wire::Patch, wire::Forget, wire::EpochBegin, wire::StateMark>(*state_, *message, [&](auto& m) {
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::StateMark>)
        sequencer_.on_mark(m);
      else
        sequencer_.on_replayed({m, message->owner});
    });
  }
}

void ReplicaWorker::apply(const ModelEvent& event) {
  const bool applied = std::visit(
      [this](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<E, wire::Patch>)
          return apply_patch(e);
        else if constexpr (std::is_same_v<E, wire::Forget>)
          cache_.forget(e.sequence, e.clusters, e.frames);
        else
          begin_replica(cache_.config(), e.epoch, e.sequence), requester_.on_epoch(to_master_s(monotonic_s()));
        return true;
      },
      event.body);
  // After it: points are shown first. What could not be applied could not be replayed either.
  if (applied && options_.events) options_.events->add(event);
}

void ReplicaWorker::begin_replica(const points::ModelConfig& config, EpochId epoch, Sequence sequence) {
  const bool held = cache_.begin_replica(config, epoch, sequence);
  switch_.begin(epoch, held, monotonic_s());
}

void ReplicaWorker::show_if_due() {
  const double now_s = monotonic_s();
  if (!switch_.due(now_s)) return;
  cache_.show_newest();
  if (const auto since_s = switch_.waiting_since_s()) {
    ++epochs_shown_;
    spans_.add("epoch held", to_master_s(*since_s), to_master_s(now_s), 3);
  }
  switch_.shown();
}

bool ReplicaWorker::apply_patch(const wire::Patch& patch) {
  const double begin = monotonic_s();
  // Events in order always tell of an epoch before its first patch; a replica is never of two.
  if (cache_.epoch().value != 0 && patch.epoch != cache_.epoch()) {
    ++decode_errors_;
    log::warn("patch {} is of epoch {} while the model is of epoch {}: dropped", patch.sequence.value,
              patch.epoch.value, cache_.epoch().value);
    return false;
  }
  const auto bytes = std::span(reinterpret_cast<const uint8_t*>(patch.image.data()), patch.image.size());
  if (const Status decoded = codec::decode_into(tile_, bytes, patch.rect.width, patch.rect.height); !decoded) {
    ++decode_errors_;
    log::warn("patch {} cannot be decoded: {}", patch.sequence.value, decoded.error().text);
    return false;
  }
  const double decoded = monotonic_s();
  cache_.insert(points::prepare_patch(cache_.config(), patch.sequence, patch.camera, patch.rect, tile_, patch.frame),
                patch.epoch);
  const double inserted = monotonic_s();
  spans_.add("decode", to_master_s(begin), to_master_s(decoded), 1);
  spans_.add("insert", to_master_s(decoded), to_master_s(inserted), 1);
  points_received_ += patch.kept;
  bytes_received_ += patch.image.size();
  switch_.on_part({patch.epoch, patch.step, patch.frame_complete, patch.viewer == link_.instance()}, inserted);
  show_if_due();

  if (const auto u = requester_.on_applied(patch, to_master_s(inserted))) {
    updates_table_.add({double(u->request.value), double(patch.frame.value), u->requested_s, u->first_s, u->complete_s,
                        (u->complete_s - u->requested_s) * 1e3, (u->first_s - u->requested_s) * 1e3, double(u->tiles),
                        double(u->samples), double(u->points), double(u->bytes),
                        u->samples ? 1.0 - double(u->points) / double(u->samples) : 0.0, double(u->camera.width),
                        double(u->camera.height), double(patch.epoch.value)});
    spans_.add("view update", u->requested_s, u->complete_s, 2);
    const std::lock_guard lock(mutex_);
    last_update_ = {u->requested_s, u->camera.pose, patch.sequence.value};
    latency_ms_ = (u->complete_s - u->requested_s) * 1e3;
    ++updates_;
  }
  return true;
}

void ReplicaWorker::request_view(double now_s) {
  std::vector<std::pair<double, geometry::Camera>> poses;
  {
    const std::lock_guard lock(mutex_);
    poses.swap(poses_);
  }
  for (const auto& [t, camera] : poses) requester_.on_pose(to_master_s(t), camera);
  if (!link_.session() || !patches_) return;
  if (const auto request = requester_.next(to_master_s(now_s))) link_.socket().send(*request);
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
  const auto figures = cache_.figures();
  return {{"rss_mb", net::resident_mb()},
          {"peak_rss_mb", net::peak_resident_mb()},
          {"points", double(figures.points)},
          {"model_bytes", double(figures.bytes)},
          {"points_received", double(points_received_)},
          {"bytes_received", double(bytes_received_)},
          {"gaps_resynced", double(sequencer_.gaps())},
          {"updates", double(updates_)},
          {"frames", double(frames_shown_)},
          {"first_points_s", first_points_s_},
          {"epochs_shown", double(epochs_shown_)},
          {"epoch", double(switch_.displayed().value)},
          {"sequence", double(sequencer_.applied().value)},
          {"messages_rejected",
           double((patches_ ? patches_->rejected() : 0) + (state_ ? state_->rejected() : 0) + decode_errors_)}};
}

}  // namespace telesplat::viewer
