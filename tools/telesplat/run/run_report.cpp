#include "tools/telesplat/run/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "tools/telesplat/scene/recorded_julia.h"
#include "tools/telesplat/scene/recorded_volume.h"

namespace telesplat::launcher {
namespace {

std::string plural(int n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

std::string subject_of(const std::string& directory, const nlohmann::json& s) {
  std::string out = s["scene"].get<std::string>();
  if (s["kind"] == "mesh") return out + fmt::format(": {} triangles", s["primitives"].get<uint64_t>());
  if (s["kind"] == "volume") {
    if (const auto volume = read_recorded_volume(directory))
      out += fmt::format(": {} epoch(s)", std::max<size_t>(1, volume->epochs.size()));
    return out;
  }
  if (const auto julia = read_recorded_julia(directory)) {
    const auto& c = julia->begin.c;
    out += fmt::format(": c = ({:.4g}, {:.4g}, {:.4g}, {:.4g}), {} epoch(s)", c.x, c.y, c.z, c.w,
                       std::max<size_t>(1, julia->epochs.size()));
  }
  return out;
}

}  // namespace

std::string LiveFigures::update(const nlohmann::json& status, double now_s) {
  double updates = 0, points = 0, bytes = 0, frames = 0;
  int samplers = 0, viewers = 0;
  for (const auto& p : status["processes"]) {
    const auto value = [&](const char* key) {
      return p.contains("values") && p["values"].contains(key) ? p["values"][key].get<double>() : 0.0;
    };
    if (p["role"] == "sampler" && p["alive"] == true) ++samplers;
    if (p["role"] != "viewer") continue;
    viewers += p["alive"] == true;
    updates += value("updates");
    frames += value("frames");
    points = std::max(points, value("points"));
    bytes += value("bytes_received");
  }
  const double dt = now_s - last_s_;
  if (last_s_ > 0 && dt > 0.5 && frames > 0 && viewers > 0) {
    text_ = fmt::format("{:5.1f} fps  {:4.1f} updates/s  ", (frames - frames_) / dt / viewers,
                        (updates - updates_) / dt / viewers);
    if (points > 0) text_ += fmt::format("{:5.2f} M points  ", points / 1e6);
    text_ += fmt::format("{:5.2f} MB/s  {}", (bytes - bytes_) / 1e6 / dt, plural(samplers, "sampler"));
    if (viewers > 1) text_ += fmt::format(", each of {}", plural(viewers, "viewer"));
  }
  if (dt > 0.5) last_s_ = now_s, updates_ = updates, bytes_ = bytes, frames_ = frames;
  return text_;
}

void print_report(const std::string& directory) {
  std::ifstream in(directory + "/summary.json");
  const auto s = nlohmann::json::parse(in, nullptr, false);
  if (!s.is_object()) return;
  const auto line = [](const std::string& what, const std::string& value) {
    std::printf("  %-34s %s\n", what.c_str(), value.c_str());
  };
  const auto dist = [&](const char* key, const char* unit) {
    const auto& d = s[key];
    return fmt::format("median {:.1f}  p95 {:.1f}  max {:.1f} {}", d["median"].get<double>(), d["p95"].get<double>(),
                       d["max"].get<double>(), unit);
  };
  const std::string subject = subject_of(directory, s);
  const bool volume = s["kind"] == "volume";
  std::string head =
      fmt::format("{}, display {}x{}, sampling {}x{}, {}, {} renderer", subject, s["size"][0].get<int>(),
                  s["size"][1].get<int>(), s["sampling_size"][0].get<int>(), s["sampling_size"][1].get<int>(),
                  plural(s["samplers"].get<int>(), "sampler"), s["renderer"].get<std::string>());
  if (!volume) head += ", " + s["splat"].get<std::string>() + " splats";
  if (const int viewers = s["viewers"].get<int>(); viewers > 1)
    head += fmt::format(", {} (figures of all)", plural(viewers, "viewer"));
  std::printf("\n%s\n", head.c_str());
  const std::string coupling = s["coupling"].get<std::string>();
  line("display",
       fmt::format("{:.1f} fps over {} frames, {} coupling{}", s["fps"].get<double>(), s["frames"].get<uint64_t>(),
                   coupling, coupling == "loose" ? fmt::format(" of {} buffers", s["buffers"].get<int>()) : ""));
  line("inter-frame delay", dist("inter_frame_delay_ms", "ms"));
  line("view construction", dist("view_construction_ms", "ms"));
  line("view updates",
       fmt::format("{:.2f} per second, {} in all", s["updates_per_s"].get<double>(), s["updates"].get<uint64_t>()));
  line("view update latency", dist("view_update_latency_ms", "ms"));
  line("sampling / packing of a frame",
       fmt::format("median {:.1f} / {:.1f} ms", s["sampling_ms"]["median"].get<double>(),
                   s["packing_ms"]["median"].get<double>()));
  if (!volume) {
    line("points cached", fmt::format("{:.2f} M, {:.1f} bytes each", s["points_cached"].get<double>() / 1e6,
                                      s["bytes_per_cached_point"].get<double>()));
    line("redundancy eliminated", fmt::format("{:.2f} %", s["redundancy_eliminated"].get<double>() * 100));
  }
  line("sent to viewers",
       fmt::format("{:.2f} MB of {:.0f} MB sampled ({:.0f} : 1), {:.2f} MB/s", s["bytes_sent"].get<double>() / 1e6,
                   s["bytes_raw"].get<double>() / 1e6, s["compression_ratio"].get<double>(),
                   s["data_transfer_rate_mb_s"].get<double>()));
  if (s["quality"].is_object()) {
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
  const auto& e = s["errors"];
  line("errors", fmt::format("{} messages rejected, {} gaps resynchronised, {} leases expired",
                             e["messages_rejected"].get<uint64_t>(), e["gaps_resynced"].get<uint64_t>(),
                             e["leases_expired"].get<uint64_t>()));
  std::printf("\nEverything lies in %s (summary.json, frames.csv, updates.csv, tiles.csv, trace.json, images/)\n",
              directory.c_str());
}

}  // namespace telesplat::launcher
