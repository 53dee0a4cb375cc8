#include "common/net/session_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <tuple>

#include "common/core/machine.h"
#include "common/core/utf8.h"
#include "common/net/service.h"

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::ordered_json;

constexpr size_t kMostBytes = 64 << 10;
constexpr size_t kMostText = 4096;  // limit of one value that is read; written ones are shorter
constexpr std::string_view kFileBegin = "session-", kFileEnd = ".json";

// The machine and namespace in which a process number is valid: a container numbers its own processes, and after a
// restart of the machine numbers are reused.
struct SessionPlace {
  std::string host, numbers, boot;
};

SessionPlace this_place() {
  SessionPlace out{.host = to_utf8(host_name()), .numbers = {}, .boot = {}};
  std::error_code error;
  out.numbers = to_utf8(fs::read_symlink("/proc/self/ns/pid", error).string());
  std::ifstream("/proc/sys/kernel/random/boot_id") >> out.boot;
  return out;
}

// Start of a process, in clock ticks since the machine started: it differs between processes with the same number.
// nullopt: no such process runs.
std::optional<uint64_t> process_start(uint64_t pid) {
  std::ifstream in(fmt::format("/proc/{}/stat", pid));
  std::string line;
  std::getline(in, line);
  const size_t name_end = line.rfind(')');  // a name may contain any character
  if (name_end == std::string::npos) return std::nullopt;
  std::istringstream rest(line.substr(name_end + 1));
  std::string state, skipped;
  rest >> state;
  if (state == "Z" || state == "X") return std::nullopt;  // dead, but its parent has not waited for it
  for (int field = 4; field < 22; ++field) rest >> skipped;
  uint64_t out = 0;
  return rest >> out ? std::optional(out) : std::nullopt;
}

Json to_json(const RunningSession& s) {
  const SessionPlace place = this_place();
  const auto told = [](const std::string& text) { return to_utf8(text).substr(0, kMostText - 8); };
  return {{"address", told(s.address)},
          {"pid", s.pid},
          {"process_start", process_start(s.pid).value_or(0)},
          {"host", place.host},
          {"numbers", place.numbers},
          {"boot", place.boot},
          {"scene", told(s.scene)},
          {"kind", told(s.kind)},
          {"run_folder", told(s.run_folder)},
          {"started_at_s", s.started_at_s},
          {"started_by", told(s.started_by)},
          {"keys", told(s.keys)}};
}

struct File {
  RunningSession session;
  uint64_t process_start = 0;
  SessionPlace place;
};

// Replaces control characters, which would steer a terminal or break a table's line.
std::string harmless(std::string text) {
  for (size_t i = 0; i < text.size(); ++i) {
    const auto byte = [&](size_t at) { return at < text.size() ? static_cast<unsigned char>(text[at]) : 0; };
    if (byte(i) < 32 || byte(i) == 127) text[i] = '?';
    if (byte(i) == 0xc2 && byte(i + 1) < 0xa0) text.replace(i, 2, "?");  // U+0080 to U+009F
  }
  return text;
}

std::optional<std::string> text_at(const Json& json, const char* key) {
  const auto it = json.find(key);
  if (it == json.end() || !it->is_string() || it->get_ref<const std::string&>().size() > kMostText) return std::nullopt;
  return harmless(it->get<std::string>());
}

std::optional<uint64_t> count_at(const Json& json, const char* key) {
  const auto it = json.find(key);
  return it != json.end() && it->is_number_unsigned() ? std::optional(it->get<uint64_t>()) : std::nullopt;
}

bool looks_like_address(const std::string& text) {
  return (text.starts_with("tcp://") || text.starts_with("ipc://")) && text.find(' ') == std::string::npos;
}

std::optional<File> parse(const std::string& text) {
  const auto json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto pid = count_at(json, "pid"), start = count_at(json, "process_start");
  const auto at = json.find("started_at_s");
  const auto address = text_at(json, "address"), scene = text_at(json, "scene"), kind = text_at(json, "kind"),
             folder = text_at(json, "run_folder"), by = text_at(json, "started_by"), host = text_at(json, "host"),
             numbers = text_at(json, "numbers"), boot = text_at(json, "boot"), keys = text_at(json, "keys");
  if (!pid || !start || at == json.end() || !at->is_number() || !std::isfinite(at->get<double>()) || !address ||
      !looks_like_address(*address) || !scene || !kind || !folder || !by || !host || !numbers || !boot ||
      (!keys && json.contains("keys")))
    return std::nullopt;
  return File{.session = {.address = *address,
                          .pid = *pid,
                          .scene = *scene,
                          .kind = *kind,
                          .run_folder = *folder,
                          .started_at_s = at->get<double>(),
                          .started_by = *by,
                          .keys = keys.value_or("")},
              .process_start = *start,
              .place = {.host = *host, .numbers = *numbers, .boot = *boot}};
}

void read_sessions(const RuntimeFolder& folder, const SessionPlace& here, std::vector<RunningSession>& out) {
  for (const auto& name : folder.names()) {
    if (!name.starts_with(kFileBegin) || !name.ends_with(kFileEnd)) continue;
    const auto text = folder.read(name, kMostBytes);
    auto file = text ? parse(*text) : std::nullopt;
    if (!file || file->place.host != here.host || file->place.numbers != here.numbers) continue;
    if (file->place.boot == here.boot && process_start(file->session.pid) == file->process_start)
      out.push_back(std::move(file->session));
    else
      folder.remove(name);
  }
}

}  // namespace

Result<SessionFile> SessionFile::publish(const RunningSession& session) {
  auto folder = RuntimeFolder::make();
  if (!folder) return folder.error();
  const auto start = process_start(session.pid);
  SessionFile out(std::move(*folder), fmt::format("{}{}-{}{}", kFileBegin, session.pid, start.value_or(0), kFileEnd));
  if (const Status s = out.update(session); !s) return s.error();
  return out;
}

SessionFile::~SessionFile() {
  if (!name_.empty()) folder_.remove(name_);
}

Status SessionFile::update(const RunningSession& session) const {
  return folder_.write(name_, to_json(session).dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::vector<RunningSession> running_sessions() {
  const SessionPlace here = this_place();
  std::vector<RunningSession> out;
  for (const auto& path : RuntimeFolder::candidates())
    if (const auto folder = RuntimeFolder::open(path, false)) read_sessions(*folder, here, out);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) {
    return std::tie(a.started_at_s, a.pid) < std::tie(b.started_at_s, b.pid);
  });
  return out;
}

Status refuse_folder_in_use(const std::string& folder) {
  const std::string path = absolute_path(folder);
  for (const RunningSession& s : running_sessions())
    if (s.run_folder == path)
      return Error{fmt::format("{}: the session at {} (pid {}) records into it; end that first, or give another --out",
                               folder, s.address, s.pid)};
  return ok_status();
}

std::string local_address(const std::string& endpoint) {
  for (const auto& [everywhere, here] :
       {std::pair<std::string_view, std::string_view>{"tcp://0.0.0.0:", "tcp://127.0.0.1:"},
        {"tcp://[::]:", "tcp://[::1]:"}})
    if (endpoint.starts_with(everywhere)) return std::string(here) + endpoint.substr(everywhere.size());
  constexpr std::string_view kIpc = "ipc://";
  if (!endpoint.starts_with(kIpc) || endpoint.size() == kIpc.size()) return endpoint;
  const std::string path = endpoint.substr(kIpc.size());
  std::error_code error;
  return path.front() == '/' || path.front() == '@' ? endpoint : std::string(kIpc) + fs::absolute(path, error).string();
}

std::string absolute_path(const std::string& path) {
  if (path.empty() || simulated_world()) return path;
  std::error_code error;
  fs::path out = fs::weakly_canonical(fs::absolute(path, error), error);
  if (!out.has_filename()) out = out.parent_path();
  return out.string();
}

}  // namespace telesplat::net
