#include "services/master/master_service.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/core/clock.h"
#include "common/net/dispatch.h"

namespace telesplat::master {
namespace {

// How long others may take to say goodbye; less where someone waits for the master itself to end.
constexpr double kFarewell_s = 3.0, kShortFarewell_s = 1.0;

std::map<std::string, Progressive> progressive_names() {
  std::map<std::string, Progressive> out;
  for (const auto p : {Progressive::kAuto, Progressive::kOn, Progressive::kOff}) out[name_of(p)] = p;
  return out;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) (c == '"' || c == '\\' ? out += '\\' : out) += (static_cast<unsigned char>(c) < 32 ? ' ' : c);
  return out + '"';
}

// The effective configuration of everyone who took part.
void write_session(const std::string& directory, const MasterServiceOptions& o, const MasterCore& core,
                   const std::vector<metrics::Process>& processes) {
  std::ofstream out(directory + "/session.toml");
  out << "# The effective configuration of this run.\n[session]\ntile_size = " << o.master.schedule.tile_size
      << "\nframes_in_flight = " << o.master.schedule.frames_in_flight
      << "\nlease_timeout_s = " << o.master.schedule.lease_timeout_s
      << "\nlease_target_s = " << o.master.schedule.lease_target_s << "\noctree_depth = " << core.octree_depth()
      << "\nprogressive = " << quoted(core.progressive() ? "on" : "off") << "\nanimation = " << quoted(core.animation())
      << "\n\n[settings]\n";
  for (const auto& [key, value] : core.settings()) out << '"' << key << "\" = " << fmt::format("{}", value) << "\n";
  for (const auto& p : processes) {
    out << "\n[[process]]\nrole = \"" << p.role << "\"\nname = \"" << p.name << "\"\n";
    for (const auto& [key, value] : p.facts) out << quoted(key) << " = " << quoted(value) << "\n";
  }
}

}  // namespace

void add_flags(CLI::App& app, MasterServiceOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kBinds);
  app.add_option("--out", o.out, "folder for the run's record");
  app.add_option(
      "--animate", o.animate,
      "change a Julia set's parameters with time: c.y=-0.4:0.4:10s, or c.y=@0s:-0.4@5s:0.4@10s:-0.4; several "
      "are separated by \";\"");
  add_session_flags(app, o);
}

void add_session_flags(CLI::App& app, MasterServiceOptions& o) {
  app.add_option("--tile-size", o.master.schedule.tile_size, "pixels a side of a tile")
      ->capture_default_str()
      ->check(CLI::Range(16, 4096));
  app.add_option("--frames-in-flight", o.master.schedule.frames_in_flight, "sampling frames begun and not complete")
      ->capture_default_str()
      ->check(CLI::Range(1, 16));
  app.add_option("--lease-timeout", o.master.schedule.lease_timeout_s, "seconds before a lease goes to another sampler")
      ->capture_default_str()
      ->check(CLI::Range(0.05, 3600.0));
  app.add_option("--lease-target", o.master.schedule.lease_target_s,
                 "seconds that a lease of a Julia set's rows should take")
      ->capture_default_str()
      ->check(CLI::Range(1e-4, 10.0));
  app.add_option("--progressive", o.master.progressive,
                 "on: a view arrives with every 4th pixel of every 4th row first; auto: of Julia sets")
      ->default_str("auto")
      ->transform(CLI::CheckedTransformer(progressive_names()));
  app.add_option("--octree-depth", o.master.octree_depth,
                 "levels of the point model's octree; 0: 5")
      ->capture_default_str()
      ->check(CLI::Range(0, 10));
  double& layers = o.master.settings["volume.layers"];
  layers = 16;
  app.add_option("--layers,--volume.layers", layers,
                 "slice images that a frame of a volume has at most; more: better when the head moves")
      ->capture_default_str()
      ->check(CLI::Range(1.0, double(volume::kMaxLayers)));
  for (const auto& [name, text, value] :
       {std::tuple{"packing.max_points", "points the model holds at most", 20e6},
        {"packing.obsolete_after_s", "forget clusters not seen for so long; 0: never", 0.0},
        {"packing.epsilon", "redundancy threshold, relative to depth", 0.004},
        {"packing.age_weight", "patches that are kept: how fast one not drawn comes to be forgotten, per second", 1.0},
        {"packing.rate_weight", "patches that are kept: how much coarser ones come before finer ones, per halving",
         4.0},
        {"packing.patches_per_cluster", "patches that are kept of a cluster at most; 0: no limit", 6.0}}) {
    o.master.settings[name] = value;
    app.add_option(std::string("--") + name, o.master.settings[name], text)
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1e12));
  }
  double& keep = o.master.settings["packing.keep_redundant"];
  keep = -1;
  app.add_option("--packing.redundancy,--packing.keep_redundant", keep,
                 "eliminate: pack what the model does not show yet; keep: everything, viewers draw the best patches; "
                 "auto: keep of Julia sets")
      ->default_str("auto")
      ->check(CLI::Range(-1.0, 1.0, "auto, eliminate or keep"))
      ->transform(CLI::Transformer(std::map<std::string, double>{{"auto", -1.0}, {"eliminate", 0.0}, {"keep", 1.0}}));
}

int run(const MasterServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  MasterOptions options = o.master;
  if (!o.animate.empty()) {
    auto timeline = julia::parse_timeline(o.animate);
    if (!timeline) {
      log::error("--animate: {}", timeline.error().text);
      return 2;
    }
    options.animation = *std::move(timeline);
  }
  auto record = metrics::RunRecord::open(o.out);
  if (!record) {
    log::error("{}", record.error().text);
    return 2;
  }
  net::Context context;
  net::Socket control(context, net::Kind::kRouter, "master",
                      {.high_water_mark = 10000, .max_message_bytes = 16u << 20});
  const auto endpoint = control.bind(o.service.bind, o.service.insecure);
  if (!endpoint) {
    log::error("{}", endpoint.error().text);
    return 2;
  }
  log::info("listening on {}", endpoint->c_str());
  std::printf("listening on %s\n", endpoint->c_str());
  std::fflush(stdout);

  MasterCore core(options, net::make_instance_id(), **record);
  const auto serve_for = [&](int timeout_ms) {
    net::wait_readable({&control}, timeout_ms);
    for (int n = 0; n < 1000; ++n) {
      const auto message = control.receive();
      if (!message) break;
      const double now = monotonic_s();
      net::dispatch<wire::Hello, wire::StatusReport, wire::ViewRequest, wire::LeaseRequest, wire::LeaseExtend,
                    wire::TileDone, wire::MetricRows, wire::SliceWeights, wire::SlabReady, wire::Goodbye,
                    wire::Control>(control, *message, [&](const auto& m) {
        using M = std::decay_t<decltype(m)>;
        if constexpr (std::is_same_v<M, wire::MetricRows> || std::is_same_v<M, wire::SliceWeights>) {
          if (const Status s = core.on(message->peer, m, now); !s) control.reject(*message, s.error().text);
        } else {
          core.on(message->peer, m, now);
        }
      });
    }
    core.tick(monotonic_s());
    for (auto& out : core.take_outgoing())
      if (!control.send_frames(out.peer, out.type, std::move(out.body))) core.undeliverable(out.peer);
  };

  while (!net::stop_requested() && !core.stop_requested()) serve_for(core.hurried() ? 5 : 20);
  core.shut_down(net::stop_requested() ? "the master was told to stop" : "stop was commanded");
  const auto patience_s = [] { return net::stop_requested() ? kShortFarewell_s : kFarewell_s; };
  for (const double begin = monotonic_s(); !core.everyone_left() && monotonic_s() - begin < patience_s();)
    serve_for(10);

  auto processes = core.processes();
  processes.push_back({"master",
                       o.service.name,
                       uint64_t(getpid()),
                       {},
                       {{"peak_rss_mb", net::peak_resident_mb()}, {"messages_rejected", double(control.rejected())}}});
  if (!o.out.empty()) write_session(o.out, o, core, processes);
  if (const Status s = (*record)->finish(processes, core.counters()); !s) {
    log::error("{}", s.error().text);
    return 1;
  }
  return 0;
}

}  // namespace telesplat::master
