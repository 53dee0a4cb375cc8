#include "tools/telesplat/bench/volume_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

// Rows: 1 to 4 clients; columns: servers, from 1 on.
using Rates = std::vector<std::vector<double>>;

const Rates& values_of(VolumeTable table) {
  static const Rates foot{{27, 25, 21, 18}, {27, 25, 20, 17}, {27, 24, 20, 17}, {26, 23, 18, 15}};
  static const Rates tree{{4.2, 6.8, 9.3, 12.3, 8.6, 5.4},
                          {4.2, 6.7, 9.3, 12.3, 8.6, 5.4},
                          {3.4, 6.2, 9.2, 12.1, 8.4, 5.4},
                          {3.2, 5.6, 8.7, 11.8, 8.4, 5.3}};
  return table == VolumeTable::kFoot ? foot : tree;
}

const VolumePoint* find(const VolumeReport& r, bool simulated, int samplers, int viewers) {
  for (const auto& p : r.points)
    if (p.simulated == simulated && p.samplers == samplers && p.viewers == viewers) return &p;
  return nullptr;
}

std::string table(const VolumeReport& r, bool simulated) {
  std::set<int> samplers, viewers;
  for (const auto& p : r.points)
    if (p.simulated == simulated) samplers.insert(p.samplers), viewers.insert(p.viewers);
  if (samplers.empty()) return {};
  std::string out = "| views a second |", rule = "|---|";
  for (const int s : samplers) out += fmt::format(" {} sampler{} |", s, s == 1 ? "" : "s"), rule += "---|";
  out += " sampling | packing | construction | a frame, to a viewer |\n" + rule + "---|---|---|---|\n";
  for (const int v : viewers) {
    out += fmt::format("| {} viewer{} |", v, v == 1 ? "" : "s");
    std::string sampling, packing, construction, bytes;
    for (const int s : samplers) {
      const VolumePoint* p = find(r, simulated, s, v);
      out += p ? fmt::format(" {:.1f} |", p->fps) : " - |";
      if (!p) continue;
      const char* between = sampling.empty() ? "" : " / ";
      sampling += fmt::format("{}{:.0f}", between, p->sampling_ms);
      packing += fmt::format("{}{:.1f}", between, p->packing_ms);
      construction += fmt::format("{}{:.1f}", between, p->construction_ms);
      bytes += fmt::format("{}{:.0f}", between, p->bytes_per_frame / 1e3);
    }
    out += fmt::format(" {} ms | {} ms | {} ms | {} kB |\n", sampling, packing, construction, bytes);
  }
  return out;
}

std::string thesis_table(VolumeTable of) {
  const Rates& values = values_of(of);
  std::string out = "| views a second |", rule = "|---|";
  for (size_t s = 1; s <= values.front().size(); ++s)
    out += fmt::format(" {} server{} |", s, s == 1 ? "" : "s"), rule += "---|";
  out += "\n" + rule + "\n";
  for (size_t v = 0; v < values.size(); ++v) {
    out += fmt::format("| {} client{} |", v + 1, v == 0 ? "" : "s");
    for (const double f : values[v]) out += fmt::format(" {:g} |", f);
    out += "\n";
  }
  return out;
}

}  // namespace

std::optional<double> thesis_fps(VolumeTable table, int servers, int clients) {
  const Rates& values = values_of(table);
  if (clients < 1 || servers < 1 || clients > int(values.size()) || servers > int(values.front().size()))
    return std::nullopt;
  return values[size_t(clients - 1)][size_t(servers - 1)];
}

std::string to_markdown(const VolumeReport& r) {
  std::string out = fmt::format(
      "{}; a wall of {} pixels in all, shared by its viewers side by side; loose coupling with {} buffers; the head "
      "stands still.\n",
      r.volume, r.size, r.buffers);
  if (const auto t = table(r, false); !t.empty())
    out += fmt::format(
        "\n**Computed**: every process is real and computes, samplers with one thread each, all of them on this "
        "machine's {} cores.\n\n{}",
        r.cores, t);
  if (const auto t = table(r, true); !t.empty())
    out += fmt::format(
        "\n**Simulated nodes**: every sampler and every viewer has a processor of its own. Master, data server, packer "
        "and samplers are real "
        "processes on {} cores, and all messages are sent; but a sampler computes each view three times only (the "
        "least CPU time counts), then "
        "waits that long and sends the same images again; and viewers, all in one process, wait for what decoding and "
        "warping "
        "took one thread instead of doing it. The network is this machine's own.\n\n{}",
        r.cores, t);
  out += "\nThe thesis, table 7.3, 256^3 foot, GPU servers:\n\n" + thesis_table(VolumeTable::kFoot) +
         "\nTable 7.4, 512 x 499 x 512 Christmas tree:\n\n" + thesis_table(VolumeTable::kTree);
  return out;
}

Result<std::vector<VolumePoint>> read_points(const std::string& directory) {
  const auto table = tools::CsvTable::read(directory + "/volume.csv", {});
  if (!table) return table.error();
  std::vector<std::vector<double>> columns;
  for (const char* name : {"simulated", "samplers", "viewers", "fps", "least_fps", "sampling_ms", "packing_ms",
                           "construction_ms", "bytes_per_frame"}) {
    const auto column = table->column(name);
    if (!column) return column.error();
    columns.push_back(table->numbers(*column));
  }
  std::vector<VolumePoint> out;
  for (size_t i = 0; i < table->rows(); ++i)
    out.push_back({columns[0][i] != 0, int(columns[1][i]), int(columns[2][i]), columns[3][i], columns[4][i],
                   columns[5][i], columns[6][i], columns[7][i], columns[8][i]});
  return out;
}

Status write_report(const VolumeReport& r, const std::string& directory) {
  std::string csv = "simulated,samplers,viewers,fps,least_fps,sampling_ms,packing_ms,construction_ms,bytes_per_frame\n";
  for (const auto& p : r.points)
    csv += fmt::format("{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.0f}\n", int(p.simulated), p.samplers, p.viewers,
                       p.fps, p.least_fps, p.sampling_ms, p.packing_ms, p.construction_ms, p.bytes_per_frame);
  for (const auto& [name, text] : {std::pair{"/volume.csv", csv}, {"/volume.md", to_markdown(r)}}) {
    std::ofstream out(directory + name);
    out << text;
    out.close();
    if (!out) return Error{directory + name + ": cannot be written"};
  }
  return ok_status();
}

}  // namespace telesplat::launcher
