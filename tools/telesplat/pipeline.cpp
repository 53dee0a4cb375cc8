#include "tools/telesplat/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/core/clock.h"
#include "tools/telesplat/control_client.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxRestarts = 5;
constexpr double kMasterPatience_s = 10, kFarewell_s = 4;

std::string text(double v) { return fmt::format("{}", v); }

std::string progressive(master::Progressive p) {
  return p == master::Progressive::kOn ? "on" : p == master::Progressive::kOff ? "off" : "auto";
}

std::vector<std::string> master_arguments(const RunOptions& o) {
  const auto& s = o.master.master.schedule;
  std::vector<std::string> a{"--name",
                             "master",
                             "--bind",
                             "tcp://127.0.0.1:*",
                             "--tile-size",
                             text(s.tile_size),
                             "--frames-in-flight",
                             text(s.frames_in_flight),
                             "--lease-timeout",
                             text(s.lease_timeout_s),
                             "--lease-target",
                             text(s.lease_target_s),
                             "--progressive",
                             progressive(o.master.master.progressive),
                             "--octree-depth",
                             text(double(o.master.master.octree_depth)),
                             "--log-level",
                             o.master.service.log_level};
  if (!o.out.empty()) a.insert(a.end(), {"--out", o.out});
  for (const auto& [key, value] : o.master.master.settings) {
    if (key == "packing.keep_redundant")
      a.insert(a.end(), {"--packing.redundancy", value < 0 ? "auto" : value != 0 ? "keep" : "eliminate"});
    else
      a.insert(a.end(), {"--" + key, text(value)});
  }
  return a;
}

std::vector<std::string> data_arguments(const RunOptions& o) {
  std::vector<std::string> a{o.scene, "--room-size", text(o.mesh.room_size_m), "--up=" + o.mesh.up,
                             "--report-progress"};
  if (o.shows_julia()) {
    const auto flags = julia::to_flags(o.julia);
    a.insert(a.end(), flags.begin(), flags.end());
  }
  if (!o.mesh.cache_dir.empty()) a.insert(a.end(), {"--cache", o.mesh.cache_dir});
  if (!o.mesh.use_cache) a.push_back("--no-cache");
  return a;
}

std::vector<std::string> packer_arguments(const RunOptions& o) {
  if (!o.record_depth) return {};
  return {"--record-depth", o.out + "/depth"};
}

std::vector<std::string> viewer_arguments(const RunOptions& o) {
  const auto& v = o.viewer;
  const auto& d = v.display;
  std::vector<std::string> a{"--size",
                             v.size,
                             "--sampling-size",
                             v.sampling_size,
                             "--least-sampling",
                             text(v.requests.min_scale),
                             "--trajectory",
                             v.trajectory,
                             "--duration",
                             text(d.duration_s),
                             "--frames",
                             text(double(d.frames)),
                             "--hold",
                             text(d.hold_s),
                             "--fov",
                             text(d.fov_deg),
                             "--near",
                             text(d.near_m),
                             "--target-fps",
                             text(d.target_fps),
                             "--detail-budget",
                             d.detail_budget ? "on" : "off",
                             "--least-detail",
                             text(d.least_detail),
                             "--target-latency",
                             text(v.requests.target_latency_s),
                             "--speed-detail",
                             d.speed_detail ? "on" : "off",
                             "--renderer",
                             v.renderer,
                             "--splat",
                             v.splat,
                             "--splat-scale",
                             text(v.splat_scale),
                             "--finish",
                             v.finish,
                             "--shading",
                             v.shading,
                             "--coupling",
                             v.coupling,
                             "--update-rate",
                             text(v.requests.max_rate_hz),
                             "--epoch-patience",
                             text(v.epoch_patience_s),
                             "--record-every",
                             text(double(d.picture_every)),
                             "--verify",
                             text(double(d.verify_every)),
                             "--record-points",
                             text(double(v.record_points_mb)),
                             "--started-at",
                             text(o.started_s)};
  if (!o.out.empty()) a.insert(a.end(), {"--out", o.out});
  for (const auto& [set, flag] : {std::pair{d.exr, "--exr"}, {v.window, "--window"}, {v.fullscreen, "--fullscreen"}})
    if (set) a.push_back(flag);
  return a;
}

}  // namespace

std::string program_directory() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path().string();
}

Result<Pipeline> Pipeline::start(const RunOptions& o) {
  Pipeline p;
  p.log_directory_ = o.log_directory.empty() ? o.out + "/logs" : o.log_directory;
  std::error_code error;
  fs::create_directories(p.log_directory_, error);
  if (error) return Error{fmt::format("{}: cannot be made a folder for logs: {}", p.log_directory_, error.message())};
  const int background = o.background_servers ? 10 : 0;
  const auto common = [&](std::vector<std::string> a, const std::string& name) {
    a.insert(a.end(), {"--master", p.master_endpoint_, "--name", name, "--log-level", o.master.service.log_level});
    return a;
  };

  p.master_endpoint_ = o.join_master;
  if (o.join_master.empty()) {
    p.members_.push_back({"master", "telesplat-master", master_arguments(o), 0});
    if (const Status s = p.launch(p.members_.back()); !s) return s.error();
    auto& master = *p.members_.back().process;
    for (const double until = monotonic_s() + kMasterPatience_s; p.master_endpoint_.empty();) {
      for (const auto& line : master.read_lines())
        if (line.starts_with("listening on ")) p.master_endpoint_ = line.substr(13);
      if (master.ended() || monotonic_s() > until)
        return Error{"the master did not start: " + p.last_log_line("master")};
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    p.members_.push_back({"data", "telesplat-data", common(data_arguments(o), "data"), background});
    p.members_.push_back({"packer", "telesplat-packer", common(packer_arguments(o), "packer"), background / 2});
    const int cores = int(std::max(1u, std::thread::hardware_concurrency()));
    const int threads = o.sampler_threads ? o.sampler_threads : std::max(1, cores / o.samplers);
    for (int i = 1; i <= o.samplers; ++i)
      p.members_.push_back(
          {"sampler", "telesplat-sampler",
           common({"--sampler", o.sampler_kind, "--threads", std::to_string(threads)}, fmt::format("sampler-{}", i)),
           background});
  }
  p.members_.push_back({"viewer", "telesplat-viewer", common(viewer_arguments(o), "viewer-1"), 0});
  for (auto& m : p.members_)
    if (!m.process)
      if (const Status s = p.launch(m); !s) return s.error();
  return p;
}

Status Pipeline::launch(Member& m) {
  const auto named = std::find(m.arguments.begin(), m.arguments.end(), "--name");
  const std::string name = *(named + 1);
  auto child = ChildProcess::start(name, program_directory() + "/" + m.program, m.arguments,
                                   fmt::format("{}/{}.log", log_directory_, name), m.nice);
  if (!child) return child.error();
  m.process.reset();
  m.process.emplace(std::move(*child));
  return ok_status();
}

std::string Pipeline::last_log_line(const std::string& name) const {
  std::ifstream in(fmt::format("{}/{}.log", log_directory_, name));
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return last.starts_with("telesplat: ") ? last.substr(11) : last;
}

Pipeline::State Pipeline::supervise(std::vector<std::string>& news) {
  for (auto& m : members_) {
    read(m);
    if (!m.process->ended()) continue;
    read(m);  // its last words
    const std::string name = m.process->name();
    const int code = m.process->exit_code();
    if (m.role == "viewer") {
      if (code == 0) return State::kFinished;
      news.push_back(fmt::format("{} ended with code {}: {}", name, code, last_log_line(name)));
      return code == 2 ? State::kBadInput : State::kFailed;
    }
    if (code == 0) {  // told to finish, by `telesplat ctl stop`; the viewer finishes too
      if (m.role == "master") return State::kFinished;
      continue;
    }
    if (code == 2 || m.role == "master" || m.restarts >= kMaxRestarts) {
      news.push_back(code == 2 ? last_log_line(name)
                               : fmt::format("{} ended with code {}: {}", name, code, last_log_line(name)));
      return code == 2 ? State::kBadInput : State::kFailed;
    }
    ++m.restarts;
    ++restarts_;
    news.push_back(fmt::format("{} died ({} {}); the run goes on, it is started again", name,
                               code > 128 ? "signal" : "code", code > 128 ? code - 128 : code));
    if (const Status s = launch(m); !s) {
      news.push_back(s.error().text);
      return State::kFailed;
    }
  }
  return State::kRunning;
}

void Pipeline::read(Member& m) {
  for (const auto& line : m.process->read_lines()) {
    if (line.starts_with("progress ")) progress_ = line.substr(9);
    if (line.starts_with("note ")) notes_.push_back(line.substr(5));
  }
}

std::string Pipeline::progress() { return progress_; }

void Pipeline::finish() {
  // The viewer sends its last measurements before anyone else leaves.
  for (auto& m : members_)
    if (m.role == "viewer" && m.process && !m.process->ended()) {
      m.process->signal(SIGTERM);
      m.process->finish(20);
    }
  if (members_.front().role == "master" && members_.front().process && !members_.front().process->ended() &&
      !master_endpoint_.empty()) {
    ControlClient control(master_endpoint_);
    if (!control.ask("stop", 2)) members_.front().process->signal(SIGTERM);
    members_.front().process->finish(kFarewell_s);
  }
  // Whom the master could not tell, because it is dead or they had not said hello yet.
  for (auto& m : members_)
    if (m.process) m.process->signal(SIGTERM);
  for (auto& m : members_)
    if (m.process) m.process->finish(kFarewell_s);
}

}  // namespace telesplat::launcher
