#include "services/sampler/sampler_service.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <optional>

#include "common/core/clock.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "services/sampler/drain_guard.h"
#include "services/sampler/julia/work.h"
#include "services/sampler/mesh/work.h"
#include "services/sampler/tiles/replay.h"
#include "services/sampler/tiles/work.h"
#include "services/sampler/volume/shear/slabs.h"
#include "services/sampler/volume/work.h"

namespace telesplat::sampler {
namespace {

constexpr int kLeases = 2;          // held and asked for: one being sampled, one to go on with at once
constexpr double kIdle_s = 0.1;     // the longest wait: then status reports and hellos are due
constexpr double kSpanFlush_s = 1;  // between two deliveries of spans
constexpr double kSendAgain_s = 0.025, kSendFor_s = 1;  // to a packer that is slow or being restarted

class SamplerService {
 public:
  /// sampler: for meshes, if it had to be made beforehand; replay: replaces all other work.
  SamplerService(const SamplerServiceOptions& o, InstanceId instance, std::unique_ptr<Sampler> sampler,
                 std::unique_ptr<LeaseWork> replay, net::Context& context)
      : options_(o),
        context_(context),
        mesh_sampler_(std::move(sampler)),
        replays_(replay != nullptr),
        link_(context, o.service.master, make_hello(o, instance)) {
    if (replays_) set_work(tile_work(std::move(replay)));
  }

  int serve() {
    std::optional<double> give_up_s;  // set once told to stop
    while (!link_.shutdown_requested() && !failed_) {
      const double now = monotonic_s();
      if (net::stop_requested() && !give_up_s) give_up_s = now + kDrain_s;
      link_.tick(now, [&] { return status(); });
      flush_metrics(now);
      send_out(now);
      const Readiness next = look_at_next(now);
      const bool ready = held() > 0 && next.state == Readiness::State::kReady && !unsent_;
      if (give_up_s) {
        // What cannot be sampled now, or comes only now, is left to the master: it goes to others with our goodbye.
        const bool waits = unsent_ || (held() > 0 && next.again_s < *give_up_s);
        if ((!ready && !waits) || now > *give_up_s) break;
      } else {
        ask_for_leases();
      }
      if (work_) work_->fetch(now);
      if (!ready) wait(std::min(unsent_ ? kSendAgain_s : next.again_s - now, kIdle_s));
      receive_control(!give_up_s);
      if (work_) work_->receive(monotonic_s());
      // What came meanwhile may have changed what is known of the lease's epoch.
      if (ready && look_at_next(monotonic_s()).state == Readiness::State::kReady && held() > 0) sample_next();
    }
    flush_metrics(1e300);
    link_.leave([&] { return status(); });
    return failed_ ? 1 : 0;
  }

 private:
  static wire::Hello make_hello(const SamplerServiceOptions& o, InstanceId instance) {
    wire::Hello hello;
    hello.role = "sampler";
    hello.name = o.service.name;
    hello.instance = instance;
    hello.facts = {{"sampler", o.kind}, {"threads", std::to_string(o.threads)}, {"leases", std::to_string(kLeases)}};
    return hello;
  }

  net::MasterLink::Values status() const {
    net::MasterLink::Values values{{"rss_mb", net::resident_mb()},
                                   {"peak_rss_mb", net::peak_resident_mb()},
                                   {"tiles_sampled", double(tiles_sampled_)}};
    if (work_) work_->add_status(values);
    return values;
  }

  void flush_metrics(double now_s) {
    if (now_s - last_flush_s_ < kSpanFlush_s) return;
    last_flush_s_ = now_s;
    if (const auto rows = spans_.flush(link_.instance())) link_.socket().send(*rows);
  }

  size_t held() const { return work_ ? work_->leases() : 0; }
  Readiness look_at_next(double now_s) {
    return work_ ? work_->look_at_next(now_s) : Readiness{Readiness::State::kWaits};
  }

  // Every welcome counts: a later one may be of another epoch whose leases are already on their way.
  void on_welcome() {
    const wire::Welcome& session = *link_.session();
    if (session.master != master_) {  // another master knows nothing of the leases we asked for
      master_ = session.master;
      leases_asked_ = 0;
      if (work_) work_->drop_leases();
    }
    const auto tiles = session.endpoints.find("tiles");
    if (tiles != session.endpoints.end() && !tiles->second.empty() && tiles->second != tiles_endpoint_) {
      tiles_endpoint_ = tiles->second;
      tiles_.emplace(context_, net::Kind::kPush, options_.service.name + ":tiles",
                     net::SocketOptions{.high_water_mark = 64});
      if (const Status s = tiles_->connect(tiles_endpoint_); !s) log::error("{}", s.error().text);
    }
    const auto kind = session.facts.find("kind");
    if (kind != session.facts.end() && kind->second != kind_ && !replays_) choose_work(kind->second);
    if (work_) work_->on_welcome(session);
  }

  void choose_work(const std::string& kind) {
    kind_ = kind;
    work_.reset();
    const auto cache_bytes = uint64_t(options_.chunk_cache_mb * 1e6);
    if (kind == "julia") {
      set_work(tile_work(std::make_unique<JuliaWork>(options_.threads)));
    } else if (kind == "mesh") {
      if (!mesh_sampler_) {
        auto made = make_sampler(options_.kind, options_.threads);
        if (!made) {
          log::error("{}", made.error().text);
          failed_ = true;
          return;
        }
        mesh_sampler_ = std::move(*made);
      }
      set_work(tile_work(std::make_unique<MeshWork>(std::move(mesh_sampler_), cache_bytes, options_.service.name,
                                                    context_, link_, spans_)));
    } else if (kind == "volume") {
      const VolumeWork::Master master{.instance = link_.instance(),
                                      .ready = [this](const wire::SlabReady& m) { link_.socket().send(m); },
                                      .extend = [this](const wire::LeaseExtend& m) { link_.socket().send(m); },
                                      .to_master_s = [this](double s) { return link_.to_master_s(s); }};
      set_work(std::make_unique<VolumeWork>(make_shear_slabs(options_.threads), options_.threads, cache_bytes,
                                            options_.service.name, context_, master, spans_, options_.repeat_views));
    } else {
      log::error("the session's data are of kind '{}'; this sampler knows julia, mesh and volume", kind.substr(0, 64));
    }
  }

  std::unique_ptr<SamplingWork> tile_work(std::unique_ptr<LeaseWork> work) {
    return std::make_unique<TileWork>(std::move(work), link_);
  }
  void set_work(std::unique_ptr<SamplingWork> work) {
    work_ = std::move(work);
    link_.tell("sampler", work_->name());
  }

  void ask_for_leases() {
    if (!tiles_ || !work_ || !work_->takes_leases()) return;
    while (leases_asked_ + int(held()) < kLeases) {
      link_.socket().send(wire::LeaseRequest{link_.instance()});
      ++leases_asked_;
    }
  }

  void wait(double for_s) {
    std::vector<net::Socket*> sockets{&link_.socket()};
    if (work_)
      for (net::Socket* s : work_->sockets()) sockets.push_back(s);
    net::wait_readable_s(sockets, std::max(for_s, 0.0));
  }

  void receive_control(bool takes_leases) {
    while (const auto message = link_.socket().receive()) {
      const double now = monotonic_s();
      const int version = link_.version();
      if (link_.handle(*message, now)) {
        if (message->type == wire::WhoAreYou::kName) leases_asked_ = 0;
        if (link_.version() != version) on_welcome();
        continue;
      }
      // An answer is an answer, be it one that cannot be read.
      if (message->type == wire::Lease::kName || message->type == wire::SliceLease::kName)
        leases_asked_ = std::max(0, leases_asked_ - 1);
      if (work_)
        work_->take(link_.socket(), *message, takes_leases && tiles_, now);
      else
        link_.socket().reject(*message, "nothing is sampled yet");
    }
  }

  void sample_next() {
    if (!net::stop_requested()) ask_for_leases();  // the answer comes while we sample
    Delivery made = work_->sample_next();
    ++tiles_sampled_;
    spans_.add("sample", link_.to_master_s(made.begin_s), link_.to_master_s(made.sampled_s));
    spans_.add("encode", link_.to_master_s(made.sampled_s), link_.to_master_s(made.encoded_s));
    unsent_ = std::move(made);
    send_out(monotonic_s());
  }

  // A packer that is slow or being restarted: what was sampled is held for a while, then its lease may expire.
  void send_out(double now_s) {
    if (!unsent_) return;
    if ((tiles_ && tiles_->send_frames({}, unsent_->type, unsent_->body)) || now_s > unsent_->encoded_s + kSendFor_s)
      unsent_.reset();
  }

  const SamplerServiceOptions& options_;
  net::Context& context_;
  std::unique_ptr<Sampler> mesh_sampler_;
  const bool replays_;
  metrics::SpanRecorder spans_;
  net::MasterLink link_;
  std::unique_ptr<SamplingWork> work_;  // none before the session's kind is known
  std::optional<net::Socket> tiles_;
  std::string tiles_endpoint_, kind_;
  InstanceId master_;
  std::optional<Delivery> unsent_;
  int leases_asked_ = 0;
  bool failed_ = false;
  uint64_t tiles_sampled_ = 0;
  double last_flush_s_ = 0;
};

}  // namespace

void add_flags(CLI::App& app, SamplerServiceOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kConnects);
  app.add_option("--sampler", o.kind, "of meshes: ray (Embree), raster (OpenGL), or auto: raster on a GPU, else ray")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "ray", "raster"}));
  app.add_option("--threads", o.threads, "threads to sample with; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--chunk-cache-mb", o.chunk_cache_mb, "memory for chunks, MB")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e6));
  app.add_option("--replay", o.replay, "sample nothing: deliver this file's rows, after as long as they took");
  app.add_option("--repeat-views", o.repeat_views,
                 "a view of a volume that was sampled so often is not sampled again, but sent again after as long as "
                 "it took the thread (with "
                 "--threads 1): for studies with more samplers than processors; 0: never")
      ->capture_default_str()
      ->check(CLI::Range(0, 1000));
  app.add_option("--cost-scale", o.cost_scale, "with --replay: rows take so many times as long")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
}

int run(const SamplerServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  std::unique_ptr<Sampler> sampler;
  std::unique_ptr<LeaseWork> replay;
  if (!o.replay.empty()) {
    auto file = read_replay(o.replay);
    if (!file) {
      log::error("{}", file.error().text);
      return 2;
    }
    replay = std::make_unique<ReplayWork>(std::move(*file), o.cost_scale);
  } else if (o.kind != "auto") {  // one that cannot be made should not wait for a session to say so
    auto made = make_sampler(o.kind, o.threads);
    if (!made) {
      log::error("{}", made.error().text);
      return 1;
    }
    sampler = std::move(*made);
  }
  const InstanceId instance = net::make_instance_id();
  const DrainGuard guard(o.service.master, instance);
  net::Context context;
  return SamplerService(o, instance, std::move(sampler), std::move(replay), context).serve();
}

}  // namespace telesplat::sampler
