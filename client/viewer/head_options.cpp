#include "client/viewer/viewer_options.h"

#include <fmt/format.h>

#include "client/viewer/input/pose_feed.h"

namespace telesplat::viewer {
namespace {

using options::Names;
using options::Range;
using options::Table;

Status settle_poses(ViewerOptions& o) {
  const auto prediction = tracking::prediction_named(o.head.prediction);
  if (!prediction) return Error{fmt::format("--prediction {}: not none, velocity or kalman", o.head.prediction)};
  o.requests.prediction = *prediction;
  if (o.head.poses.empty() || o.head.trajectory.empty() || o.head.trajectory == "still") return ok_status();
  return Error{fmt::format("--poses {} and --trajectory {}: the head follows the one or the other", o.head.poses,
                           o.head.trajectory)};
}

Status settle_xr(ViewerOptions& o) {
  if (!o.xr.on) return ok_status();
  for (const auto& [given, flag] : {std::pair{!o.head.poses.empty(), "--poses"},
                                    {!o.head.trajectory.empty() && o.head.trajectory != "still", "--trajectory"},
                                    {!o.head.eye.empty(), "--eye"},
                                    {!o.wall.name.empty(), "--wall"},
                                    {o.stereo.mode != "off", "--stereo"},
                                    {o.drawing.background == "transparent", "--background transparent"},
                                    {o.window.fullscreen, "--fullscreen"},
                                    {o.coupling.mode != "async", "--coupling"}})
    if (given) return Error{fmt::format("{} has no meaning with --xr: the headset has its own head and clock", flag)};
  if (o.xr.origin.empty()) return ok_status();
  const auto origin = parse_point(o.xr.origin);
  if (!origin) return Error{fmt::format("--xr-origin {}: {}", o.xr.origin, origin.error().text)};
  o.xr.options.origin_m = *origin;
  return ok_status();
}

}  // namespace

std::string complain_about_point(const std::string& text) {
  const auto point = parse_point(text);
  return point ? "" : point.error().text;
}

Table head_source_table(HeadFlags& o) {
  return {
      {.flag = "--poses",
       .value = &o.poses,
       .help = "poses of a tracker move the head: tcp://HOST:PORT or ipc://PATH of any ZeroMQ publisher of pose "
               "messages (docs/tracking.md)",
       .limits = options::Check(complain_about_publisher),
       .not_in_scene = "whom a viewer listens to"},
      {.flag = "--pose-horizon",
       .value = &o.pose_horizon_s,
       .help = "--poses: what is displayed is predicted so many seconds ahead; 0: as long as a frame takes",
       .limits = Range{0, 0.1}},
      {.flag = "--prediction",
       .value = &o.prediction,
       .help = "where the head will be when what is asked for arrives: none: where it is; velocity: its pose and its "
               "velocity; kalman: a Kalman filter",
       .limits = Names(tracking::kPredictionNames.begin(), tracking::kPredictionNames.end())},
  };
}

Status settle_head_source(ViewerOptions& o) {
  const Status poses = settle_poses(o);
  return poses ? settle_xr(o) : poses;
}

Table xr_table(XrFlags& o) {
  return {
      {.flag = "--xr",
       .value = &o.on,
       .help = "show it in a headset, through OpenXR, instead of a window; untried on a headset (docs/xr.md)"},
      {.flag = "--xr-origin",
       .value = &o.origin,
       .help = "--xr: where the data set's centre stands in the headset's space, x,y,z in metres, +y up",
       .limits = options::Check(complain_about_point),
       .default_text = "a metre before the stage's centre, 1.1 m above the floor; without a stage 0.75 m before the "
                       "first view of the head and 0.35 m below"},
      {.flag = "--xr-scale",
       .value = &o.options.scale,
       .help = "--xr: pixels drawn for each that the headset recommends, on each axis",
       .limits = Range{0.1, 2}},
      {.flag = "--xr-depth",
       .value = &o.options.depth,
       .help = "--xr: on: hand the headset each picture's depth, so that it can move pictures that are late",
       .on_off = true}};
}

}  // namespace telesplat::viewer
