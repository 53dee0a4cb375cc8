#include "tools/telesplat/control/status_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <ctime>
#include <vector>

#include "common/core/utf8.h"
#include "common/net/connections/waiting.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/control/json_fields.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kColumns = 110, kIndent = 14;  // of a line, and of what a line of the head says

std::string line(const std::string& what, const std::string& value) { return fmt::format("  {:<12}{}\n", what, value); }

// Words in as many lines as they need.
std::string wrapped(const std::string& what, const std::vector<std::string>& words) {
  std::string out, row;
  const auto end_row = [&] {
    if (!row.empty()) out += line(out.empty() ? what : "", row);
    row.clear();
  };
  for (const auto& word : words) {
    if (!row.empty() && row.size() + 2 + word.size() > kColumns - kIndent) end_row();
    row += (row.empty() ? "" : "  ") + word;
  }
  end_row();
  return out;
}

std::string age(double seconds) {
  if (seconds < 120) return fmt::format("{:.0f} s", std::max(0.0, seconds));
  if (seconds < 7200) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.0f} h", seconds / 3600);
}

std::string started_by(const std::string& who) { return who == "hand" ? "by hand" : "by telesplat " + who; }

std::string title(const Json& session, double now_s) {
  const std::string scene = printable(text(session, "scene")), kind = printable(text(session, "kind"));
  std::string out = scene.empty() ? "no data server yet" : scene;
  if (!kind.empty() && !scene.starts_with(kind)) out += " (" + kind + ")";
  const double at_s = read_utc(text(session, "started_at"));
  if (at_s > 0)
    out += fmt::format(", started {} at {}, {} ago", started_by(text(session, "started_by")), local_time(at_s, now_s),
                       age(now_s - at_s));
  return out + "\n";
}

// Those that bit.
std::string limits(const Json& status) {
  const auto* told = field(status, "limits");
  if (!told || !told->is_object()) return {};
  std::vector<std::string> out;
  for (const auto& [key, what] : {std::pair{"views_coarser", "views sampled coarser"},
                                  {"hellos_refused", "processes refused"},
                                  {"messages_refused", "messages dropped"},
                                  {"connections_refused", "connections refused"},
                                  {"queue_refused", "answers dropped that nobody read"}})
    if (const uint64_t n = count(*told, key)) out.push_back(fmt::format("{} {}", n, what));
  return fmt::format("{}", fmt::join(out, ", "));
}

std::string head(const Json& status, double now_s) {
  std::string out;
  if (const auto* session = field(status, "session"); session && session->is_object()) {
    out += title(*session, now_s);
    out += line("address", fmt::format("{}, process {}", text(*session, "address"), count(*session, "pid")));
    const std::string folder = text(*session, "run_folder");
    out += line("record", folder.empty() ? "none" : folder);
    if (const std::string keys = text(*session, "keys"); !keys.empty()) out += line("keys", keys);
  }
  if (const std::string lacking = net::lacking_text(text(status, "lacks")); !lacking.empty())
    out += line("waits", lacking);
  if (const uint64_t refused = count(status, "keys_refused"); refused > 0)
    out += line("not let in", fmt::format("{} connections without a key that the master lets in", refused));
  out += line("views", fmt::format("{} complete, {} in flight; epoch {}", count(status, "frames_completed"),
                                   count(status, "frames_in_flight"), count(status, "epoch")));
  out += line("leases", fmt::format("{} expired, {} given to a second sampler; {} tiles taken back",
                                    count(status, "leases_expired"), count(status, "leases_backup"),
                                    count(status, "tiles_released")));
  if (const std::string bit = limits(status); !bit.empty()) out += line("limits", bit);
  if (const auto* failed = field(status, "record_failed"); failed && failed->is_array() && !failed->empty())
    out += line("disk full", fmt::format("{} files of the record cannot be written", failed->size()));
  if (const std::string animation = text(status, "animation"); !animation.empty() && animation != "off")
    out += line("animation", tools::shortened(animation, kColumns - kIndent));
  return out;
}

// A volume's parameters are its grid and placement, which `inspect` tells.
std::string parameters(const Json& status) {
  const auto* found = field(status, "parameters");
  if (field(status, "volume") || !found || !found->is_object()) return {};
  std::vector<std::string> words;
  for (const auto& [name, value] : found->items())
    if (value.is_number()) words.push_back(fmt::format("{} {:.5g}", name, value.get<double>()));
  return wrapped("parameters", words);
}

std::string colouring(const Json& status) {
  const std::string order = text(status, "colouring_order");
  const std::string waits = order.empty() ? "" : line("colours", tools::shortened(order, kColumns - kIndent));
  const auto* c = field(status, "colouring");
  if (!c || text(*c, "array").empty()) return waits;
  std::string told = fmt::format("{}, {:g} to {:g}", tools::shortened(text(*c, "array"), 40),
                                 number(*c, "lo").value_or(0), number(*c, "hi").value_or(0));
  for (const char* key : {"unit", "map"})
    if (const std::string word = text(*c, key); !word.empty())
      told += (*key == 'u' ? " " : ", ") + tools::shortened(word, 24);
  return line("coloured by", told) + waits;
}

std::string slabs(const Json& partition) {
  tools::TextTable table(
      {{"slab of", false}, {"slices"}, {"visible voxels"}, {"voxels held"}, {"MB received"}, {"", false}});
  for (const auto& s : array(partition, "slabs"))
    if (s.is_object())
      table.add({tools::shortened(text(s, "sampler"), 30),
                 fmt::format("{} to {}", count(s, "begin"), count(s, "end") - std::min<uint64_t>(1, count(s, "end"))),
                 std::to_string(count(s, "weight")), std::to_string(count(s, "voxels")),
                 fmt::format("{:.1f}", double(count(s, "bytes")) / 1e6), flag(s, "ready") ? "ready" : "being filled"});
  for (const auto& s : array(partition, "spare"))
    if (s.is_string()) table.add({tools::shortened(s.get<std::string>(), 30), "", "", "", "", "spare"});
  return table.empty() ? std::string() : "\n" + table.text();
}

std::string volume(const Json& status) {
  const auto* found = field(status, "volume");
  if (!found || !found->is_object()) return {};
  const Json& v = *found;
  std::string told = fmt::format("{} layers; cut into slabs {} times", count(v, "layers"), count(v, "partitions"));
  if (const uint64_t steps = count(v, "steps"); steps > 1)
    told = fmt::format("step {} of {} (0 to {}), ", count(v, "step"), steps, steps - 1) + told;
  std::string out = line("volume", told);
  out += line("transfer", tools::shortened(text(v, "transfer"), kColumns - kIndent));
  if (const auto* partition = field(v, "partition")) out += slabs(*partition);
  return out;
}

}  // namespace

std::string status_text(const Json& status, double now_s) {
  if (!status.is_object()) return {};
  return head(status, now_s) + colouring(status) + parameters(status) + volume(status) +
         process_tables(array(status, "processes"));
}

double read_utc(const std::string& text) {
  std::tm at{};
  const char* end = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &at);
  return end && *end == 0 ? double(timegm(&at)) : 0;
}

std::string local_time(double at_s, double now_s) {
  const std::tm at = fmt::localtime(std::time_t(at_s)), now = fmt::localtime(std::time_t(now_s));
  const bool today = at.tm_year == now.tm_year && at.tm_yday == now.tm_yday;
  return today ? fmt::format("{:%T}", at) : fmt::format("{:%F %T}", at);
}

}  // namespace telesplat::launcher
