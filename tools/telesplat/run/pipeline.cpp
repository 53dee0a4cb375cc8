#include "tools/telesplat/run/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "common/core/clock.h"
#include "tools/telesplat/run/process_arguments.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
constexpr int kMaxRestarts = 5;
constexpr double kMasterPatience_s = 10, kFarewell_s = 4, kAskEvery_s = 0.1;
// From the start of a wall's viewers to the beginning of their trajectory: they join and receive their first view meanwhile.
constexpr double kWallLead_s = 1.5;

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
    for (int i = 1; i <= o.data_servers; ++i)
      p.members_.push_back({"data", "telesplat-data",
                            common(data_arguments(o, i - 1), o.data_servers == 1 ? "data" : fmt::format("data-{}", i)),
                            background});
    p.members_.push_back({"packer", "telesplat-packer", common(packer_arguments(o), "packer"), background / 2});
    for (int i = 1; i <= o.samplers; ++i)
      p.members_.push_back(
          {"sampler", "telesplat-sampler", common(sampler_arguments(o), fmt::format("sampler-{}", i)), background});
  }
  p.options_ = std::make_unique<RunOptions>(o);
  if (o.wall.empty()) p.add_viewers(0);
  for (auto& m : p.members_)
    if (!m.process)
      if (const Status s = p.launch(m); !s) return s.error();
  return p;
}

// The viewers of a wall share a clock, which begins when there is something to see: so they start once the data servers are there.
void Pipeline::add_viewers(double clock_from_s) {
  const RunOptions& o = *options_;
  for (int i = 1; i <= o.viewers; ++i) {
    std::vector<std::string> a = viewer_arguments(o, i, clock_from_s);
    a.insert(a.end(),
             {"--master", master_endpoint_, "--name", viewer_name(i), "--log-level", o.master.service.log_level});
    members_.push_back({"viewer", "telesplat-viewer", std::move(a), 0});
  }
  has_viewers_ = true;
}

Status Pipeline::start_wall() {
  const double now = monotonic_s();
  if (!control_) control_ = std::make_unique<ControlClient>(master_endpoint_);
  if (now - asked_s_ > kAskEvery_s) {
    control_->request_status();
    asked_s_ = now;
  }
  const auto status = control_->poll_status();
  if (!status || !status->contains("processes")) return ok_status();
  int there = 0;
  for (const auto& p : (*status)["processes"]) there += p.value("role", "") == "data" && p.value("alive", false);
  if (there < (options_->join_master.empty() ? options_->data_servers : 1)) return ok_status();
  control_.reset();
  const size_t before = members_.size();
  add_viewers(now + kWallLead_s);
  for (size_t i = before; i < members_.size(); ++i)
    if (const Status s = launch(members_[i]); !s) return s;
  return ok_status();
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
  if (!has_viewers_)
    if (const Status s = start_wall(); !s) {
      news.push_back(s.error().text);
      return State::kFailed;
    }
  int viewing = 0;
  for (auto& m : members_) {
    if (m.role == "viewer" && !m.process->ended()) ++viewing;
    read(m);
    if (!m.process->ended()) continue;
    read(m);  // its last words
    const std::string name = m.process->name();
    const int code = m.process->exit_code();
    if (m.role == "viewer") {
      if (code == 0) continue;
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
  return viewing == 0 && has_viewers_ ? State::kFinished : State::kRunning;
}

void Pipeline::read(Member& m) {
  for (const auto& line : m.process->read_lines()) {
    if (line.starts_with("progress ")) progress_ = line.substr(9);
    if (line.starts_with("note ")) notes_.push_back(line.substr(5));
  }
}

std::string Pipeline::progress() { return progress_; }

void Pipeline::finish() {
  // Viewers send their last measurements before anyone else leaves.
  for (auto& m : members_)
    if (m.role == "viewer" && m.process) m.process->signal(SIGTERM);
  for (auto& m : members_)
    if (m.role == "viewer" && m.process) m.process->finish(20);
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
