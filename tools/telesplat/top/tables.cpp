#include "tools/telesplat/top/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/common/text_table.h"

namespace telesplat::launcher {
namespace {

using Cell = std::function<std::string(const TopProcess&)>;

constexpr size_t kMostName = 24, kLeastName = 8, kGap = 2;

std::string written(std::optional<double> v, double unit, int digits) {
  return v && std::isfinite(*v) ? fmt::format("{:.{}f}", *v / unit, digits) : std::string();
}
Cell value(const char* key, double unit = 1, int digits = 0) {
  return [=](const TopProcess& p) { return written(p.value(key), unit, digits); };
}
Cell rate(const char* key, double unit = 1, int digits = 1) {
  return [=](const TopProcess& p) { return written(p.rate(key), unit, digits); };
}
Cell fact(const char* key) {
  return [=](const TopProcess& p) { return tools::shortened(p.fact(key), 12); };
}
// "16.7/20.1"
Cell median_and_p95(const std::string& name, int digits) {
  return [=](const TopProcess& p) {
    const auto median = p.value(name + "_ms"), p95 = p.value(name + "_p95_ms");
    return median && p95 ? written(median, 1, digits) + "/" + written(p95, 1, digits) : std::string();
  };
}
// What is none of a process' business it tells as 0.
Cell unless_zero(Cell cell) {
  return [cell = std::move(cell)](const TopProcess& p) {
    std::string out = cell(p);
    return out.find_first_not_of("0.") == std::string::npos ? std::string() : out;
  };
}

// Share of the time in which it samples, of one that has any to tell.
std::string busy(const TopProcess& p) {
  const auto share = p.rate("busy_s");
  return share ? fmt::format("{:.0f} %", 100 * std::clamp(*share, 0.0, 1.0)) : std::string();
}

std::string leases(const TopProcess& p) { return written(p.leases, 1, 0); }

std::string clock(const TopProcess& p) {
  const auto offset = p.value("clock_offset_ms"), error = p.value("clock_error_ms");
  if (!offset) return {};
  return fmt::format("{:+.2f}", *offset) + (error ? fmt::format(" +-{:.2f}", *error) : "");
}

TopTable viewers(const TopState& state) {
  return {"viewer",
          {{"coupling", 70, coupling_of},
           {"fps", 100, rate("frames")},
           {"delay ms", 90, median_and_p95("inter_frame", 1)},
           {"updates/s", 50, rate("updates")},
           {"latency ms", 85, median_and_p95("update_latency", 0)},
           {"age ms", 60, value("update_age_ms")},
           {"MB/s", 65, rate("bytes_received", 1e6, 2)},
           {"M points", 55, unless_zero(value("points", 1e6, 2))},
           {"M pixels", 40, unless_zero(value("pixels", 1e6, 2))},
           {"holes %", 45, value("holes_percent", 1, 2)},
           {"renderer", 20, fact("renderer")},
           {"MB", 30, value("rss_mb")}},
          state.alive("viewer"),
          true};
}

TopTable samplers(const TopState& state, TopSort sort) {
  TopTable out{"sampler",
               {{"kind", 50, fact("sampler")},
                {"threads", 40, fact("threads")},
                {"leases", 90, leases},
                {"queue", 80, value("leases_held")},
                {"busy", 95, busy},
                {"tiles/s", 100, rate("tiles_sampled")},
                {"tiles", 60, value("tiles_sampled")},
                {"chunk MB", 35, value("chunk_mb")},
                {"voxel MB", 35, value("voxel_mb")},
                {"MB", 30, value("rss_mb")}},
               state.alive("sampler")};
  const char* key = sort == TopSort::kBusy ? "busy_s" : "tiles_sampled";
  if (sort != TopSort::kName)
    std::stable_sort(out.rows.begin(), out.rows.end(), [key](const TopProcess* a, const TopProcess* b) {
      return a->rate(key).value_or(-1) > b->rate(key).value_or(-1);
    });
  return out;
}

TopTable packers(const TopState& state) {
  return {"packer",
          {{"tiles/s", 100, rate("tiles")},
           {"blocks/s", 60, rate("blocks")},
           {"frames/s", 70, rate("volume_frames_complete")},
           {"sent MB/s", 95, rate("bytes_sent", 1e6, 2)},
           {"sent MB", 50, value("bytes_sent", 1e6, 1)},
           {"M points", 80, value("points", 1e6, 2)},
           {"model MB", 45, value("model_bytes", 1e6, 0)},
           {"forgotten", 40, value("points_forgotten")},
           {"MB", 30, value("rss_mb")}},
          state.alive("packer")};
}

TopTable data_servers(const TopState& state) {
  return {"data server",
          {{"requests/s", 90, rate("requests")},
           {"requests", 60, value("requests")},
           {"sent MB/s", 95, rate("bytes_sent", 1e6, 2)},
           {"sent MB", 50, value("bytes_sent", 1e6, 1)},
           {"format", 45, fact("format")},
           {"primitives", 40, fact("primitives")},
           {"MB", 30, value("rss_mb")}},
          state.alive("data")};
}

TopTable links(const TopState& state) {
  TopTable out{"link of",
               {{"host", 40, fact("host")},
                {"rtt ms", 90, value("rtt_ms", 1, 2)},
                {"Mbit/s", 95, value("link_mbit", 1, 1)},
                {"backlog kB", 80, value("backlog_bytes", 1e3, 1)},
                {"clock ms", 85, clock}},
               {}};
  for (const TopProcess& p : state.processes)
    if (p.alive &&
        (p.value("rtt_ms") || p.value("link_mbit") || p.value("backlog_bytes") || p.value("clock_offset_ms")))
      out.rows.push_back(&p);
  return out;
}

std::string padded(const std::string& text, size_t width, bool right) {
  const std::string space(width - std::min(width, tools::width_of(text)), ' ');
  return right ? space + text : text + space;
}

// A table that is drawn: the columns that are left, with their widths.
struct Drawn {
  const TopColumn* column;
  std::vector<std::string> cells;
  size_t width;
};

std::vector<Drawn> filled_columns(const TopTable& table) {
  std::vector<Drawn> out;
  for (const TopColumn& c : table.columns) {
    Drawn d{&c, {}, tools::width_of(c.title)};
    bool any = false;
    for (const TopProcess* p : table.rows) {
      d.cells.push_back(c.cell(*p));
      d.width = std::max(d.width, tools::width_of(d.cells.back()));
      any |= !d.cells.back().empty();
    }
    if (any) out.push_back(std::move(d));
  }
  return out;
}

}  // namespace

std::string coupling_of(const TopProcess& viewer) {
  const auto mode = viewer.value("coupling");
  if (!mode) return {};
  if (*mode == 0) return "async";
  if (*mode == 1) return "sync";
  if (*mode == 3) return "images";
  return fmt::format("loose({:.0f})", viewer.value("buffers").value_or(0));
}

std::vector<TopTable> top_tables(const TopState& state, TopSort sort) {
  return {viewers(state), samplers(state, sort), packers(state), data_servers(state), links(state)};
}

std::vector<TopLine> table_lines(const TopTable& table, size_t width) {
  if (table.rows.empty()) return {};
  std::vector<Drawn> columns = filled_columns(table);
  size_t name = tools::width_of(table.title);
  for (const TopProcess* p : table.rows) name = std::max(name, std::min(kMostName, tools::width_of(p->name)));
  const auto total = [&] {
    size_t out = name;
    for (const Drawn& d : columns) out += kGap + d.width;
    return out;
  };
  while (total() > width && !columns.empty()) {
    if (total() - width <= name - std::min(name, std::max(kLeastName, tools::width_of(table.title)))) {
      name -= total() - width;
      break;
    }
    columns.erase(std::min_element(columns.begin(), columns.end(), [](const Drawn& a, const Drawn& b) {
      return a.column->importance < b.column->importance;
    }));
  }
  std::vector<TopLine> out;
  std::string head = padded(table.title, name, false);
  for (const Drawn& d : columns) head += std::string(kGap, ' ') + padded(d.column->title, d.width, true);
  out.push_back({{head, TopStyle::kHead}});
  for (size_t i = 0; i < table.rows.size(); ++i) {
    std::string row = padded(tools::shortened(table.rows[i]->name, std::max<size_t>(name, 3)), name, false);
    for (const Drawn& d : columns) row += std::string(kGap, ' ') + padded(d.cells[i], d.width, true);
    out.push_back({{row}});
  }
  return out;
}

}  // namespace telesplat::launcher
