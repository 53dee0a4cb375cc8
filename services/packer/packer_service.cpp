#include "services/packer/packer_service.h"

#include <CLI/CLI.hpp>
#include <optional>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/metrics/recorder.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "services/packer/epoch_hold.h"
#include "services/packer/points/block_gatherer.h"
#include "services/packer/points/depth_recorder.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/slices/packing.h"

namespace telesplat::packer {
namespace {

constexpr double kMarkPeriod_s = 0.5, kTickPeriod_s = 1.0;
constexpr int kTilesAtOnce = 8;  // then control and state requests get their turn

class PackerService {
 public:
  PackerService(const PackerServiceOptions& o, net::Context& context)
      : options_(o),
        tiles_(context, net::Kind::kPull, o.service.name + ":tiles",
               {.high_water_mark = 256, .max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes}),
        patches_(context, net::Kind::kPub, o.service.name + ":patches", {.high_water_mark = 4096}),
        state_(context, net::Kind::kRouter, o.service.name + ":state",
               {.high_water_mark = 1 << 20, .max_message_bytes = 16u << 20}) {}

  /// Binds the three sockets and says hello with their addresses.
  Status open(net::Context& context) {
    wire::Hello hello;
    hello.role = "packer";
    hello.name = options_.service.name;
    for (const auto& [socket, key] : {std::pair{&tiles_, "tiles"}, {&patches_, "patches"}, {&state_, "state"}}) {
      const auto endpoint = socket->bind(options_.service.bind, options_.service.insecure);
      if (!endpoint) return endpoint.error();
      hello.endpoints[key] = net::announced(*endpoint, options_.service.advertise);
    }
    if (!options_.record_depth.empty()) {
      auto recorder = DepthRecorder::open(options_.record_depth, options_.record_depth_frames);
      if (!recorder) return recorder.error();
      recorder_ = std::move(*recorder);
    }
    link_.emplace(context, options_.service.master, hello);
    return ok_status();
  }

  int serve() {
    while (!net::stop_requested() && !link_->shutdown_requested()) {
      const double now = monotonic_s();
      link_->tick(now, [&] { return status(); });
      periodic(now);
      net::wait_readable({&link_->socket(), &tiles_, &state_}, 50);
      receive_control();
      receive_state_requests();
      receive_tiles();
    }
    flush_spans();
    link_->leave([&] { return status(); });
    return 0;
  }

 private:
  double master_now() const { return link_->to_master_s(monotonic_s()); }

  void receive_control() {
    while (const auto message = link_->socket().receive())
      if (!link_->handle(*message, monotonic_s())) link_->socket().reject(*message, "its type is not expected here");
    follow_session();
    ahead_.expire(monotonic_s());
  }

  // The model's box comes with the data server; another box means another model.
  void follow_session() {
    if (!link_->session() || link_->version() == seen_version_) return;
    seen_version_ = link_->version();
    const wire::Welcome& s = *link_->session();
    if (volume_.follow(s, monotonic_s()) || s.box_room.empty()) return;
    const auto setting = [&](const char* key, double fallback) {
      const auto it = s.settings.find(key);
      return it == s.settings.end() ? fallback : it->second;
    };
    Config config;
    const bool keep = setting("packing.keep_redundant", 0) != 0;
    config.model = {s.box_room, int(s.octree_depth), !keep};
    if (const Status valid = points::validate(config.model); !valid) {
      log::error("the master's session cannot be packed: {}", valid.error().text);
      return;
    }
    config.redundancy = keep ? Redundancy::kKeep : Redundancy::kEliminate;
    config.relative_epsilon = float(setting("packing.epsilon", config.relative_epsilon));
    config.obsolete_after_s = setting("packing.obsolete_after_s", 0);
    config.max_points = uint64_t(setting("packing.max_points", 0));
    config.age_weight = setting("packing.age_weight", config.age_weight);
    config.rate_weight = setting("packing.rate_weight", config.rate_weight);
    config.patches_per_cluster =
        uint32_t(std::clamp(setting("packing.patches_per_cluster", config.patches_per_cluster), 0.0, 1e9));
    config.max_log_bytes = uint64_t(options_.log_limit_mb * 1e6);
    config.threads = options_.threads;
    // Another master counts frames from 1 again: which tiles came of the old one's says nothing. Where patches are told apart by their
    // frames the model starts anew, too.
    const bool another_master = core_ && master_ != s.master;
    master_ = s.master;
    if (another_master) {
      core_->forget_frames();
      gatherer_.clear();
    }
    if (!core_ || model_ != config.model || (another_master && core_->redundancy() == Redundancy::kKeep)) {
      if (core_) instance_ = net::make_instance_id();  // viewers start anew
      model_ = config.model;
      core_.emplace(config, s.epoch);
      gatherer_.clear();
    } else if (const auto event = core_->begin_epoch(s.epoch)) {
      publish(*event);
      gatherer_.clear();
    }
    for (const auto& [tile, bytes, since_s] : ahead_.take()) pack(tile, since_s);
  }

  void periodic(double now_s) {
    if (now_s - last_tick_s_ >= kTickPeriod_s) {
      last_tick_s_ = now_s;
      volume_.tick(now_s);
      flush_spans();
      if (core_)
        for (const auto& event : core_->tick(now_s)) publish(event);
    }
    if (core_ && now_s - last_mark_s_ >= kMarkPeriod_s) {
      last_mark_s_ = now_s;
      patches_.send(mark(false));
    }
  }

  wire::StateMark mark(bool answer) const {
    return {instance_, core_->sequence(), core_->epoch(), answer, core_->model().points()};
  }

  template <class Send>
  void send_event(const Event& e, Send&& send) {
    switch (e.kind) {
      case Event::Kind::kPatch:
        return send(wire::Patch{instance_, e.sequence, e.epoch, e.frame, e.viewer, e.request, e.tile, e.tiles_in_frame,
                                e.step, e.frame_complete, e.samples, e.kept, e.camera, e.rect,
                                std::as_bytes(std::span(*e.blob))});
      case Event::Kind::kForget:
        return send(wire::Forget{instance_, e.sequence, e.epoch, e.clusters, e.frames});
      case Event::Kind::kEpoch:
        return send(wire::EpochBegin{instance_, e.sequence, e.epoch});
    }
  }
  void publish(const Event& e) {
    send_event(e, [&](const auto& m) { patches_.send(m); });
  }

  void receive_tiles() {
    for (int n = 0; n < kTilesAtOnce; ++n) {
      const auto message = tiles_.receive();
      if (!message) return;
      net::dispatch<wire::DepthTile, wire::SliceImages>(tiles_, *message, [&](const auto& m) {
        if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::DepthTile>)
          pack({*message, m}, monotonic_s());
        else if (const Status s = volume_.receive(*message, m, monotonic_s()); !s)
          tiles_.reject(*message, s.error().text);
      });
    }
  }

  struct ReceivedTile {
    net::Message message;
    wire::DepthTile tile;  // its image lies in the message
  };

  // Of an epoch that is not announced yet: the announcement comes on another socket and may be about to.
  bool is_ahead(const wire::DepthTile& m) {
    if (m.lease.epoch > core_->epoch()) receive_control();
    return m.lease.epoch > core_->epoch();
  }

  void pack(const ReceivedTile& received, double since_s) {
    const auto& [message, m] = received;
    if (!core_) return;
    if (is_ahead(m)) return ahead_.add(received, message.body.size(), since_s);
    const auto& lease = m.lease;
    const auto block = uint32_t(lease.block);
    if (lease.epoch != core_->epoch()) return void(++other_epoch_);
    const double receive_s = link_->to_master_s(since_s), begin_s = master_now();
    wire::TileDone done{.frame = lease.frame,
                        .tile = lease.tile,
                        .lease = lease.lease,
                        .sampler = m.sampler,
                        .step = lease.step,
                        .rect = lease.rect,
                        .bytes_sampled = m.image.size(),
                        .leased_s = lease.leased_s,
                        .sample_begin_s = m.sample_begin_s,
                        .sample_end_s = m.sample_end_s,
                        .encode_end_s = m.encode_end_s,
                        .receive_s = receive_s};
    const auto tell = [&] {
      done.packed_s = master_now();
      link_->socket().send(done);
    };
    // What is here already is done, should the master not know; if it does, it takes no notice.
    if (core_->has(lease.frame, block)) {
      ++duplicates_;
      return tell();
    }
    const std::span stream(reinterpret_cast<const uint8_t*>(m.image.data()), m.image.size());
    auto gathered = gatherer_.add({lease.frame,
                                   lease.epoch,
                                   block,
                                   uint32_t(lease.blocks_in_frame),
                                   uint32_t(lease.step),
                                   lease.camera,
                                   lease.block_rect,
                                   lease.viewer,
                                   lease.request,
                                   {}},
                                  lease.rect, stream);
    if (!gathered) return tiles_.reject(message, gathered.error().text);
    if (!*gathered) return tell();
    done.samples = (*gathered)->samples;
    if (core_->redundancy() == Redundancy::kKeep) done.kept = done.samples;
    if (!(*gathered)->block) return tell();
    const double gathered_s = master_now();
    record(*(*gathered)->block);
    std::shared_ptr<const std::vector<uint8_t>> ready;
    if ((*gathered)->is_block) ready = std::make_shared<const std::vector<uint8_t>>(stream.begin(), stream.end());
    // What a block gives is counted to the tile that completed it.
    const auto announce = [&](const Event& event) {
      publish(event);
      if (core_->redundancy() == Redundancy::kEliminate) done.kept = event.kept;
      done.bytes_sent = event.blob->size();
      bytes_sent_ += done.bytes_sent;
      tell();
    };
    const auto event = core_->submit(std::move(*(*gathered)->block), monotonic_s(), std::move(ready), announce);
    if (!event) return tiles_.reject(message, event.error().text);
    if (*event && (*event)->frame_complete)
      for (const auto& forget : core_->forget_superseded()) publish(forget);
    spans_.add("decode", begin_s, gathered_s);
    spans_.add("pack", gathered_s, master_now());
  }

  // Whole views only, as sampled.
  void record(const SampledTile& block) {
    if (!recorder_ || block.step != 1) return;
    if (const Status s = recorder_->add(block.frame, block.camera, block.rect, block.tiles_in_frame, block.image); !s) {
      log::error("{}", s.error().text);
      recorder_.reset();
    }
  }

  void receive_state_requests() {
    for (int n = 0; n < 64; ++n) {
      const auto message = state_.receive();
      if (!message) return;
      net::dispatch<wire::StateRequest, wire::AccessReport, wire::SliceAck>(state_, *message, [&](const auto& m) {
        if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::SliceAck>) {
          if (const Status s = volume_.acknowledged(message->peer, m, monotonic_s()); !s)
            state_.reject(*message, s.error().text);
        } else if (!core_) {
          return;
        } else if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::AccessReport>)
          core_->accessed(m.clusters, monotonic_s(), m.frames);
        else
          answer(message->peer, m);
      });
    }
  }

  void answer(const std::string& peer, const wire::StateRequest& request) {
    const Sequence after =
        request.packer == instance_ && request.after <= core_->sequence() ? request.after : Sequence{};
    if (!core_->remembers(after)) {
      // A packer it does not know: then it asks for everything.
      state_.send(wire::StateMark{net::make_instance_id(), {}, core_->epoch(), false, 0}, peer);
      return log::info("a viewer that stopped after {} starts anew", after.value);
    }
    const auto events = core_->events_since(after);
    for (const auto& e : events) send_event(e, [&](const auto& m) { state_.send(m, peer); });
    state_.send(mark(true), peer);
    log::info("a viewer caught up: {} events after {}", events.size(), after.value);
  }

  net::MasterLink::Values status() const {
    net::MasterLink::Values v{
        {"rss_mb", net::resident_mb()},
        {"peak_rss_mb", net::peak_resident_mb()},
        {"bytes_sent", double(bytes_sent_)},
        {"messages_rejected", double(tiles_.rejected() + patches_.rejected() + state_.rejected())}};
    if (core_) {
      const auto& s = core_->statistics();
      const auto& g = gatherer_.statistics();
      v.insert({{"points", double(core_->model().points())},
                {"model_bytes", double(core_->model().bytes())},
                {"log_bytes", double(core_->log_bytes())},
                {"sequence", double(core_->sequence().value)},
                {"tiles", double(g.tiles)},
                {"tiles_duplicate", double(s.tiles_duplicate + g.tiles_duplicate + duplicates_)},
                {"tiles_other_epoch", double(s.tiles_other_epoch + other_epoch_ + ahead_.dropped())},
                {"blocks", double(s.tiles)},
                {"blocks_dropped", double(g.blocks_dropped)},
                {"frames_complete", double(s.frames_complete)},
                {"patches_forgotten", double(s.patches_forgotten)},
                {"points_forgotten", double(s.points_forgotten)},
                {"points_outside", double(s.points_outside)}});
    }
    volume_.add_status(v);
    return v;
  }

  void flush_spans() {
    if (const auto rows = spans_.flush(link_->instance())) link_->socket().send(*rows);
  }

  const PackerServiceOptions& options_;
  net::Socket tiles_, patches_, state_;
  std::optional<net::MasterLink> link_;
  InstanceId instance_ = net::make_instance_id(), master_;
  std::optional<PackerCore> core_;
  BlockGatherer gatherer_;
  EpochHold<ReceivedTile> ahead_;
  std::optional<DepthRecorder> recorder_;
  points::ModelConfig model_;
  metrics::SpanRecorder spans_;
  VolumePacking volume_{
      {.tell = [this](const wire::TileDone& m) { link_->socket().send(m); },
       .send = [this](const wire::SliceFrame& m, const std::string& peer) { return state_.send(m, peer); },
       .master_now = [this] { return master_now(); },
       .to_master_s = [this](double s) { return link_->to_master_s(s); }},
      spans_};
  int seen_version_ = 0;
  uint64_t bytes_sent_ = 0, duplicates_ = 0, other_epoch_ = 0;
  double last_mark_s_ = 0, last_tick_s_ = 0;
};

}  // namespace

void add_flags(CLI::App& app, PackerServiceOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kBoth);
  app.add_option("--threads", o.threads, "threads for reference depth maps; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--record-depth", o.record_depth, "folder to keep sampled depth images in");
  app.add_option("--record-depth-frames", o.record_depth_frames, "depth images to keep at most")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  app.add_option("--log-limit-mb", o.log_limit_mb, "memory for the events that late joiners get")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e6));
}

int run(const PackerServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  net::Context context;
  PackerService service(o, context);
  if (const Status s = service.open(context); !s) {
    log::error("{}", s.error().text);
    return 2;
  }
  return service.serve();
}

}  // namespace telesplat::packer
