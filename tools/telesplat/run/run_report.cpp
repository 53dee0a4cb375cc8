#include "tools/telesplat/run/run_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

using nlohmann::json;

std::string plural(int n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

void line(const std::string& what, const std::string& value) {
  std::printf("  %-34s %s\n", what.c_str(), value.c_str());
}

std::string distribution(const json& s, const char* key, const char* unit) {
  const auto& d = s[key];
  return fmt::format("median {:.1f}  p95 {:.1f}  max {:.1f} {}", d["median"].get<double>(), d["p95"].get<double>(),
                     d["max"].get<double>(), unit);
}

std::string subject_of(const std::string& directory, const json& s) {
  const std::string name = s["scene"].get<std::string>();
  const auto scene = recorded_scene(directory);
  return scene ? name + (*scene)->summary(s["primitives"].get<uint64_t>()) : name;
}

// Whether the run was drawn from points, so that there are splats and points cached.
bool has_points(const json& s) {
  const auto kind = scene::kind_named(s["kind"].get<std::string>());
  return !kind || scene::pipeline_of(*kind) == scene::Pipeline::kPoints;
}

void print_head(const std::string& directory, const json& s) {
  std::string head = fmt::format("{}, display {}x{}, sampling {}x{}, {}, {} renderer", subject_of(directory, s),
                                 s["size"][0].get<int>(), s["size"][1].get<int>(), s["sampling_size"][0].get<int>(),
                                 s["sampling_size"][1].get<int>(), plural(s["samplers"].get<int>(), "sampler"),
                                 s["renderer"].get<std::string>());
  if (has_points(s)) head += ", " + s["splat"].get<std::string>() + " splats";
  if (const int viewers = s["viewers"].get<int>(); viewers > 1)
    head += fmt::format(", {} (figures of all)", plural(viewers, "viewer"));
  std::printf("\n%s\n", head.c_str());
}

void print_display(const json& s) {
  const std::string coupling = s["coupling"].get<std::string>();
  line("display",
       fmt::format("{:.1f} fps over {} frames, {} coupling{}", s["fps"].get<double>(), s["frames"].get<uint64_t>(),
                   coupling, coupling == "loose" ? fmt::format(" of {} buffers", s["buffers"].get<int>()) : ""));
  line("inter-frame delay", distribution(s, "inter_frame_delay_ms", "ms"));
  line("view construction", distribution(s, "view_construction_ms", "ms"));
}

void print_updates(const json& s) {
  line("view updates",
       fmt::format("{:.2f} per second, {} in all", s["updates_per_s"].get<double>(), s["updates"].get<uint64_t>()));
  line("view update latency", distribution(s, "view_update_latency_ms", "ms"));
  line("sampling / packing of a frame",
       fmt::format("median {:.1f} / {:.1f} ms", s["sampling_ms"]["median"].get<double>(),
                   s["packing_ms"]["median"].get<double>()));
  if (has_points(s)) {
    line("points cached", fmt::format("{:.2f} M, {:.1f} bytes each", s["points_cached"].get<double>() / 1e6,
                                      s["bytes_per_cached_point"].get<double>()));
    line("redundancy eliminated", fmt::format("{:.2f} %", s["redundancy_eliminated"].get<double>() * 100));
  }
  line("sent to viewers",
       fmt::format("{:.2f} MB of {:.0f} MB sampled ({:.0f} : 1), {:.2f} MB/s", s["bytes_sent"].get<double>() / 1e6,
                   s["bytes_raw"].get<double>() / 1e6, s["compression_ratio"].get<double>(),
                   s["data_transfer_rate_mb_s"].get<double>()));
}

void print_quality(const json& s) {
  if (!s["quality"].is_object()) return;
  const auto& q = s["quality"];
  line("PSNR against direct rendering",
       fmt::format("median {:.2f} dB over {} views", q["psnr_db"]["median"].get<double>(), q["views"].get<int>()));
  line("SSIM", fmt::format("median {:.4f}", q["ssim"]["median"].get<double>()));
  line("hole fraction", fmt::format("median {:.3f} %  p95 {:.3f} %", q["hole_fraction"]["median"].get<double>() * 100,
                                    q["hole_fraction"]["p95"].get<double>() * 100));
  if (q.contains("last_view"))
    line("last view", fmt::format("PSNR {:.2f} dB, holes {:.3f} %", q["last_view"]["psnr_db"].get<double>(),
                                  q["last_view"]["hole_fraction"].get<double>() * 100));
}

void print_errors(const json& s) {
  const auto& e = s["errors"];
  line("errors", fmt::format("{} messages rejected, {} gaps resynchronised, {} leases expired",
                             e["messages_rejected"].get<uint64_t>(), e["gaps_resynced"].get<uint64_t>(),
                             e["leases_expired"].get<uint64_t>()));
}

}  // namespace

void print_report(const std::string& directory) {
  std::ifstream in(directory + "/summary.json");
  const auto s = json::parse(in, nullptr, false);
  if (!s.is_object()) return;
  print_head(directory, s);
  print_display(s);
  print_updates(s);
  print_quality(s);
  print_errors(s);
  std::printf("\nEverything lies in %s (summary.json, frames.csv, updates.csv, tiles.csv, trace.json, images/)\n",
              directory.c_str());
}

}  // namespace telesplat::launcher
