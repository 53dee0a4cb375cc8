#include "services/master/master_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/version.h"
#include "common/metrics/run_folder.h"
#include "common/net/dispatch.h"
#include "common/net/local_endpoint.h"
#include "common/net/service.h"
#include "common/net/session_file.h"
#include "services/master/gate/gate.h"
#include "services/master/guarded.h"
#include "services/master/live/http_endpoint.h"
#include "services/master/master_core.h"
#include "services/master/master_record.h"

namespace telesplat::master {
namespace {

// Time for others to say goodbye; shorter after a signal, when someone waits for the master to end.
constexpr double kFarewell_s = 3.0, kShortFarewell_s = 1.0;
constexpr int kMessagesAtOnce = 1000;   // messages handled between two ticks, at most
constexpr size_t kMostOutgoing = 2000;  // messages that wait to be sent before more are read
constexpr double kMetricsPeriod_s = 1;
constexpr double kStandstill_s = 1;  // the loop runs every 20 ms; after a longer gap others only seem silent

Result<MasterOptions> core_options(const MasterServiceOptions& o) {
  MasterOptions out = o.master;
  if (o.animate.empty()) return out;
  auto timeline = julia::parse_timeline(o.animate);
  if (!timeline) return Error{"--animate: " + timeline.error().text};
  out.animation = *std::move(timeline);
  return out;
}

net::RunningSession introduction(const MasterServiceOptions& o, const std::string& endpoint) {
  return {.address = net::local_address(endpoint),
          .pid = process_id(),
          .scene = {},
          .kind = {},
          .run_folder = net::absolute_path(o.out),
          .started_at_s = std::floor(wall_clock_s()),
          .started_by = o.started_by,
          .keys = net::absolute_path(o.service.keys)};
}

// Returns the flags that ctl needs if it finds no file of the session.
std::string flags_of_ctl(const net::ServiceOptions& o, const std::string& endpoint) {
  return " --master " + net::local_address(endpoint) + (o.keys.empty() ? "" : " --keys " + o.keys);
}

/// The control socket, and the core that answers what comes over it.
class MasterTurns final : public MasterService {
 public:
  MasterTurns(net::Context& context, const MasterServiceOptions& o, const MasterOptions& core,
              std::unique_ptr<metrics::RunRecord> record, std::string run_id)
      : options_(o),
        context_(context),
        record_(std::move(record)),
        run_id_(std::move(run_id)),
        core_(core, net::make_instance_id(), *record_) {}

  /// Serves figures to programs that watch, if --metrics-port was given.
  Status open_metrics() {
    if (options_.metrics_port == 0) return ok_status();
    auto opened = HttpEndpoint::open(
        {.address = options_.metrics_address, .port = options_.metrics_port, .insecure = options_.service.insecure});
    if (!opened) return opened.error();
    metrics_ = *std::move(opened);
    publish_metrics(monotonic_s());
    log::info("metrics at {}", metrics_->url());
    return ok_status();
  }

  Status listen() {
    auto endpoint = control_.bind(options_.service.bind, options_.service.insecure);
    if (!endpoint) return endpoint.error();
    endpoint_ = *std::move(endpoint);
    core_.introduce(introduction(options_, endpoint_), run_id_);
    return ok_status();
  }

  // Publishes the session's file, so that ctl finds it, and prints that it listens: the launcher waits for that line.
  void announce() {
    if (auto file = net::SessionFile::publish(core_.session()))
      file_.emplace(std::move(*file));
    else
      log::warn("telesplat ctl will not find this session: {}", file.error().text);
    told_ = core_.session();
    std::printf("listening on %s\n", endpoint_.c_str());
    if (options_.started_by == "hand")
      std::printf("telesplat ctl status%s asks this session; others join it with --master %s\n",
                  file_ ? "" : flags_of_ctl(options_.service, endpoint_).c_str(),
                  net::announced(endpoint_, {}).c_str());
    else
      log::info("listening on {}", endpoint_);  // only the launcher reads stdout
    if (!options_.service.keys.empty())
      log::info("keys of {}: others need theirs", options_.service.keys);
    else
      log::warn("without keys: everybody {} can watch and end this session (--keys DIR lets in whom you want)",
                net::is_local(endpoint_) ? "on this machine" : "who reaches this machine");
    std::fflush(stdout);
  }

  std::optional<net::Wait> turn() override {
    if (!leaves_since_s_ && (net::stop_requested() || core_.stop_requested())) {
      file_.reset();  // ctl must not find a session that ends
      core_.shut_down(net::stop_requested() ? "the session's master was told to stop" : core_.stop_reason());
      leaves_since_s_ = monotonic_s();
    }
    serve();
    double wait_s = leaves_since_s_ ? 0.01 : core_.hurried() ? 0.005 : 0.02;
    const double now_s = monotonic_s();
    if (leaves_since_s_ && (core_.everyone_left() || now_s - *leaves_since_s_ > patience_s())) return std::nullopt;
    if (const auto due_s = core_.due_s()) wait_s = std::clamp(*due_s - now_s, 0.0, wait_s);
    return net::Wait{{&control_}, wait_s};
  }

  const MasterCore& core() const override { return core_; }

  Status write_record() override {
    auto processes = core_.processes();
    processes.push_back({"master",
                         options_.service.name,
                         process_id(),
                         net::process_facts(),
                         {{"peak_rss_mb", net::peak_resident_mb()},
                          {"messages_rejected", double(control_.rejected())},
                          {"keys_refused", double(control_.keys_refused())},
                          {"connections_refused", double(control_.connections_refused())},
                          {"queue_refused", double(control_.queue_refused())}}});
    const metrics::About about{.id = run_id_,
                               .version = version(),
                               .begin = record_->begin(),
                               .end_unix_ns = metrics::begin_now().unix_ns,
                               .settings = wire::numbers_of(core_.settings()),
                               .label = options_.label};
    // Before finish(), which lists the record's files.
    if (const Status s = record_->write_file("session.toml", session_text(options_, core_, about, processes)); !s)
      log::error("{}", s.error().text);
    const Status finished = record_->finish(processes, core_.counters(), about);
    if (finished && options_.overwrite) metrics::forget_replaced(options_.out);
    return finished;
  }

 private:
  static double patience_s() { return net::stop_requested() ? kShortFarewell_s : kFarewell_s; }

  void serve() {
    look_at_the_clock();
    for (int n = 0; n < kMessagesAtOnce && core_.outgoing() < kMostOutgoing; ++n) {
      const auto message = control_.receive();
      if (!message) break;
      guarded(control_, *message, [&] { take(*message, look_at_the_clock()); });
    }
    core_.tick(look_at_the_clock());
    core_.tell_door({.messages_rejected = control_.rejected(),
                     .keys_refused = control_.keys_refused(),
                     .connections_refused = control_.connections_refused(),
                     .queue_refused = control_.queue_refused(),
                     .max_connections = options_.service.max_connections,
                     .queue_limit_mb = options_.service.queue_limit_mb});
    tell_news();
    publish_metrics(monotonic_s());
    for (auto& out : core_.take_outgoing())
      if (!control_.send_frames(out.peer, out.type, std::move(out.body))) core_.undeliverable(out.peer);
  }

  // Returns the time. Reports it to the core first if this process was stopped: others then only seem silent or late.
  double look_at_the_clock() {
    const double now_s = monotonic_s(), passed_s = now_s - std::exchange(looked_s_, now_s);
    if (passed_s > kStandstill_s) {
      log::warn("the master stood still for {:.1f} s", passed_s);
      core_.stood_still(passed_s, now_s);
    }
    return now_s;
  }

  void publish_metrics(double now_s) {
    if (!metrics_ || now_s - published_s_ < kMetricsPeriod_s) return;
    published_s_ = now_s;
    LiveSnapshot snapshot = core_.live_snapshot();
    snapshot.version = version();
    snapshot.processes.push_back({.role = "master",
                                  .name = options_.service.name,
                                  .alive = true,
                                  .leases = {},
                                  .values = {{"rss_mb", net::resident_mb()},
                                             {"peak_rss_mb", net::peak_resident_mb()},
                                             {"messages_rejected", double(control_.rejected())},
                                             {"keys_refused", double(control_.keys_refused())}},
                                  .rates = {}});
    metrics_->publish(exposition(snapshot, core_.live()));
  }

  // Updates the session's file as soon as its scene is known.
  void tell_news() {
    if (!file_ || core_.session() == told_) return;
    told_ = core_.session();
    if (const Status s = file_->update(told_); !s) log::warn("{}", s.error().text);
  }

  void take(const net::Message& message, double now_s) {
    // Answer at once: the time between question and answer adds to the clock's error.
    if (message.type == wire::ClockRequest::kName) {
      if (const auto asked = control_.decode<wire::ClockRequest>(message))
        control_.send(wire::ClockReply{core_.instance(), asked->sent_s, message.arrived_s, monotonic_s(), clock_id()},
                      message.peer);
      return;
    }
    if (!core_.admit(message.peer, now_s)) return control_.reject(message, "its peer sends more than --max-messages");
    const std::string* payer = core_.serves(message.peer) ? nullptr : net::payer(message);
    if (payer && !core_.admit_work(*payer, now_s))
      return control_.reject(message, "its sender takes more than its share of the master's time");
    const double begin_s = thread_cpu_s();
    handle(message, now_s);
    if (payer) core_.worked(*payer, thread_cpu_s() - begin_s, now_s);
  }

  void handle(const net::Message& message, double now_s) {
    if (message.type == wire::Hello::kName || message.type == wire::Control::kName)
      if (const auto version = wire::other_version(message.body)) return turn_away(message, *version);
    net::dispatch<wire::Hello, wire::StatusReport, wire::ViewRequest, wire::LeaseRequest, wire::LeaseExtend,
                  wire::TileDone, wire::TileRefused, wire::Plan, wire::MetricRows, wire::SliceWeights, wire::SlabReady,
                  wire::LinkReport, wire::SwapReady, wire::OrderAnswer, wire::Goodbye, wire::Control>(
        control_, message, [&](const auto& m) {
          if (const Status s = senders_.admit(message, m); !s) return refuse(message, m, s.error());
          if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::Control>)
            core_.on(message.peer, m, now_s, message.user);
          else if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::ViewRequest>)
            core_.on(message.peer, m, now_s, message.role == net::Role::kViewer ? message.user : std::string());
          else if constexpr (std::is_void_v<decltype(core_.on(message.peer, m, now_s))>)
            core_.on(message.peer, m, now_s);
          else if (const Status s = core_.on(message.peer, m, now_s); !s)
            control_.reject(message, s.error().text);
        });
  }

  // Answers a hello or a command of another version, encoded as in that version.
  void turn_away(const net::Message& message, uint64_t version) {
    const std::string why = wire::about_versions(version);
    control_.reject(message, why);
    if (message.type == wire::Hello::kName)
      control_.send_frames(message.peer, wire::Shutdown::kName, wire::encode_for(version, wire::Shutdown{why}));
    else
      control_.send_frames(message.peer, wire::ControlReply::kName,
                           wire::encode_for(version, wire::ControlReply{false, why}));
  }

  // The sender of a command or a hello waits for an answer.
  void refuse(const net::Message& message, const auto& m, const Error& why) {
    control_.reject(message, why.text);
    if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::Control>)
      control_.send(wire::ControlReply{false, why.text}, message.peer);
    if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::Hello>)
      control_.send(wire::Shutdown{why.text}, message.peer);
  }

  const MasterServiceOptions& options_;
  net::Context& context_;
  net::Socket control_{context_,
                       net::Kind::kRouter,
                       "master",
                       {.high_water_mark = 10000,
                        .max_message_bytes = 16u << 20,
                        .serves = "control",
                        .most_connections = options_.service.max_connections,
                        .most_queued_bytes = options_.service.queue_limit_bytes()}};
  Senders senders_;
  std::unique_ptr<metrics::RunRecord> record_;
  std::string endpoint_;
  const std::string run_id_;  // empty: no record is written
  MasterCore core_;
  net::RunningSession told_;  // content of the session's file
  std::optional<net::SessionFile> file_;
  std::optional<double> leaves_since_s_;   // time at which all got Shutdown; nullopt: not yet
  double looked_s_ = monotonic_s();        // last time of look_at_the_clock()
  std::unique_ptr<HttpEndpoint> metrics_;  // null: without --metrics-port
  double published_s_ = -1e9;
};

Result<std::unique_ptr<MasterTurns>> open_master(net::Context& context, const MasterServiceOptions& o) {
  const auto options = core_options(o);
  if (!options) return options.error();
  if (o.overwrite && o.goes_on) return Error{"--continue and --overwrite: the record goes on, or is replaced"};
  std::string run_id;
  std::error_code error;
  const bool was_there = std::filesystem::exists(o.out, error);
  const bool goes_on = o.goes_on && metrics::may_go_on(o.out);
  if (!o.out.empty()) {
    if (const Status s = net::refuse_folder_in_use(o.out); !s) return s.error();
    auto begun =
        goes_on ? metrics::go_on_in_folder(o.out) : metrics::begin_folder(o.out, o.overwrite, metrics::Logs::kOthers);
    if (!begun) return begun.error();
    run_id = *std::move(begun);
  }
  const auto bytes = [](double mb) { return uint64_t(mb * 1e6); };
  auto record = metrics::RunRecord::open(
      o.out, metrics::begin_now(),
      {.table_bytes = bytes(o.table_limit_mb), .trace_bytes = bytes(o.trace_limit_mb), .goes_on = goes_on});
  if (!record) return record.error();
  if (goes_on) log::info("{}: its record goes on; this is master {} of it", o.out, (*record)->lives());
  auto service = std::make_unique<MasterTurns>(context, o, *options, *std::move(record), std::move(run_id));
  Status opened = service->open_metrics();
  if (opened) opened = service->listen();
  if (!opened && !o.out.empty() && !goes_on) metrics::remove_record(o.out, !was_there);
  if (!opened) return opened.error();
  return {std::move(service)};
}

}  // namespace

Result<std::unique_ptr<MasterService>> MasterService::open(net::Context& context, const MasterServiceOptions& o) {
  auto out = open_master(context, o);
  if (!out) return out.error();
  return {std::unique_ptr<MasterService>(*std::move(out))};
}

Result<int> run(const MasterServiceOptions& o) {
  const auto access = net::begin_service(o.service, {}, true);
  if (!access) return access.error();
  net::Context context(*access);
  const auto service = open_master(context, o);
  if (!service) return service.error();
  (*service)->announce();
  net::take_turns(**service);
  if (const Status s = (*service)->write_record(); !s) {
    if (o.started_by != "hand") std::printf("record failed %s\n", s.error().text.c_str());  // the launcher reads it
    log::error("{}", s.error().text);
    return 1;
  }
  return 0;
}

}  // namespace telesplat::master
