#include "tools/telesplat/bench/processes.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <thread>

#include "common/core/clock.h"
#include "common/net/service.h"
#include "tools/telesplat/run/pipeline.h"

namespace telesplat::launcher {
namespace {

constexpr double kPatience_s = 20;                    // for processes to start
constexpr int kPackerNice = 5, kBackgroundNice = 10;  // as `telesplat run` has them

int count_alive(const nlohmann::json& status, const std::string& role) {
  int n = 0;
  // Values come with the first report, after the welcome.
  for (const auto& p : status.value("processes", nlohmann::json::array()))
    n += p.value("role", "") == role && p.value("alive", false) && p.contains("values");
  return n;
}

}  // namespace

Result<std::unique_ptr<BenchProcesses>> BenchProcesses::start(const std::vector<std::string>& data_arguments,
                                                              const std::vector<std::string>& master_flags,
                                                              const std::string& directory, bool own_machines) {
  std::unique_ptr<BenchProcesses> p(new BenchProcesses);
  p->directory_ = directory;
  std::error_code error;
  std::filesystem::create_directories(directory + "/logs", error);
  if (error) return Error{fmt::format("{}: cannot be made: {}", directory, error.message())};
  std::vector<std::string> master{"--bind", "tcp://127.0.0.1:*", "--out", directory};
  master.insert(master.end(), master_flags.begin(), master_flags.end());
  if (const Status s = p->launch(p->servers_, "master", "telesplat-master", master, 0); !s) return s.error();
  const Status listens = p->wait_for("the master", kPatience_s, [&] {
    for (const auto& line : p->servers_.front().read_lines())
      if (line.starts_with("listening on ")) p->endpoint_ = line.substr(13);
    return !p->endpoint_.empty();
  });
  if (!listens) return listens.error();
  p->control_ = std::make_unique<ControlClient>(p->endpoint_);
  if (const Status s = p->launch(p->servers_, "data", "telesplat-data", data_arguments, kBackgroundNice); !s)
    return s.error();
  if (const Status s = p->launch(p->servers_, "packer", "telesplat-packer", {}, own_machines ? 0 : kPackerNice); !s)
    return s.error();
  return p;
}

BenchProcesses::~BenchProcesses() { finish(); }

Status BenchProcesses::launch(std::vector<ChildProcess>& into, const std::string& name, const std::string& program,
                              std::vector<std::string> arguments, int nice) {
  arguments.insert(arguments.end(), {"--name", name, "--log-level", "warn"});
  if (!endpoint_.empty()) arguments.insert(arguments.end(), {"--master", endpoint_});
  auto child = ChildProcess::start(name, program_directory() + "/" + program, arguments,
                                   fmt::format("{}/logs/{}.log", directory_, name), nice);
  if (!child) return child.error();
  into.push_back(std::move(*child));
  return ok_status();
}

Status BenchProcesses::alive() {
  if (net::stop_requested()) return Error{"interrupted"};
  for (auto* group : {&servers_, &samplers_})
    for (auto& p : *group)
      if (p.ended() && p.exit_code() != 128 + SIGKILL)
        return Error{fmt::format("{} ended with code {}; see {}/logs", p.name(), p.exit_code(), directory_)};
  return ok_status();
}

Status BenchProcesses::wait_for(const char* what, double patience_s, const std::function<bool()>& condition) {
  for (const double until = monotonic_s() + patience_s; !condition();) {
    if (const Status s = alive(); !s) return s;
    if (monotonic_s() > until)
      return Error{fmt::format("{} did not start within {} s; see {}/logs", what, patience_s, directory_)};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return ok_status();
}

Status BenchProcesses::wait_for_role(const char* what, const std::string& role, int count, double patience_s,
                                     const Meanwhile& meanwhile) {
  double asked_s = -1e9;
  return wait_for(what, patience_s, [&] {
    meanwhile();
    if (monotonic_s() - asked_s < 0.2) return false;
    asked_s = monotonic_s();
    const auto known = status();
    return known && count_alive(*known, role) >= count;
  });
}

Status BenchProcesses::wait_for_data(double patience_s, const Meanwhile& meanwhile) {
  if (const Status s = wait_for_role("the packer", "packer", 1, kPatience_s, meanwhile); !s) return s;
  return wait_for_role("the data server", "data", 1, patience_s, meanwhile);
}

Status BenchProcesses::add_samplers(size_t count, const std::vector<std::string>& flags, const Meanwhile& meanwhile) {
  while (samplers_.size() < count) {
    const Status s =
        launch(samplers_, fmt::format("sampler-{}", samplers_.size() + 1), "telesplat-sampler", flags, kBackgroundNice);
    if (!s) return s;
  }
  return wait_for_role("the samplers", "sampler", int(count), kPatience_s, meanwhile);
}

std::optional<nlohmann::json> BenchProcesses::status() {
  const auto answer = control_->ask("status", 2);
  if (!answer) return std::nullopt;
  auto json = nlohmann::json::parse(*answer, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  return json;
}

void BenchProcesses::finish() {
  if (servers_.empty()) return;
  if (!endpoint_.empty() && !servers_.front().ended()) {
    ControlClient control(endpoint_);
    if (!control.ask("stop", 2)) servers_.front().signal(SIGTERM);
    servers_.front().finish(4);
  }
  for (auto* group : {&samplers_, &servers_}) {
    for (auto& p : *group) p.signal(SIGTERM);
    for (auto& p : *group) p.finish(2);
    group->clear();
  }
}

}  // namespace telesplat::launcher
