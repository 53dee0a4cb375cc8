#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "client/viewer/viewer_service.h"

namespace telesplat::viewer {
namespace {

constexpr int kMaxWallSide = 16;

// "AxB" with both in least..most.
std::optional<std::pair<int, int>> parse_pair(const std::string& text, int least, int most) {
  int a = 0, b = 0;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, a);
  const bool cross = first.ec == std::errc() && first.ptr != end && *first.ptr == 'x';
  const auto second = cross ? std::from_chars(first.ptr + 1, end, b) : first;
  if (!cross || second.ec != std::errc() || second.ptr != end || std::min(a, b) < least || std::max(a, b) > most)
    return std::nullopt;
  return std::pair{a, b};
}

void add_switch(CLI::App& app, const char* flag, bool& value, const char* text) {
  app.add_option_function<std::string>(
         flag, [&value](const std::string& v) { value = v == "on"; }, text)
      ->default_str(value ? "on" : "off")
      ->check(CLI::IsMember({"on", "off"}));
}

}  // namespace

Result<std::pair<int, int>> parse_sampling_size(const std::string& text) {
  if (text == "auto") return std::pair{RequestOptions{}.sampling_width, RequestOptions{}.sampling_height};
  return parse_size(text, "--sampling-size");
}

Result<std::pair<int, int>> parse_size(const std::string& text, const char* flag) {
  if (const auto pair = parse_pair(text, 16, geometry::kMaxImageSide)) return *pair;
  return Error{fmt::format("{} {}: not WIDTHxHEIGHT with both in 16..{}", flag, text, geometry::kMaxImageSide)};
}

Result<std::pair<int, int>> parse_wall(const std::string& text) {
  if (const auto pair = parse_pair(text, 1, kMaxWallSide)) return *pair;
  return Error{fmt::format("--wall {}: not COLUMNSxROWS with both in 1..{}", text, kMaxWallSide)};
}

void add_view_flags(CLI::App& app, ViewerOptions& o) {
  auto& d = o.display;
  app.add_option("--size", o.size, "display size in pixels, WxH")->capture_default_str();
  app.add_option("--sampling-size", o.sampling_size,
                 "sampling size in pixels, WxH; auto: from --least-sampling of the display's to all of it, as fine as "
                 "updates of "
                 "--target-latency allow")
      ->capture_default_str();
  app.add_option("--least-sampling", o.requests.min_scale,
                 "--sampling-size auto: sampled pixels a displayed pixel, on each axis, at least")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1.0));
  app.add_option("--target-latency", o.requests.target_latency_s,
                 "seconds from request to complete view update that --sampling-size auto aims at")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 10.0));
  app.add_option("--trajectory", o.trajectory, "orbit, still, or a CSV file t_s,px,py,pz,qw,qx,qy,qz (room space)")
      ->capture_default_str();
  app.add_option("--duration", d.duration_s, "seconds from the first displayed frame; 0: until stopped")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--frames", d.frames, "frames to display; 0: no limit")->capture_default_str();
  app.add_option("--hold", d.hold_s, "the head stands still for the last so many seconds")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--fov", d.fov_deg, "horizontal field of view, degrees")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 170.0));
  app.add_option("--near", d.near_m, "nearest depth seen, metres")->capture_default_str()->check(CLI::Range(1e-5, 1e3));
  app.add_option("--target-fps", d.target_fps, "display rate aimed at; 0: as fast as possible")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1000.0));
  add_switch(app, "--detail-budget", d.detail_budget,
             "on: lower detail where a view takes longer to construct than --target-fps leaves time for");
  app.add_option("--least-detail", d.least_detail, "the budget lowers detail no further than this")
      ->capture_default_str()
      ->check(CLI::Range(0.3, 1.0));
  add_switch(app, "--speed-detail", d.speed_detail, "on: lower detail while the head moves fast");
  app.add_option("--renderer", o.renderer, "auto, cpu or gl")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "cpu", "gl"}));
  app.add_option("--splat", o.splat, "kernel: square, disc, ellipse or ewa")
      ->capture_default_str()
      ->check(CLI::IsMember({"square", "disc", "ellipse", "ewa"}));
  app.add_option("--splat-scale", o.splat_scale, "scale factor of splat sizes; 0: what suits the kernel")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--finish", o.finish, "work per pixel after splatting: on, off, or some of fill,smooth,antialias")
      ->capture_default_str()
      ->check([](const std::string& v) {
        return splat::finish_named(v) ? "" : v + ": not on, off or some of fill,smooth,antialias";
      });
  app.add_option("--shading", o.shading,
                 "lit: head light, directional light, ambient; head: head light; unlit: colours as they are")
      ->capture_default_str()
      ->check(CLI::IsMember(image::kShadingNames));
  app.add_option("--coupling", o.coupling,
                 "async: the display never waits for the server; sync: each frame asks for a view update and waits for "
                 "it; loose: each frame waits for the next update, --buffers of them are asked for ahead")
      ->capture_default_str()
      ->check(CLI::IsMember({"async", "sync", "loose"}));
  app.add_option("--buffers", o.buffers,
                 "--coupling loose: view updates that are on their way or complete and not displayed, at most")
      ->capture_default_str()
      ->check(CLI::Range(uint64_t{1}, wire::kMaxBuffers));
  app.add_option("--update-rate", o.requests.max_rate_hz, "--coupling async: view requests a second at most")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1000.0));
  app.add_option("--epoch-patience", o.epoch_patience_s,
                 "seconds that a changed scene's last picture is kept while the new one is incomplete")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--record-every", d.picture_every, "record every N-th frame as a PNG; 0: one every 2.5 s and the last")
      ->capture_default_str();
  app.add_option("--record-points", o.record_points_mb,
                 "keep the point model's events in OUT/points.events for telesplat compare, MiB at most; 0: do not")
      ->capture_default_str()
      ->check(CLI::Range(0, 1 << 20));
  app.add_flag("--exr", d.exr, "record pictures as EXR with depth too");
  app.add_option("--verify", d.verify_every, "compare every N-th frame with direct rendering after the run; 0: none")
      ->capture_default_str();
}

void add_flags(CLI::App& app, ViewerOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kConnects);
  add_view_flags(app, o);
  app.add_option("--threads", o.threads, "threads to draw with; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--started-at", o.started_s,
                 "monotonic clock when the session was started, for start-up times; 0: now")
      ->capture_default_str();
  app.add_option("--wall", o.wall,
                 "COLUMNSxROWS: this display is a tile of a wall; --fov is the wall's, --size the tile's");
  app.add_option("--wall-tile", o.wall_tile, "which tile, counted by rows from the upper left, from 0")
      ->capture_default_str();
  app.add_option("--clock-from", o.display.clock_from_s,
                 "monotonic clock when the head's movement and --duration begin, for several viewers that follow one "
                 "head; 0: with the first displayed frame")
      ->capture_default_str();
  app.add_option("--out", o.out, "run folder for pictures and frames to verify");
  app.add_flag("--end-session", o.end_session, "when this viewer is done, the session is over for everyone");
  app.add_flag("--window", o.window, "show a window; the person at it moves the camera");
  app.add_flag("--fullscreen", o.fullscreen, "the window fills the screen");
}

}  // namespace telesplat::viewer
