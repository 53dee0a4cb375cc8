#include "common/net/master_address.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "common/net/local_endpoint.h"

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;

// True if a socket can connect to it: tcp://HOST:PORT or ipc://PATH.
bool is_address(const std::string& text) {
  constexpr std::string_view kTcp = "tcp://", kIpc = "ipc://";
  if (text.find_first_of(" \t\n") != text.npos) return false;
  if (text.starts_with(kIpc)) return text.size() > kIpc.size();
  const size_t colon = text.rfind(':');
  if (!text.starts_with(kTcp) || colon <= kTcp.size()) return false;
  int port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, port);
  return error == std::errc() && stop == end && port >= 1 && port <= 65535;
}

// Returns the keys that the file of a session of this user names; empty: no such session is at that address.
std::string keys_at(const std::string& master) {
  const std::string address = local_address(numeric_host(master));
  for (const auto& s : running_sessions())
    if (s.address == address) return s.keys;
  return {};
}

// True if a person may call the session by this name.
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
  if (!master.empty() && master != kTheOneMaster) {
    if (is_address(master)) return {.address = master, .problem = {}, .keys = keys_at(master)};
    return {.address = {},
            .problem =
                fmt::format("{} {}: is no address such as tcp://127.0.0.1:7700",
                            master == master_from_environment() ? kMasterVariable : "--master", master.substr(0, 200)),
            .several = true};
  }
  const auto running = running_sessions();
  auto fitting = running;
  if (!session.empty()) std::erase_if(fitting, [&](const auto& s) { return !is_called(s, session); });
  if (fitting.size() == 1) return {.address = fitting.front().address, .problem = {}, .keys = fitting.front().keys};
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
