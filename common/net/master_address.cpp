#include "common/net/master_address.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;

// As a person may name it.
bool is_called(const RunningSession& session, const std::string& name) {
  if (name == std::to_string(session.pid) || name == session.address) return true;
  for (const auto& text : {session.scene, session.run_folder})
    if (!text.empty() && (name == text || name == fs::path(text).filename())) return true;
  return !session.run_folder.empty() && absolute_path(name) == session.run_folder;
}

std::string listed(const std::vector<RunningSession>& sessions) {
  std::string out;
  for (const auto& s : sessions) out += "\n  " + described(s);
  return out;
}

}  // namespace

std::string master_from_environment() {
  const char* address = std::getenv(kMasterVariable);
  return address ? address : "";
}

MasterSearch find_master(const std::string& master, const std::string& session) {
  if (!master.empty() && master != kTheOneMaster) return {.address = master, .problem = {}};
  const auto running = running_sessions();
  auto fitting = running;
  if (!session.empty()) std::erase_if(fitting, [&](const auto& s) { return !is_called(s, session); });
  if (fitting.size() == 1) return {.address = fitting.front().address, .problem = {}};
  if (running.empty())
    return {.address = {},
            .problem =
                "no session of yours runs on this machine; start one with telesplat run or view, or name a master "
                "with --master ADDRESS"};
  const std::string choose = "choose with --master ADDRESS or --session PID:";
  if (fitting.empty())
    return {.address = {},
            .problem = fmt::format("--session {}: no session is called so; {}{}", session.substr(0, 80), choose,
                                   listed(running)),
            .several = true};
  return {
      .address = {},
      .problem = fmt::format("{} sessions of yours run on this machine; {}{}", fitting.size(), choose, listed(fitting)),
      .several = true};
}

std::string described(const RunningSession& s) {
  return fmt::format("{}  pid {}  {}  by {} since {:%F %T}  {}", s.address, s.pid,
                     s.scene.empty() ? "scene not known yet" : s.scene, s.started_by,
                     fmt::localtime(std::time_t(s.started_at_s)), s.run_folder.empty() ? "no record" : s.run_folder);
}

}  // namespace telesplat::net
