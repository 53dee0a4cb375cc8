#include "services/master/master_service.h"

#include <unistd.h>

#include <fmt/format.h>

#include <cstdio>
#include <fstream>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/dispatch.h"
#include "services/master/guarded.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

// How long others may take to say goodbye; less where someone waits for the master itself to end.
constexpr double kFarewell_s = 3.0, kShortFarewell_s = 1.0;
constexpr int kMessagesAtOnce = 1000;  // between two ticks

// The effective configuration of everyone who took part.
void write_session(const std::string& directory, const MasterServiceOptions& o, const MasterCore& core,
                   const std::vector<metrics::Process>& processes) {
  using options::quoted;
  std::ofstream out(directory + "/session.toml");
  out << "# The effective configuration of this run.\n[session]\ntile_size = " << o.master.schedule.tile_size
      << "\nframes_in_flight = " << o.master.schedule.frames_in_flight
      << "\nlease_timeout_s = " << o.master.schedule.lease_timeout_s
      << "\nlease_target_s = " << o.master.schedule.lease_target_s << "\noctree_depth = " << core.octree_depth()
      << "\nprogressive = " << quoted(core.progressive() ? "on" : "off") << "\nanimation = " << quoted(core.animation())
      << "\n\n[settings]\n";
  for (const auto& [key, value] : core.settings()) out << quoted(key) << " = " << fmt::format("{}", value) << "\n";
  for (const auto& p : processes) {
    out << "\n[[process]]\nrole = " << quoted(p.role) << "\nname = " << quoted(p.name) << "\n";
    for (const auto& [key, value] : p.facts) out << quoted(key) << " = " << quoted(value) << "\n";
  }
}

Result<MasterOptions> core_options(const MasterServiceOptions& o) {
  MasterOptions out = o.master;
  if (o.animate.empty()) return out;
  auto timeline = julia::parse_timeline(o.animate);
  if (!timeline) return Error{"--animate: " + timeline.error().text};
  out.animation = *std::move(timeline);
  return out;
}

/// The control socket, and the core that answers what comes over it.
class MasterService {
 public:
  MasterService(const MasterServiceOptions& o, const MasterOptions& core, std::unique_ptr<metrics::RunRecord> record)
      : options_(o), record_(std::move(record)), core_(core, net::make_instance_id(), *record_) {}

  /// Binds, and says so on stdout: whoever started this process waits for the line.
  Status listen() {
    const auto endpoint = control_.bind(options_.service.bind, options_.service.insecure);
    if (!endpoint) return endpoint.error();
    log::info("listening on {}", endpoint->c_str());
    std::printf("listening on %s\n", endpoint->c_str());
    std::fflush(stdout);
    return ok_status();
  }

  void serve() {
    while (!net::stop_requested() && !core_.stop_requested()) serve_for(core_.hurried() ? 5 : 20);
  }

  /// Tells everyone to finish, and listens to their last words.
  void say_goodbye() {
    core_.shut_down(net::stop_requested() ? "the master was told to stop" : "stop was commanded");
    const auto patience_s = [] { return net::stop_requested() ? kShortFarewell_s : kFarewell_s; };
    for (const double begin = monotonic_s(); !core_.everyone_left() && monotonic_s() - begin < patience_s();)
      serve_for(10);
  }

  Status write_record() {
    auto processes = core_.processes();
    processes.push_back(
        {"master",
         options_.service.name,
         uint64_t(getpid()),
         {},
         {{"peak_rss_mb", net::peak_resident_mb()}, {"messages_rejected", double(control_.rejected())}}});
    if (!options_.out.empty()) write_session(options_.out, options_, core_, processes);
    return record_->finish(processes, core_.counters());
  }

 private:
  void serve_for(int timeout_ms) {
    net::wait_readable({&control_}, timeout_ms);
    for (int n = 0; n < kMessagesAtOnce; ++n) {
      const auto message = control_.receive();
      if (!message) break;
      guarded(control_, *message, [&] { take(*message, monotonic_s()); });
    }
    core_.tick(monotonic_s());
    for (auto& out : core_.take_outgoing())
      if (!control_.send_frames(out.peer, out.type, std::move(out.body))) core_.undeliverable(out.peer);
  }

  void take(const net::Message& message, double now_s) {
    net::dispatch<wire::Hello, wire::StatusReport, wire::ViewRequest, wire::LeaseRequest, wire::LeaseExtend,
                  wire::TileDone, wire::MetricRows, wire::SliceWeights, wire::SlabReady, wire::Goodbye, wire::Control>(
        control_, message, [&](const auto& m) {
          if constexpr (std::is_void_v<decltype(core_.on(message.peer, m, now_s))>)
            core_.on(message.peer, m, now_s);
          else if (const Status s = core_.on(message.peer, m, now_s); !s)
            control_.reject(message, s.error().text);
        });
  }

  const MasterServiceOptions& options_;
  net::Context context_;
  net::Socket control_{
      context_, net::Kind::kRouter, "master", {.high_water_mark = 10000, .max_message_bytes = 16u << 20}};
  std::unique_ptr<metrics::RunRecord> record_;
  MasterCore core_;
};

}  // namespace

int run(const MasterServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  const auto fail = [](int code, const Error& e) {
    log::error("{}", e.text);
    return code;
  };
  const auto options = core_options(o);
  if (!options) return fail(2, options.error());
  auto record = metrics::RunRecord::open(o.out);
  if (!record) return fail(2, record.error());
  MasterService service(o, *options, *std::move(record));
  if (const Status s = service.listen(); !s) return fail(2, s.error());
  service.serve();
  service.say_goodbye();
  if (const Status s = service.write_record(); !s) return fail(1, s.error());
  return 0;
}

}  // namespace telesplat::master
