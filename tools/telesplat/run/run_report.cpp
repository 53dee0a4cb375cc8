#include "tools/telesplat/run/run_report.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

using nlohmann::json;

constexpr const char* kNotMeasured = "not measured";

std::string plural(int n, const char* what) { return fmt::format("{} {}{}", n, what, n == 1 ? "" : "s"); }

// Throws as json::at does where a figure is not there at all; null: it was not measured.
std::string number(const json& value, const char* format, double factor = 1) {
  return value.is_null() ? "?" : fmt::format(fmt::runtime(format), value.get<double>() * factor);
}

std::string distribution(const json& s, const char* key, const char* unit) {
  const json& d = s.at(key);
  if (d.is_null() || d.at("median").is_null()) return kNotMeasured;
  return fmt::format("median {}  p95 {}  max {} {}", number(d.at("median"), "{:.1f}"), number(d.at("p95"), "{:.1f}"),
                     number(d.at("max"), "{:.1f}"), unit);
}

// The median of a distribution that may not be there.
std::string median(const json& s, const char* key, const char* format, double factor = 1) {
  const json& d = s.at(key);
  return d.is_null() ? "?" : number(d.at("median"), format, factor);
}

std::string subject_of(const std::string& directory, const json& s) {
  const std::string name = s.at("scene").get<std::string>();
  const auto scene = recorded_scene(directory);
  return scene ? name + (*scene)->summary(s.at("primitives").get<uint64_t>()) : name;
}

// Whether the run was drawn from points, so that there are splats and points cached.
bool has_points(const json& s) {
  const auto kind = scene::kind_named(s.at("kind").get<std::string>());
  return !kind || scene::pipeline_of(*kind) == scene::Pipeline::kPoints;
}

std::string head_of(const std::string& directory, const json& s) {
  const json &size = s.at("size"), &sampling = s.at("sampling_size");
  std::string head =
      fmt::format("{}, display {}x{}, sampling {}x{}, {}, {} renderer", subject_of(directory, s), size.at(0).get<int>(),
                  size.at(1).get<int>(), sampling.at(0).get<int>(), sampling.at(1).get<int>(),
                  plural(s.at("samplers").get<int>(), "sampler"), s.at("renderer").get<std::string>());
  if (has_points(s)) head += ", " + s.at("splat").get<std::string>() + " splats";
  if (const int viewers = s.at("viewers").get<int>(); viewers > 1)
    head += fmt::format(", {} (figures of all)", plural(viewers, "viewer"));
  return head;
}

void add_display(const json& s, RunReport& out) {
  const std::string coupling = s.at("coupling").get<std::string>();
  out.line(
      "display",
      fmt::format("{} fps over {} frames, {} coupling{}", number(s.at("fps"), "{:.1f}"), s.at("frames").get<uint64_t>(),
                  coupling, coupling == "loose" ? fmt::format(" of {} buffers", s.at("buffers").get<int>()) : ""));
  out.line("inter-frame delay", distribution(s, "inter_frame_delay_ms", "ms"));
  out.line("view construction", distribution(s, "view_construction_ms", "ms"));
}

void add_updates(const json& s, RunReport& out) {
  out.line("view updates", fmt::format("{} per second, {} in all", number(s.at("updates_per_s"), "{:.2f}"),
                                       s.at("updates").get<uint64_t>()));
  out.line("view update latency", distribution(s, "view_update_latency_ms", "ms"));
  out.line("sampling / packing of a frame",
           fmt::format("median {} / {} ms", median(s, "sampling_ms", "{:.1f}"), median(s, "packing_ms", "{:.1f}")));
  if (has_points(s)) {
    out.line("points cached", fmt::format("{} M, {} bytes each", number(s.at("points_cached"), "{:.2f}", 1e-6),
                                          number(s.at("bytes_per_cached_point"), "{:.1f}")));
    out.line("redundancy eliminated", number(s.at("redundancy_eliminated"), "{:.2f} %", 100));
  }
  out.line("sent to viewers",
           fmt::format("{} MB of {} MB sampled ({} : 1), {} MB/s", number(s.at("bytes_sent"), "{:.2f}", 1e-6),
                       number(s.at("bytes_raw"), "{:.0f}", 1e-6), number(s.at("compression_ratio"), "{:.0f}"),
                       number(s.at("data_transfer_rate_mb_s"), "{:.2f}")));
}

void add_quality(const json& s, RunReport& out) {
  const json& q = s.at("quality");
  if (!q.is_object()) return;
  out.line("PSNR against direct rendering",
           fmt::format("median {} dB over {} views", median(q, "psnr_db", "{:.2f}"), q.at("views").get<int>()));
  out.line("SSIM", fmt::format("median {}", median(q, "ssim", "{:.4f}")));
  const json& holes = q.at("hole_fraction");
  out.line("hole fraction", fmt::format("median {} %  p95 {} %", median(q, "hole_fraction", "{:.3f}", 100),
                                        holes.is_null() ? "?" : number(holes.at("p95"), "{:.3f}", 100)));
  if (q.contains("last_view"))
    out.line("last view", fmt::format("PSNR {} dB, holes {} %", number(q.at("last_view").at("psnr_db"), "{:.2f}"),
                                      number(q.at("last_view").at("hole_fraction"), "{:.3f}", 100)));
}

void add_errors(const json& s, RunReport& out) {
  const auto& e = s.at("errors");
  out.line("errors", fmt::format("{} messages rejected, {} gaps resynchronised, {} leases expired",
                                 e.at("messages_rejected").get<uint64_t>(), e.at("gaps_resynced").get<uint64_t>(),
                                 e.at("leases_expired").get<uint64_t>()));
}

}  // namespace

Result<RunReport> read_report(const std::string& directory) {
  const std::string path = directory + "/summary.json";
  std::ifstream in(path);
  if (!in) return Error{fmt::format("{}: is not there, so {} is no finished run", path, directory)};
  const auto s = json::parse(in, nullptr, false);
  if (!s.is_object()) return Error{fmt::format("{}: is no JSON object", path)};
  RunReport out;
  try {
    out.head = head_of(directory, s);
    add_display(s, out);
    add_updates(s, out);
    add_quality(s, out);
    add_errors(s, out);
  } catch (const json::exception& e) {
    return Error{fmt::format("{}: {}", path, e.what())};
  }
  return out;
}

void print_report(const std::string& directory) {
  const auto report = read_report(directory);
  if (!report) return;
  std::printf("\n%s\n", report->head.c_str());
  for (const auto& [what, value] : report->lines) std::printf("  %-34s %s\n", what.c_str(), value.c_str());
  std::printf("\nEverything lies in %s (summary.json, frames.csv, updates.csv, tiles.csv, trace.json, images/)\n",
              directory.c_str());
}

}  // namespace telesplat::launcher
