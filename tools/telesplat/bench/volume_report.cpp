#include "tools/telesplat/bench/volume_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <set>

namespace telesplat::launcher {
namespace {

// Rows: 1 to 4 clients; columns: 1 to 4 servers.
constexpr std::array<std::array<double, 4>, 4> kFoot{
    {{27, 25, 21, 18}, {27, 25, 20, 17}, {27, 24, 20, 17}, {26, 23, 18, 15}}};
constexpr std::array<std::array<double, 4>, 4> kTree{
    {{4.2, 6.8, 9.3, 12.3}, {4.2, 6.7, 9.3, 12.3}, {3.4, 6.2, 9.2, 12.1}, {3.2, 5.6, 8.7, 11.8}}};

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

std::string thesis_table(const std::array<std::array<double, 4>, 4>& values) {
  std::string out = "| views a second | 1 server | 2 servers | 3 servers | 4 servers |\n|---|---|---|---|---|\n";
  for (size_t v = 0; v < values.size(); ++v) {
    out += fmt::format("| {} client{} |", v + 1, v == 0 ? "" : "s");
    for (const double f : values[v]) out += fmt::format(" {:g} |", f);
    out += "\n";
  }
  return out;
}

}  // namespace

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
  out += "\nThe thesis, table 7.3, 256^3 foot, GPU servers:\n\n" + thesis_table(kFoot) +
         "\nTable 7.4, 512 x 499 x 512 Christmas tree:\n\n" + thesis_table(kTree);
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
