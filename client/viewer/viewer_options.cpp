#include "client/viewer/viewer_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "client/viewer/coupling/coupling.h"
#include "common/image/background.h"
#include "common/splat/kernel_traits.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {
namespace {

constexpr const char* kWhatIsKept = "what a run keeps";
constexpr double kLeastUpdateRate_hz = 0.1, kHeadsetUpdateRate_hz = 10;

using options::Names;
using options::Range;
using options::Reach;
using options::Row;
using options::Table;

const scene::Kinds kPoints = scene::Kinds::of(scene::Pipeline::kPoints);

std::string complain_about_finish(const std::string& text) {
  return splat::finish_named(text) ? "" : "not on, off or some of fill,smooth,antialias";
}

std::string complain_about_still_samples(const std::string& text) {
  return text == "1" || text == "4" || text == "16" ? "" : "not 1, 4 or 16";
}

std::string complain_about_background(const std::string& text) {
  const auto background = image::parse_background(text);
  return background ? "" : background.error().text;
}

Table sampling_table(ViewerOptions& o) {
  return {
      {.flag = "--size", .value = &o.size, .help = "display size in pixels, WxH", .reach = Reach::kRecorded},
      {.flag = "--sampling-size",
       .value = &o.sampling_size,
       .help = "sampling size in pixels, WxH; auto: from --least-sampling of the display's to all of it, as fine as "
               "updates of --target-latency allow (of half of it where sampling is steered)"},
      {.flag = "--least-sampling",
       .value = &o.least_sampling,
       .help = "--sampling-size auto: sampled pixels a displayed pixel, on each axis, at least",
       .limits = Range{0.1, 1.0},
       .default_text = "what the session tells: 0.4 of Julia sets, else 0.5"},
      {.flag = "--target-latency",
       .value = &o.requests.target_latency_s,
       .help = "seconds from request to complete view update that --sampling-size auto aims at; where sampling is "
               "steered it aims at half of it",
       .limits = Range{0.01, 10}},
  };
}

Table head_table(HeadFlags& o, DisplayOptions& d) {
  return {
      {.flag = "--trajectory",
       .value = &o.trajectory,
       .help =
           "orbit: around the data set, all of it in the picture; still; or a CSV file with the columns t_s, px, py, "
           "pz, qw, qx, qy, qz (metres in the room), such as frames.csv of a run. Where it ends the head stands "
           "still",
       .default_text = "orbit; with --eye, and in a window, still",
       .is_file = true},
      {.flag = "--loop", .value = &o.loop, .help = "where the trajectory of a file ends it begins again"},
      {.flag = "--eye",
       .value = &o.eye,
       .help = "where the first view stands, x,y,z in metres in the room, +y up; the data set is centred at 0,0,0. "
               "Without a window the head stays there",
       .limits = options::Check(complain_about_point),
       .default_text = "in front of the data set, all of it in the picture"},
      {.flag = "--look-at",
       .value = &o.look_at,
       .help = "--eye: where it looks, x,y,z",
       .limits = options::Check(complain_about_point),
       .default_text = "the data set's centre"},
      {.flag = "--duration",
       .value = &o.duration_s,
       .help = "seconds from the first displayed frame; 0: until stopped",
       .limits = Range{0, 1e6},
       .default_text = "10; of a file's trajectory its length and --hold; in a window 0"},
      {.flag = "--frames", .value = &d.span.frames, .help = "frames to display; 0: no limit"},
      {.flag = "--hold",
       .value = &d.span.hold_s,
       .help = "the head stands still for the last so many seconds of --duration",
       .limits = Range{0, 1e6},
       .default_text = "0; of a --wall 2"},
      {.flag = "--fov",
       .value = &d.fov_deg,
       .help = "horizontal field of view, degrees",
       .limits = Range{1, 170},
       .reach = Reach::kRecorded},
      {.flag = "--near",
       .value = &d.near_m,
       .help = "nearest depth seen, metres",
       .limits = Range{1e-5, 1e3},
       .reach = Reach::kRecorded},
      {.flag = "--target-fps",
       .value = &d.target_fps,
       .help = "display rate aimed at; 0: as fast as possible",
       .limits = Range{0, 1000}},
  };
}

Table drawing_table(DrawingFlags& o, DisplayOptions& d) {
  return {
      {.flag = "--detail-budget",
       .value = &d.detail.by_budget,
       .help = "on: lower detail, then draw at half the size, where frames take longer than --target-fps allows",
       .fits = kPoints,
       .on_off = true},
      {.flag = "--least-detail",
       .value = &d.detail.least,
       .help = "the budget lowers detail no further than this",
       .limits = Range{0.3, 1},
       .fits = kPoints},
      {.flag = "--speed-detail",
       .value = &d.detail.by_speed,
       .help = "on: lower detail while the head moves fast",
       .fits = kPoints,
       .on_off = true},
      {.flag = "--renderer", .value = &o.renderer, .help = "auto, cpu or gl", .limits = Names{"auto", "cpu", "gl"}},
      {.flag = "--splat",
       .value = &o.splat,
       .help = "kernel: " + splat::kernel_list(),
       .limits = splat::kernel_names(),
       .fits = kPoints},
      {.flag = "--splat-scale",
       .value = &o.splat_scale,
       .help = "scale factor of splat sizes; 0: what suits the kernel",
       .limits = Range{0, 10},
       .fits = kPoints},
      {.flag = "--finish",
       .value = &o.finish,
       .help = "work per pixel after splatting: on, off, or some of fill,smooth,antialias",
       .limits = options::Check(complain_about_finish),
       .fits = kPoints},
      {.flag = "--still-samples",
       .value = &o.still_samples,
       .help = "a head that stands still sees pictures of so many sub-pixels a pixel, 1, 4 or 16, wherever there are "
               "points that fine; not with --finish off, nor with --background transparent",
       .limits = options::Check(complain_about_still_samples),
       .fits = kPoints},
      {.flag = "--background",
       .value = &o.background,
       .help = "behind the data: #rrggbb, a name (white, black, grey, ...), or transparent (pictures have alpha; a "
               "window shows black)",
       .limits = options::Check(complain_about_background),
       .reach = Reach::kRecorded},
      {.flag = "--shading",
       .value = &o.shading,
       .help = "lit: head light, directional light, ambient; head: head light; unlit: colours as they are",
       .limits = Names(image::kShadingNames.begin(), image::kShadingNames.end()),
       .reach = Reach::kRecorded},
      {.flag = "--legend",
       .value = &d.legend,
       .help = "on: pictures and the window show what colours mean: the array that colours a mesh, a volume's transfer "
               "function",
       .reach = Reach::kRecorded,
       .on_off = true},
  };
}

Table coupling_table(CouplingFlags& o) {
  return {
      {.flag = "--coupling",
       .value = &o.mode,
       .help =
           "async: the display never waits for the server; sync: each frame asks for a view update and waits for it; "
           "loose: each frame waits for the next update, --buffers of them are asked for ahead; images: samplers draw "
           "the views, which come as JPEG pictures, as with a remote desktop",
       .limits = Names{"async", "sync", "loose", "images"}},
      {.flag = "--buffers",
       .value = &o.buffers,
       .help = "--coupling loose: view updates that are on their way or complete and not displayed, at most",
       .limits = Range{1, double(wire::kMaxBuffers)}},
      {.flag = "--update-rate",
       .value = &o.update_rate_hz,
       .help =
           "--coupling async, images: view requests a second at most; 0: 20, 10 for a headset, whose frames must be in "
           "time, and of images --target-fps",
       .limits = Range{0, 1000}},
  };
}

Table record_table(RecordOptions& o, KeptOptions& kept) {
  return {
      {.flag = "--record-every",
       .value = &kept.picture_every,
       .help = "record every N-th frame as a PNG; 0: one every 2.5 s and the last",
       .not_in_scene = kWhatIsKept},
      {.flag = "--record-points",
       .value = &o.points_mb,
       .help = "keep what was received in OUT, MiB at most, for telesplat compare and movie: the point model's events "
               "in points.events, a volume's slice images in slices.events; 0: do not",
       .limits = Range{0, 1 << 20},
       .not_in_scene = kWhatIsKept},
      {.flag = "--exr", .value = &kept.exr, .help = "record pictures as EXR with depth too"},
      {.flag = "--verify",
       .value = &kept.verify_every,
       .help = "compare every N-th frame with direct rendering after the run; 0: none"},
      {.flag = "--verify-consecutive",
       .value = &kept.verify_row,
       .help = "compare so many frames in a row each time: flicker, popping and how long holes last are measured from "
               "one frame to the next",
       .limits = Range{1, 1000}},
  };
}

Table process_table(ViewerOptions& o) {
  return {
      {.flag = "--threads",
       .value = &o.drawing.threads,
       .help = "threads to draw with; 0: one a core",
       .limits = Range{0, 1024}},
      {.flag = "--started-at",
       .value = &o.started_s,
       .help = "monotonic clock when the session was started, for start-up times; 0: now"},
      {.flag = "--wall",
       .value = &o.wall.name,
       .help = "this display is a part of a wall: COLUMNSxROWS of tiles, --fov is the wall's, --size the tile's; or "
               "the description of one, NAME.toml"},
      {.flag = "--wall-tile",
       .value = &o.wall.tile,
       .help = "which tile, counted by rows from the upper left, from 0, or which screen of the description"},
      {.flag = "--clock-from",
       .value = &o.display.span.clock_from_s,
       .help =
           "monotonic clock when the head's movement and --duration begin, for several viewers that follow one head; "
           "0: with the first displayed frame"},
      {.flag = "--out",
       .value = &o.record.out,
       .help = "run folder for pictures and what is received; default: the master's, if it is on this machine"},
      {.flag = "!--no-record", .value = &o.record.join, .help = "keep nothing in the master's run folder"},
      {.flag = "--end-session",
       .value = &o.end_session,
       .help = "when this viewer is done, the session is over for everyone"},
      {.flag = "--window", .value = &o.window.shown, .help = "show a window; the person at it moves the camera"},
      {.flag = "--fullscreen", .value = &o.window.fullscreen, .help = "the window fills the screen"},
      {.flag = "--launched",
       .value = &o.window.launched,
       .help = "standard input is the launcher's, which opens the data sets that the person chooses"},
      {.flag = "--begins-empty", .value = &o.window.begins_empty, .help = "--launched: there is no data set yet"},
      {.flag = "--panel",
       .value = &o.window.panel,
       .help = "on: the window begins with its panel, which Tab hides and shows",
       .on_off = true},
  };
}

constexpr double kDuration_s = 10;

Status settle_eye(HeadFlags& o) {
  if (o.eye.empty())
    return o.look_at.empty() ? ok_status() : Status(Error{"--look-at needs --eye, where to look from"});
  if (o.trajectory != "still")
    return Error{fmt::format("--eye {} and --trajectory {}: the head stands at the one or follows the other", o.eye,
                             o.trajectory)};
  for (const auto& [flag, text, point] :
       {std::tuple{"--eye", &o.eye, &o.movement.eye}, {"--look-at", &o.look_at, &o.movement.look_at}}) {
    if (text->empty()) continue;
    const auto parsed = parse_point(*text);
    if (!parsed) return Error{fmt::format("{} {}: {}", flag, *text, parsed.error().text)};
    *point = *parsed;
  }
  if (o.movement.look_at && glm::distance(*o.movement.eye, *o.movement.look_at) < 1e-9)
    return Error{fmt::format("--eye {} --look-at {}: are the same point, so there is no direction to look in", o.eye,
                             o.look_at)};
  return ok_status();
}

// Works out how long the run takes, after its movement is settled.
void settle_duration(ViewerOptions& o) {
  auto& d = o.display;
  const double length_s = o.head.movement.recorded ? o.head.movement.recorded->duration_s() : 0;
  d.span.duration_s = o.head.duration_s.value_or(has_person(o)  ? 0
                                                 : length_s > 0 ? length_s + d.span.hold_s
                                                                : kDuration_s);
  if (d.span.duration_s > 0) d.span.hold_s = std::min(d.span.hold_s, d.span.duration_s);
}

Status settle_wall(ViewerOptions& o) {
  auto wall = wall_tile(o.wall.name, o.wall.tile, o.wall.scale);
  if (!wall) return wall.error();
  o.display.wall = std::move(*wall);
  if (!o.display.wall.described) return ok_status();
  const wall::Wall& all = *o.display.wall.described;
  const wall::Screen& screen = all.screens[size_t(o.wall.tile)];
  if (const auto& panel = o.display.stereo.panel;
      panel && (panel->width != screen.width || panel->height != screen.height))
    return Error{fmt::format("--barrier {}: it is of {} x {} pixels, and screen {} of --wall {} has {} x {}",
                             o.display.stereo.panel_file, panel->width, panel->height, o.wall.tile, o.wall.name,
                             screen.width, screen.height)};
  o.display.width = screen.width, o.display.height = screen.height;
  o.display.stereo.screen_width_m = screen.width_m;
  if (screen.sampling && o.sampling_size == "auto") {
    std::tie(o.requests.sampling_width, o.requests.sampling_height) = *screen.sampling;
    o.requests.adaptive = false;
  }
  if (all.anchor == wall::Anchor::kHead) return ok_status();
  // The head stands before a wall that stands in the room, unless the flags move it.
  if (o.head.trajectory == "orbit")
    return Error{
        fmt::format("--trajectory orbit: --wall {} stands in the room, and the data set would be seen from "
                    "behind it; a file of poses moves the head before it, and anchor = \"head\" takes the "
                    "wall along",
                    o.wall.name)};
  if (o.head.trajectory.empty()) o.head.trajectory = "still";
  return ok_status();
}

// Places a still head before a wall that stands in the room.
void stand_before_wall(ViewerOptions& o) {
  const auto& all = o.display.wall.described;
  if (!all || all->anchor == wall::Anchor::kHead || o.head.trajectory != "still" || !o.head.eye.empty()) return;
  const auto in_room = [&](const glm::dvec3& p) { return all->in_room.position_room + all->in_room.orientation * p; };
  o.head.movement.eye = in_room(all->head);
  o.head.movement.look_at = in_room(all->head - glm::dvec3(0, 0, 1));
}

Status settle_head(ViewerOptions& o) {
  if (const Status s = settle_wall(o); !s) return s;
  if (o.head.trajectory.empty())
    o.head.trajectory = has_person(o) || !o.head.eye.empty() || !o.head.poses.empty() ? "still" : "orbit";
  auto movement = head_movement(o.head.trajectory, o.head.loop);
  if (!movement) return movement.error();
  o.head.movement = std::move(*movement);
  if (const Status s = settle_eye(o.head); !s) return s;
  stand_before_wall(o);
  settle_duration(o);
  return ok_status();
}

// The panel sets the display's pixels, and the field of view of a person before it.
Status settle_stereo(ViewerOptions& o) {
  auto stereo = settle(o.stereo);
  if (!stereo) return stereo.error();
  o.display.stereo = std::move(*stereo);
  if (o.display.stereo.mode == stereo::Mode::kQuadBuffer && !o.window.shown)
    return Error{"--stereo quad-buffer: needs a window; side-by-side has both pictures without one"};
  if (!o.display.stereo.panel) return ok_status();
  const stereo::Panel& panel = *o.display.stereo.panel;
  o.size = fmt::format("{}x{}", panel.width, panel.height);
  o.display.width = panel.width, o.display.height = panel.height;
  o.display.fov_deg = 2 * std::atan(0.5 * panel.width_m() / panel.distance_m) * 180 / 3.14159265358979323846;
  return ok_status();
}

// Turns the names of renderer and look into the display's options.
Status settle_drawing(const DrawingFlags& o, DisplayOptions& d) {
  const auto background = image::parse_background(o.background);
  if (!background) return Error{fmt::format("--background {}: {}", o.background, background.error().text)};
  d.shading = *image::shading_named(o.shading);
  d.shading.background = background->colour;
  d.transparent = background->transparent;
  d.render.kernel = *splat::kernel_named(o.splat);
  d.render.finish = *splat::finish_named(o.finish);
  d.splat_scale = float(o.splat_scale);
  d.still_samples = o.still_samples == "1" ? 1 : o.still_samples == "4" ? 4 : 16;
  return ok_status();
}

// Refuses flags that pictures cannot serve: they are flat, for one display, and have no alpha.
Status check_pictures(const ViewerOptions& o) {
  for (const auto& [given, flag, why] :
       {std::tuple{o.display.stereo.on(), "--stereo", "each picture is one eye's"},
        {o.xr.on, "--xr", "a headset needs frames of its head's pose, and pictures are of an earlier one"},
        {!o.wall.name.empty(), "--wall", "pictures of several displays are not kept in step"},
        {o.drawing.background == "transparent", "--background transparent", "JPEG pictures have no alpha"}})
    if (given) return Error{fmt::format("--coupling images and {}: {}", flag, why)};
  return ok_status();
}

Status settle_coupling(ViewerOptions& o) {
  const auto coupling = coupling_named(o.coupling.mode);
  if (!coupling) return Error{fmt::format("--coupling {}: not async, sync, loose or images", o.coupling.mode)};
  if (*coupling == CouplingMode::kImages)
    if (const Status s = check_pictures(o); !s) return s;
  if (o.coupling.buffers < 1 || uint64_t(o.coupling.buffers) > wire::kMaxBuffers)
    return Error{fmt::format("--buffers {}: not in 1..{}", o.coupling.buffers, wire::kMaxBuffers)};
  o.requests.buffers = uint64_t(buffers_of(*coupling, o.coupling.buffers));
  return ok_status();
}

}  // namespace

Table view_table(ViewerOptions& o) {
  const Table head = joined(head_table(o.head, o.display), head_source_table(o.head));
  const Table looks = joined(drawing_table(o.drawing, o.display), stereo_table(o.stereo));
  const Table seen = joined(joined(sampling_table(o), head), looks);
  return joined(seen, joined(coupling_table(o.coupling), record_table(o.record, o.display.kept)));
}

std::string WallFlags::shared_name() const { return fmt::format("{} x{}", name, scale); }

Table wall_table(WallFlags& o) {
  return {
      {.flag = "--wall-scale",
       .value = &o.scale,
       .help = "--wall NAME.toml: of the screens' pixels so many are drawn, on each axis: to try a wall on one machine",
       .limits = Range{0.01, 1}},
      {.flag = "--swap-barrier",
       .value = &o.swap_barrier,
       .help = "on: the displays of a wall present their frames together, all from one head and of one state of the "
               "data set; off: each by itself",
       .on_off = true},
  };
}

Table table(ViewerOptions& o) {
  const Table own = joined(view_table(o), joined(joined(xr_table(o.xr), process_table(o)), wall_table(o.wall)));
  return joined(net::service_table(o.service, net::Ends::kConnects), own);
}

Result<std::pair<int, int>> parse_sampling_size(const std::string& text) {
  if (text == "auto") return std::pair{RequestOptions{}.sampling_width, RequestOptions{}.sampling_height};
  return parse_size(text, "--sampling-size");
}

Status settle(ViewerOptions& o) {
  const auto size = parse_size(o.size, "--size"), sampling = parse_sampling_size(o.sampling_size);
  if (!size) return size.error();
  if (!sampling) return sampling.error();
  std::tie(o.display.width, o.display.height) = *size;
  std::tie(o.requests.sampling_width, o.requests.sampling_height) = *sampling;
  o.requests.adaptive = o.sampling_size == "auto";
  o.requests.max_rate_hz = o.coupling.update_rate_hz > 0 ? std::max(o.coupling.update_rate_hz, kLeastUpdateRate_hz)
                           : o.xr.on                     ? kHeadsetUpdateRate_hz
                                                         : viewer::RequestOptions{}.max_rate_hz;
  o.requests.picture_rate_hz = o.coupling.update_rate_hz > 0 ? o.requests.max_rate_hz
                               : o.display.target_fps > 0    ? o.display.target_fps
                                                             : RequestOptions{}.picture_rate_hz;
  if (const Status s = settle_stereo(o); !s) return s;
  if (const Status s = settle_head_source(o); !s) return s;
  if (const Status s = settle_head(o); !s) return s;
  if (const Status s = settle_coupling(o); !s) return s;
  if (const Status s = settle_drawing(o.drawing, o.display); !s) return s;
  o.requests.follow_display = has_person(o);
  return ok_status();
}

std::string end_of_trajectory(const ViewerOptions& o) {
  const auto& d = o.display;
  if (!o.head.movement.recorded || has_person(o)) return {};
  const double length_s = o.head.movement.recorded->duration_s();
  const bool ends = d.span.duration_s <= 0 || d.span.duration_s - d.span.hold_s > length_s + 0.05;
  if (!ends) return {};
  return fmt::format("the trajectory ends after {:.1f} s; {}", length_s,
                     o.head.loop ? "it begins again then" : "the head stands still then");
}

}  // namespace telesplat::viewer
