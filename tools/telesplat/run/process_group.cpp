#include "tools/telesplat/run/process_group.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>
#include <utility>

#include "common/core/clock.h"
#include "common/core/machine.h"
#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "common/net/control.h"
#include "common/net/service.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr double kViewersFarewell_s = 20, kFarewell_s = 4;
// Time in which a session ends once all its processes have the "stop".
constexpr double kSoon_s = 0.3;
constexpr std::string_view kListening = "listening on ";

}  // namespace

std::string program_directory() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path().string();
}

std::string output_of(const std::string& program, const std::string& argument) {
  const std::string path = program_directory() + "/" + program;
  if (access(path.c_str(), X_OK) != 0) return {};
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(shell_line({path, argument}).c_str(), "r"), pclose);
  std::string out;
  std::array<char, 4096> part;
  while (pipe)
    if (const size_t n = fread(part.data(), 1, part.size(), pipe.get()); n > 0)
      out.append(part.data(), n);
    else
      break;
  return out;
}

Status ProcessGroup::use_keys(const std::string& folder) {
  auto access = net::Access::open({}, folder, net::asking_roles());
  if (!access) return access.error();
  access_ = *std::move(access);
  keys_ = folder;
  return ok_status();
}

Status ProcessGroup::start_master(std::vector<std::string> arguments, double patience_s) {
  Member member{.role = "master", .name = "master", .arguments = std::move(arguments)};
  auto listens = start_listener(std::move(member), patience_s);
  if (!listens) return listens.error();
  endpoint_ = std::move(*listens);
  // A restarted master listens at its old address: processes that look for it know no other.
  auto& told = members_.back().arguments;
  const auto bind = std::find(told.begin(), told.end(), "--bind");
  if (bind != told.end() && bind + 1 != told.end()) *(bind + 1) = endpoint_;
  return ok_status();
}

Result<std::string> ProcessGroup::start_listener(Member member, double patience_s) {
  const std::string name = member.name;
  if (const Status s = start(std::move(member)); !s) return s.error();
  auto& process = *members_.back().process;
  for (const double until = monotonic_s() + patience_s;;) {
    for (const auto& line : process.read_lines())
      if (line.starts_with(kListening)) return line.substr(kListening.size());
    if (net::stop_requested()) return Error{"interrupted"};
    if (process.ended() || monotonic_s() > until)
      return Error{fmt::format("the {} did not start: {}", name, last_log_line(name))};
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

Status ProcessGroup::start(Member member) {
  if (const auto error = make_private_folder(log_directory_))
    return Error{fmt::format("{}: cannot be made a folder for logs: {}", log_directory_, error.message())};
  member.arguments.insert(member.arguments.end(), {"--name", member.name, "--log-level", log_level_});
  // Names the keys: the environment or a session's file may name other ones.
  const std::string keys = keys_.empty() ? net::kNoKeys : keys_;
  if (member.joins) member.arguments.insert(member.arguments.end(), {"--keys", keys});
  if (!endpoint_.empty() && member.joins) member.arguments.insert(member.arguments.end(), {"--master", endpoint_});
  members_.push_back(std::move(member));
  return restart(members_.back());
}

Status ProcessGroup::restart(Member& member) {
  auto child = ChildProcess::start(member.name, fmt::format("{}/telesplat-{}", program_directory(), member.role),
                                   member.arguments, fmt::format("{}/{}.log", log_directory_, member.name), member.nice,
                                   member.told);
  if (!child) return child.error();
  member.process.reset();
  member.process.emplace(std::move(*child));
  return ok_status();
}

void ProcessGroup::end(const std::string& role) {
  const auto of_role = [&](const Member& m) { return m.role == role; };
  for (Member& m : members_)
    if (of_role(m) && m.process) m.process->signal(SIGTERM);
  for (Member& m : members_)
    if (of_role(m) && m.process) m.process->finish(kFarewell_s);
  std::erase_if(members_, of_role);
}

Member* ProcessGroup::find(const std::string& name) {
  for (Member& m : members_)
    if (m.name == name) return &m;
  return nullptr;
}

std::string ProcessGroup::last_log_line(const std::string& name) const {
  std::ifstream in(fmt::format("{}/{}.log", log_directory_, name));
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return printable(last.starts_with("telesplat: ") ? last.substr(11) : last, 1000);
}

void ProcessGroup::limit_logs(double now_s) {
  if (now_s - looked_at_logs_s_ < 1) return;
  looked_at_logs_s_ = now_s;
  for (const Member& m : members_) limit_log(fmt::format("{}/{}.log", log_directory_, m.name));
}

void ProcessGroup::finish() {
  const auto signal = [&](auto&& which) {
    for (Member& m : members_)
      if (m.process && which(m)) m.process->signal(SIGTERM);
  };
  const auto end = [&](auto&& which, double patience_s) {
    signal(which);
    for (Member& m : members_)
      if (m.process && which(m)) m.process->finish(patience_s);
  };
  end([](const Member& m) { return m.role == "viewer"; }, kViewersFarewell_s);
  Member* master = find("master");
  if (master && master->process && !master->process->ended() && !endpoint_.empty()) {
    ControlClient control(endpoint_, access_);
    if (net::stop_requested() || !control.ask("stop", 2, {{"by", net::this_person()}}))
      master->process->signal(SIGTERM);
    for (const double until = monotonic_s() + kSoon_s; !master->process->ended() && monotonic_s() < until;)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    // Processes that joined while the session ended did not get the "stop", and the master waits for them.
    signal([](const Member& m) { return m.role != "master"; });
    master->process->finish(kFarewell_s);
  }
  // Ends those that the master did not reach, because it is dead or they had not joined yet.
  end([](const Member&) { return true; }, kFarewell_s);
}

void limit_log(const std::string& path, uint64_t most) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::regular) return;
  if (const auto bytes = fs::file_size(path, error); error || bytes <= most) return;
  const std::string before = fs::path(path).replace_extension(".before.log").string();
  fs::remove(before, error);  // removes a link, not its target
  if (!fs::copy_file(path, before, error)) fs::remove(before, error);
  fs::resize_file(path, 0, error);
}

}  // namespace telesplat::launcher
