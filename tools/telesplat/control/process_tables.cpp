// The processes of a session as tables.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <vector>

#include "common/core/utf8.h"
#include "tools/common/text_table.h"
#include "tools/telesplat/control/json_fields.h"
#include "tools/telesplat/control/status_text.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostName = 26, kMostNamed = 8;
constexpr double kSilent_s = 3;  // processes report every second

std::string fact_of(const Json& process, const char* key) {
  const auto* facts = field(process, "facts");
  return facts ? text(*facts, key) : std::string();
}

/// A column: its title and what a process has there; empty: nothing.
struct Field {
  const char* title;
  std::function<std::string(const Json&)> cell;
  bool right = true;
};

// A number of `group`, in units of `unit`, with so many digits.
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
// Share of its time in which a sampler samples and encodes.
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

// Against the master's; nothing where it is the same clock.
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

// Empty: there are no processes.
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

// How processes are connected, those that report it.
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

}  // namespace telesplat::launcher
