#include "tools/telesplat/control/status_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "common/core/utf8.h"
#include "common/net/connections/waiting.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/control/json_fields.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostName = 26, kMostNamed = 8;
constexpr double kSilent_s = 3;  // processes report every second

std::string fact_of(const Json& process, const char* key) {
  const auto* facts = field(process, "facts");
  return facts ? text(*facts, key) : std::string();
}

/// A column: its title, and its cell for a process; empty: the process has no value.
struct Field {
  const char* title;
  std::function<std::string(const Json&)> cell;
  bool right = true;
};

// A number of `group`, divided by `unit`, with `digits` digits after the point.
Field value(const char* title, const char* group, const char* key, double unit, int digits) {
  return {title, [=](const Json& p) {
            const auto* values = field(p, group);
            const auto v = values ? number(*values, key) : std::nullopt;
            return v ? fmt::format("{:.{}f}", *v / unit, digits) : std::string();
          }};
}
Field rate(const char* title, const char* key, double unit = 1) { return value(title, "rates", key, unit, 1); }
Field counted(const char* title, const char* key) { return value(title, "values", key, 1, 0); }
Field millions(const char* title, const char* key) { return value(title, "values", key, 1e6, 2); }
// Processes report 0 for figures that do not concern them.
Field unless_zero(Field shown) {
  return {shown.title,
          [cell = shown.cell](const Json& p) {
            const std::string out = cell(p);
            return out.find_first_not_of("0.") == std::string::npos ? std::string() : out;
          },
          shown.right};
}
Field fact(const char* title, const char* key) {
  return {title, [=](const Json& p) { return tools::shortened(fact_of(p, key), 20); }};
}
// "16.7/20.1": median and 95th percentile of the last seconds.
Field median_and_p95(const char* title, const std::string& name, int digits) {
  return {title, [=](const Json& p) {
            const auto* values = field(p, "values");
            const auto median = values ? number(*values, (name + "_ms").c_str()) : std::nullopt;
            const auto p95 = values ? number(*values, (name + "_p95_ms").c_str()) : std::nullopt;
            return median && p95 ? fmt::format("{:.{}f}/{:.{}f}", *median, digits, *p95, digits) : std::string();
          }};
}
Field coupling() {
  return {"coupling", [](const Json& p) -> std::string {
            const auto* values = field(p, "values");
            const auto mode = values ? number(*values, "coupling") : std::nullopt;
            if (!mode) return {};
            if (*mode == 0) return "async";
            if (*mode == 1) return "sync";
            if (*mode == 3) return "images";
            return fmt::format("loose({:.0f})", number(*values, "buffers").value_or(0));
          }};
}
// Share of its time that a sampler spends sampling and encoding.
Field busy() {
  return {"busy", [](const Json& p) {
            const auto* rates = field(p, "rates");
            const auto share = rates ? number(*rates, "busy_s") : std::nullopt;
            return share ? fmt::format("{:.0f} %", 100 * std::clamp(*share, 0.0, 1.0)) : std::string();
          }};
}
Field leases() {
  return {"leases", [](const Json& p) {
            const auto n = number(p, "leases");
            return n ? fmt::format("{:.0f}", *n) : std::string();
          }};
}

Field size() {
  return {"size", [](const Json& p) {
            const std::string width = fact_of(p, "width"), height = fact_of(p, "height");
            return width.empty() || height.empty() ? std::string() : width + "x" + height;
          }};
}

std::string heard(const Json& p) {
  const auto silent_s = number(p, "silent_s");
  if (!silent_s) return {};
  if (const auto stuck_s = number(p, "delivers_nothing_s"); stuck_s && *silent_s <= kSilent_s)
    return fmt::format("delivers nothing for {:.1f} s", *stuck_s);
  return *silent_s > kSilent_s ? fmt::format("silent for {:.1f} s", *silent_s) : fmt::format("{:.1f} s ago", *silent_s);
}

// Offset to the master's clock; nothing if the process has the same clock.
Field clock_offset() {
  return {"clock ms", [](const Json& p) {
            const auto* values = field(p, "values");
            const auto offset = values ? number(*values, "clock_offset_ms") : std::nullopt;
            const auto error = values ? number(*values, "clock_error_ms") : std::nullopt;
            if (!offset || !error || *error <= 0) return std::string();
            return fmt::format("{:+.2f} ± {:.2f}", *offset, *error);
          }};
}

struct RoleTable {
  const char* role;
  const char* title;
  std::vector<Field> fields;
};

const std::vector<RoleTable>& role_tables() {
  static const std::vector<RoleTable> all{
      {"viewer",
       "viewer",
       {size(), coupling(), rate("fps", "frames"), median_and_p95("delay ms", "inter_frame", 1),
        rate("views/s", "updates"), median_and_p95("view ms", "update_latency", 0), counted("age ms", "update_age_ms"),
        unless_zero(value("waits s", "values", "waits_s", 1, 1)), rate("MB/s", "bytes_received", 1e6),
        unless_zero(millions("M points", "points")), unless_zero(millions("M pixels", "pixels")),
        unless_zero(value("holes %", "values", "holes_percent", 1, 2)), counted("epoch", "epoch"),
        unless_zero(counted("gaps", "gaps_resynced"))}},
      {"packer",
       "packer",
       {rate("tiles/s", "tiles"), rate("blocks/s", "blocks"), rate("frames/s", "volume_frames_complete"),
        rate("sent MB/s", "bytes_sent", 1e6), value("sent MB", "values", "bytes_sent", 1e6, 1),
        millions("M points", "points"), counted("forgotten", "points_forgotten")}},
      {"sampler",
       "sampler",
       {fact("kind", "sampler"), fact("threads", "threads"), leases(), counted("queue", "leases_held"), busy(),
        rate("tiles/s", "tiles_sampled"), counted("tiles", "tiles_sampled"),
        value("chunk MB", "values", "chunk_mb", 1, 0), value("voxel MB", "values", "voxel_mb", 1, 0)}},
      {"data",
       "data server",
       {fact("format", "format"), fact("primitives", "primitives"), counted("requests", "requests"),
        rate("sent MB/s", "bytes_sent", 1e6), value("sent MB", "values", "bytes_sent", 1e6, 1)}}};
  return all;
}

Field name(const char* title) {
  return {title, [](const Json& p) { return tools::shortened(printable(text(p, "name")), kMostName); }, false};
}
Field host() {
  return {"host", [](const Json& p) { return tools::shortened(printable(fact_of(p, "host")), 16); }, false};
}

// Empty if there are no processes.
std::string table_with(const std::vector<Field>& fields, const std::vector<Json>& processes) {
  std::vector<tools::TextTable::Column> columns;
  for (const Field& f : fields) columns.push_back({f.title, f.right});
  tools::TextTable table(columns);
  for (const Json& p : processes) {
    std::vector<std::string> cells;
    for (const Field& f : fields) cells.push_back(f.cell(p));
    table.add(std::move(cells));
  }
  return table.empty() ? std::string() : "\n" + table.text();
}

std::string table_of(const RoleTable& role, const std::vector<Json>& processes, bool hosts_differ) {
  std::vector<Field> fields{name(role.title)};
  if (hosts_differ) fields.push_back(host());
  fields.insert(fields.end(), role.fields.begin(), role.fields.end());
  fields.push_back(value("MB", "values", "rss_mb", 1, 0));
  fields.push_back(value("most MB", "values", "peak_rss_mb", 1, 0));
  fields.push_back(unless_zero(counted("rejected", "messages_rejected")));
  fields.push_back(unless_zero(counted("keys refused", "keys_refused")));
  fields.push_back(unless_zero(counted("connections refused", "connections_refused")));
  fields.push_back(unless_zero(counted("requests dropped", "messages_refused")));
  fields.push_back(unless_zero(counted("answers dropped", "queue_refused")));
  fields.push_back({"heard of", heard});
  return table_with(fields, processes);
}

// Table of the connections of processes that report them.
std::string link_table(const std::vector<Json>& processes) {
  const std::vector<Field> fields{name("link of"), value("rtt ms", "values", "rtt_ms", 1, 2),
                                  value("Mbit/s", "values", "link_mbit", 1, 1),
                                  value("backlog kB", "values", "backlog_bytes", 1e3, 1), clock_offset()};
  std::vector<Json> linked;
  for (const Json& p : processes)
    if (std::any_of(fields.begin() + 1, fields.end(), [&](const Field& f) { return !f.cell(p).empty(); }))
      linked.push_back(p);
  return table_with(fields, linked);
}

using Json = nlohmann::ordered_json;

constexpr size_t kColumns = 110, kIndent = 14;  // width of a line; width of its label

std::string line(const std::string& what, const std::string& value) { return fmt::format("  {:<12}{}\n", what, value); }

// Breaks words into lines.
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

// Lists the limits that were hit, with their counts.
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

// A volume's parameters are its grid and placement; `inspect` prints them.
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

std::string process_tables(const Json& processes) {
  std::string out;
  std::set<std::string> hosts;
  std::vector<std::string> left;
  std::vector<Json> here;
  for (const auto& p : processes) {
    if (!p.is_object()) continue;
    if (!flag(p, "alive")) {
      left.push_back(tools::shortened(printable(text(p, "name")), kMostName));
      continue;
    }
    hosts.insert(fact_of(p, "host"));
    here.push_back(p);
  }
  std::sort(here.begin(), here.end(), [](const Json& a, const Json& b) { return text(a, "name") < text(b, "name"); });
  for (const RoleTable& role : role_tables()) {
    std::vector<Json> of_role;
    std::copy_if(here.begin(), here.end(), std::back_inserter(of_role),
                 [&](const Json& p) { return text(p, "role") == role.role; });
    out += table_of(role, of_role, hosts.size() > 1);
  }
  out += link_table(here);
  if (left.empty()) return out;
  const size_t more = left.size() - std::min(left.size(), kMostNamed);
  left.resize(left.size() - more);
  return out + fmt::format("\nleft: {}{}\n", fmt::join(left, ", "), more ? fmt::format(" and {} more", more) : "");
}

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
