#include "tools/telesplat/run/process_arguments.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

std::string text(double v) { return fmt::format("{}", v); }

}  // namespace

std::vector<std::string> master_arguments(const RunOptions& o) {
  const auto& s = o.master.master.schedule;
  std::vector<std::string> a{"--name",
                             "master",
                             "--bind",
                             "tcp://127.0.0.1:*",
                             "--tile-size",
                             text(s.tile_size),
                             "--frames-in-flight",
                             text(s.frames_in_flight),
                             "--lease-timeout",
                             text(s.lease_timeout_s),
                             "--lease-target",
                             text(s.lease_target_s),
                             "--progressive",
                             master::name_of(o.master.master.progressive),
                             "--octree-depth",
                             text(double(o.master.master.octree_depth)),
                             "--log-level",
                             o.master.service.log_level};
  if (!o.out.empty()) a.insert(a.end(), {"--out", o.out});
  for (const auto& [key, value] : o.master.master.settings) {
    if (key == "packing.keep_redundant")
      a.insert(a.end(), {"--packing.redundancy", value < 0 ? "auto" : value != 0 ? "keep" : "eliminate"});
    else
      a.insert(a.end(), {"--" + key, text(value)});
  }
  return a;
}

std::vector<std::string> data_arguments(const RunOptions& o, int part) {
  std::vector<std::string> a{o.scene, "--room-size", text(o.mesh.room_size_m), "--up=" + o.mesh.up,
                             "--report-progress"};
  if (o.shows_julia()) {
    const auto flags = julia::to_flags(o.julia);
    a.insert(a.end(), flags.begin(), flags.end());
  }
  if (o.kind == SceneKind::kMesh) {
    if (o.mesh.iso) a.push_back(fmt::format("--iso={}", *o.mesh.iso));
    if (!o.mesh.raw.empty()) a.push_back("--raw=" + o.mesh.raw);
    if (o.mesh.elevation.z_scale != 0) a.push_back(fmt::format("--z-scale={}", o.mesh.elevation.z_scale));
    if (!o.mesh.elevation.texture.empty()) a.push_back("--texture=" + o.mesh.elevation.texture);
  }
  if (o.kind == SceneKind::kVolume) {
    for (const auto& [flag, value] :
         {std::pair{"--raw", o.volume.raw}, {"--tf", o.volume.transfer}, {"--series-rate", o.series_rate}})
      if (!value.empty()) a.push_back(fmt::format("{}={}", flag, value));
    a.insert(a.end(), {"--lighting", o.volume.lit ? "on" : "off"});
    if (o.data_servers > 1) a.insert(a.end(), {"--part", fmt::format("{}/{}", part, o.data_servers)});
  }
  if (!o.mesh.cache_dir.empty()) a.insert(a.end(), {"--cache", o.mesh.cache_dir});
  if (!o.mesh.use_cache) a.push_back("--no-cache");
  return a;
}

std::vector<std::string> packer_arguments(const RunOptions& o) {
  if (!o.record_depth) return {};
  return {"--record-depth", o.out + "/depth"};
}

std::vector<std::string> sampler_arguments(const RunOptions& o) {
  const int cores = int(std::max(1u, std::thread::hardware_concurrency()));
  const int threads = o.sampler_threads ? o.sampler_threads : std::max(1, cores / o.samplers);
  return {"--sampler", o.sampler_kind, "--threads", std::to_string(threads)};
}
std::vector<std::string> viewer_arguments(const RunOptions& o, int number, double clock_from_s) {
  const auto& v = o.viewer;
  const auto& d = v.display;
  std::vector<std::string> a{"--size",
                             v.size,
                             "--sampling-size",
                             v.sampling_size,
                             "--least-sampling",
                             text(v.least_sampling.value_or(v.requests.min_scale)),
                             "--trajectory",
                             v.trajectory,
                             "--duration",
                             text(d.duration_s),
                             "--frames",
                             text(double(d.frames)),
                             "--hold",
                             text(d.hold_s),
                             "--fov",
                             text(d.fov_deg),
                             "--near",
                             text(d.near_m),
                             "--target-fps",
                             text(d.target_fps),
                             "--detail-budget",
                             d.detail_budget ? "on" : "off",
                             "--least-detail",
                             text(d.least_detail),
                             "--target-latency",
                             text(v.requests.target_latency_s),
                             "--speed-detail",
                             d.speed_detail ? "on" : "off",
                             "--renderer",
                             v.renderer,
                             "--splat",
                             v.splat,
                             "--splat-scale",
                             text(v.splat_scale),
                             "--finish",
                             v.finish,
                             "--shading",
                             v.shading,
                             "--coupling",
                             v.coupling,
                             "--buffers",
                             text(v.buffers),
                             "--update-rate",
                             text(v.requests.max_rate_hz),
                             "--epoch-patience",
                             text(v.epoch_patience_s),
                             "--record-every",
                             text(double(d.picture_every)),
                             "--verify",
                             text(number == 1 ? double(d.verify_every) : 0.0),
                             "--record-points",
                             text(double(v.record_points_mb)),
                             "--started-at",
                             text(o.started_s)};
  if (!o.out.empty()) a.insert(a.end(), {"--out", viewer_directory(o.out, number)});
  if (!o.wall.empty()) a.insert(a.end(), {"--wall", o.wall, "--wall-tile", std::to_string(number - 1)});
  if (clock_from_s > 0) a.insert(a.end(), {"--clock-from", text(clock_from_s)});
  for (const auto& [set, flag] : {std::pair{d.exr, "--exr"}, {v.window, "--window"}, {v.fullscreen, "--fullscreen"}})
    if (set) a.push_back(flag);
  return a;
}

}  // namespace telesplat::launcher
