#include "tools/telesplat/bench/processes.h"

#include <fmt/format.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "common/core/clock.h"
#include "common/net/service.h"

namespace telesplat::launcher {
namespace {

constexpr double kPatience_s = 20;                    // for processes to start
constexpr double kAskEvery_s = 0.2;                   // who has joined
constexpr int kPackerNice = 5, kBackgroundNice = 10;  // as `telesplat run` has them

int count_alive(const nlohmann::json& status, const std::string& role) {
  int n = 0;
  // Values come with the first report, after the welcome.
  for (const auto& p : status.value("processes", nlohmann::json::array()))
    n += p.value("role", "") == role && p.value("alive", false) && p.contains("values");
  return n;
}

std::string sampler_name(size_t number) { return fmt::format("sampler-{}", number); }

}  // namespace

BenchProcesses::BenchProcesses(const std::string& directory)
    : directory_(directory), group_(directory + "/logs", "warn") {}

Result<std::unique_ptr<BenchProcesses>> BenchProcesses::start(const std::vector<std::string>& data_arguments,
                                                              const std::vector<std::string>& master_flags,
                                                              const std::string& directory, bool own_machines) {
  unsetenv(net::kKeysVariable);  // this process has none
  std::unique_ptr<BenchProcesses> p(new BenchProcesses(directory));
  std::vector<std::string> master{"--bind", "tcp://127.0.0.1:*", "--started-by", "bench", "--out", directory};
  master.insert(master.end(), master_flags.begin(), master_flags.end());
  if (const Status s = p->group_.start_master(master, kPatience_s); !s) return s.error();
  p->control_ = std::make_unique<ControlClient>(p->endpoint());
  Member data{.role = "data", .name = "data", .arguments = data_arguments, .nice = kBackgroundNice};
  Member packer{.role = "packer", .name = "packer", .arguments = {}, .nice = own_machines ? 0 : kPackerNice};
  for (Member* m : {&data, &packer})
    if (const Status s = p->group_.start(std::move(*m)); !s) return s.error();
  return p;
}

BenchProcesses::~BenchProcesses() { finish(); }

Status BenchProcesses::alive() {
  if (net::stop_requested()) return Error{"interrupted"};
  for (Member& m : group_.members())
    if (m.process->ended() && m.process->exit_code() != 128 + SIGKILL)
      return Error{fmt::format("{} ended with code {}; see {}/logs", m.name, m.process->exit_code(), directory_)};
  return ok_status();
}

Status BenchProcesses::wait_for_role(const char* what, const std::string& role, int count, double patience_s,
                                     const Meanwhile& meanwhile) {
  double asked_s = -1e9;
  for (const double until = monotonic_s() + patience_s;;) {
    if (const Status s = alive(); !s) return s;
    meanwhile();
    if (monotonic_s() - asked_s >= kAskEvery_s) {
      asked_s = monotonic_s();
      const auto known = status();
      if (known && count_alive(*known, role) >= count) return ok_status();
    }
    if (monotonic_s() > until)
      return Error{fmt::format("{} did not start within {} s; see {}/logs", what, patience_s, directory_)};
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Status BenchProcesses::wait_for_data(double patience_s, const Meanwhile& meanwhile) {
  if (const Status s = wait_for_role("the packer", "packer", 1, kPatience_s, meanwhile); !s) return s;
  return wait_for_role("the data server", "data", 1, patience_s, meanwhile);
}

Status BenchProcesses::add_samplers(size_t count, const std::vector<std::string>& flags, const Meanwhile& meanwhile) {
  while (samplers_ < count) {
    Member sampler{.role = "sampler", .name = sampler_name(++samplers_), .arguments = flags, .nice = kBackgroundNice};
    if (const Status s = group_.start(std::move(sampler)); !s) return s;
  }
  return wait_for_role("the samplers", "sampler", int(count), kPatience_s, meanwhile);
}

void BenchProcesses::kill_sampler(size_t index) {
  if (Member* m = group_.find(sampler_name(index + 1))) m->process->signal(SIGKILL);
}

std::optional<nlohmann::json> BenchProcesses::status() {
  const auto answer = control_->ask("status", 2);
  if (!answer) return std::nullopt;
  auto json = nlohmann::json::parse(*answer, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  return json;
}

void BenchProcesses::finish() {
  if (group_.members().empty()) return;
  group_.finish();
  group_.members().clear();
}

}  // namespace telesplat::launcher
