#include "tools/telesplat/bench/steering/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "common/metrics/statistics.h"

namespace telesplat::launcher {
namespace {

constexpr const char* kRays = "rays.";  // classes, among the figures

// Over the views or comparisons for which `counts` holds.
template <class T>
std::vector<double> values(const std::vector<T>& rows, auto counts, auto value) {
  std::vector<double> out;
  for (const T& row : rows)
    if (counts(row)) out.push_back(double(value(row)));
  return out;
}

double median(std::vector<double> v) { return metrics::distribution(std::move(v)).median; }
double mean(std::vector<double> v) { return metrics::distribution(std::move(v)).mean; }

bool moves(const ViewCost& v) { return !v.still; }
bool moved(const ViewQuality& q) { return q.still_s < 0; }

struct Sums {
  double rays = 0, extra = 0, full = 0, bytes = 0, sample_ms = 0, mask_bytes = 0, kept = 0, samples = 0;
  double needed = 0, missed = 0, vain = 0;
};
Sums sums(const ModeReport& r, bool still) {
  Sums out;
  for (const ViewCost& v : r.views) {
    if (v.still != still) continue;
    out.rays += double(v.rays), out.extra += double(v.extra_rays), out.full += double(v.rays_full);
    out.bytes += double(v.bytes), out.mask_bytes += double(v.mask_bytes);
    out.sample_ms += v.sample_cpu_ms + v.encode_cpu_ms + v.extra_sample_cpu_ms;
    out.kept += double(v.kept), out.samples += double(v.samples);
    out.needed += double(v.needed), out.missed += double(v.missed), out.vain += double(v.vain);
  }
  return out;
}

std::string share(double part, double whole) { return whole > 0 ? fmt::format("{:.3f}", part / whole) : "-"; }

const ModeReport& first_of_scene(const std::vector<ModeReport>& reports, const ModeReport& r) {
  return *std::find_if(reports.begin(), reports.end(), [&](const ModeReport& o) { return o.scene == r.scene; });
}

// Views a second while the head moves.
double rate(const ModeReport& r) {
  const auto times = values(r.views, moves, [](auto& v) { return v.complete_s; });
  return times.size() > 1 && times.back() > times.front() ? double(times.size() - 1) / (times.back() - times.front())
                                                          : 0;
}

std::string cost_rows(const std::vector<ModeReport>& reports) {
  std::string out =
      "A head that moves. Rays are over full frames; bytes and processor time are too, and over those of the scene's "
      "first row. Times are medians.\n\n"
      "| scene | steering | rays of views | of extra frames | bytes to packer | sampler time | masks, kB a view | "
      "plan, ms | settling, ms | latency, ms | views/s | points, M "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& r : reports) {
    const Sums s = sums(r, false), base = sums(first_of_scene(reports, r), false);
    const auto cost = [&](auto value) { return median(values(r.views, moves, value)); };
    const double points = r.views.empty() ? 0.0 : double(r.views.back().points);
    out += fmt::format(
        "| {} | {} | {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.0f} | {:.1f} | {:.2f} |\n", r.scene, r.mode,
        share(s.rays, s.full), share(s.extra, s.full), share(s.bytes * base.full, base.bytes * s.full),
        share(s.sample_ms * base.full, base.sample_ms * s.full),
        1e-3 * mean(values(r.views, moves, [](auto& v) { return v.mask_bytes; })),
        cost([](auto& v) { return v.plan_ms; }), mean(values(r.views, moves, [](auto& v) { return v.settle_cpu_ms; })),
        cost([](auto& v) { return (v.complete_s - v.requested_s) * 1e3; }), rate(r), points * 1e-6);
  }
  return out;
}

std::string quality_rows(const std::vector<ModeReport>& reports) {
  std::string out =
      "\nIts pictures, beside one ray a pixel and beside the reference: medians, of holes means.\n\n"
      "| scene | steering | one ray: PSNR, dB | holes, % | reference: PSNR, dB | worst 5 %, dB | holes, % | SSIM | "
      "FLIP "
      "|\n|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& r : reports) {
    const auto of = [&](auto value) { return values(r.quality, moved, value); };
    if (std::none_of(r.quality.begin(), r.quality.end(), moved)) continue;  // a short walk
    const auto worst = metrics::distribution(of([](auto& q) { return -q.psnr_db; }));
    out += fmt::format("| {} | {} | {:.2f} | {:.3f} | {:.2f} | {:.2f} | {:.3f} | {:.4f} | {:.4f} |\n", r.scene, r.mode,
                       median(of([](auto& q) { return q.psnr1_db; })), 100 * mean(of([](auto& q) { return q.holes1; })),
                       median(of([](auto& q) { return q.psnr_db; })), -worst.p95,
                       100 * mean(of([](auto& q) { return q.holes; })), median(of([](auto& q) { return q.ssim; })),
                       median(of([](auto& q) { return q.flip; })));
  }
  return out;
}

// Shares of full frames, by class.
std::string class_rows(const std::vector<ModeReport>& reports) {
  std::set<std::string> classes;
  for (const auto& r : reports)
    for (const auto& v : r.views)
      for (const auto& [name, value] : v.figures)
        if (name.starts_with(kRays)) classes.insert(name);
  if (classes.empty()) return {};
  std::string out = "\nRays by class, per cent of full frames while the head moves:\n\n| scene | steering |",
              rule = "|---|---|";
  for (const auto& c : classes) out += fmt::format(" {} |", c.substr(5)), rule += "---|";
  out += " missed of needed | in vain of cast |\n" + rule + "---|---|\n";
  for (const auto& r : reports) {
    const Sums s = sums(r, false);
    out += fmt::format("| {} | {} |", r.scene, r.mode);
    for (const auto& c : classes) {
      double sum = 0;
      for (const auto& v : r.views)
        if (const auto found = v.figures.find(c); moves(v) && found != v.figures.end()) sum += found->second;
      out += s.full > 0 ? fmt::format(" {:.2f} |", 100 * sum / s.full) : std::string(" - |");
    }
    out += fmt::format(" {} | {} |\n", share(s.missed, s.needed), share(s.vain, s.rays));
  }
  return out;
}

std::string still_rows(const std::vector<ModeReport>& reports) {
  std::set<double> times;
  for (const auto& r : reports)
    for (const auto& q : r.quality)
      if (q.still_s >= 0) times.insert(q.still_s);
  if (times.empty()) return {};
  std::string out = "\nA head that stands still: PSNR in dB and holes in per cent, so long after it came to rest:\n\n";
  out += "| scene | steering |";
  std::string rule = "|---|---|";
  for (const double t : times) out += fmt::format(" {:.1f} s |", t), rule += "---|";
  out += " rays, in full frames | bytes, MB | last second: rays |\n" + rule + "---|---|---|\n";
  for (const auto& r : reports) {
    const Sums s = sums(r, true);
    out += fmt::format("| {} | {} |", r.scene, r.mode);
    for (const double t : times)
      for (const auto& q : r.quality)
        if (q.still_s == t) out += fmt::format(" {:.2f}, {:.3f} |", q.psnr_db, 100 * q.holes);
    const double end_s = r.views.empty() ? 0 : r.views.back().t_s;
    double last = 0, full = 1;
    for (const auto& v : r.views) {
      full = std::max(full, double(v.rays_full));
      if (v.t_s > end_s - 1) last += double(v.rays + v.extra_rays);
    }
    out += fmt::format(" {:.2f} | {:.2f} | {:.0f} |\n", (s.rays + s.extra) / full, s.bytes * 1e-6, last);
  }
  return out;
}

std::string views_csv(const std::vector<ModeReport>& reports) {
  std::set<std::string> names;
  for (const auto& r : reports)
    for (const auto& v : r.views)
      for (const auto& [name, value] : v.figures) names.insert(name);
  std::string out =
      "scene,steering,t_s,requested_s,complete_s,still,full,rays_full,rays,extra_rays,extra_frames,bytes,mask_bytes,"
      "samples,kept,sent_bytes,plan_ms,extra_plan_ms,extra_sample_cpu_ms,sample_cpu_ms,encode_cpu_ms,pack_cpu_ms,"
      "insert_cpu_ms,settle_cpu_ms,points,needed,missed,vain";
  for (const auto& name : names) out += "," + name;
  out += "\n";
  for (const auto& r : reports)
    for (const auto& v : r.views) {
      out += fmt::format(
          "{},{},{:.3f},{:.3f},{:.3f},{},{},{},{},{},{},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},"
          "{:.3f},{:.3f},{:.3f},{}",
          r.scene, r.mode, v.t_s, v.requested_s, v.complete_s, int(v.still), int(v.full), v.rays_full, v.rays,
          v.extra_rays, v.extra_frames, v.bytes, v.mask_bytes, v.samples, v.kept, v.sent_bytes, v.plan_ms,
          v.extra_plan_ms, v.extra_sample_cpu_ms, v.sample_cpu_ms, v.encode_cpu_ms, v.pack_cpu_ms, v.insert_cpu_ms,
          v.settle_cpu_ms, v.points);
      out += fmt::format(",{},{},{}", v.needed, v.missed, v.vain);
      for (const auto& name : names) {
        const auto found = v.figures.find(name);
        out += found == v.figures.end() ? std::string(",") : fmt::format(",{:g}", found->second);
      }
      out += "\n";
    }
  return out;
}

std::string quality_csv(const std::vector<ModeReport>& reports) {
  std::string out = "scene,steering,t_s,still_s,psnr1_db,holes1,psnr_db,holes,ssim,flip\n";
  for (const auto& r : reports)
    for (const auto& q : r.quality)
      out += fmt::format("{},{},{:.3f},{},{:.3f},{:.6f},{:.3f},{:.6f},{:.5f},{:.5f}\n", r.scene, r.mode, q.t_s,
                         q.still_s < 0 ? std::string() : fmt::format("{:.3f}", q.still_s), q.psnr1_db, q.holes1,
                         q.psnr_db, q.holes, q.ssim, q.flip);
  return out;
}

}  // namespace

void ViewCost::add_extra(const ViewCost& extra) {
  ++extra_frames;
  extra_rays += extra.rays;
  bytes += extra.bytes, mask_bytes += extra.mask_bytes, sent_bytes += extra.sent_bytes;
  samples += extra.samples, kept += extra.kept;
  extra_plan_ms += extra.plan_ms;
  extra_sample_cpu_ms += extra.sample_cpu_ms + extra.encode_cpu_ms;
  settle_cpu_ms += extra.settle_cpu_ms;
  points = extra.points;
  for (const auto& [name, value] : extra.figures) figures[name] += value;
}

std::string to_markdown(const std::vector<ModeReport>& reports) {
  return cost_rows(reports) + quality_rows(reports) + class_rows(reports) + still_rows(reports);
}

Status write_report(const std::vector<ModeReport>& reports, const std::string& directory) {
  for (const auto& [name, text] : {std::pair{"/steering-views.csv", views_csv(reports)},
                                   {"/steering-quality.csv", quality_csv(reports)},
                                   {"/steering-table.txt", to_markdown(reports)}}) {
    std::ofstream out(directory + name);
    out << text;
    out.close();
    if (!out) return Error{directory + name + ": cannot be written"};
  }
  return ok_status();
}

}  // namespace telesplat::launcher
