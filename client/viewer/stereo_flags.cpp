#include "client/viewer/stereo_flags.h"

#include <fmt/format.h>

#include "client/stereo/autostereo/panel_file.h"

namespace telesplat::viewer {

using options::Names;
using options::Range;
using options::Reach;

options::Table stereo_table(StereoFlags& f) {
  return {
      {.flag = "--stereo",
       .value = &f.mode,
       .help = "two eyes: side-by-side, top-bottom (-half: squeezed, the display stretches them), anaglyph-grey, "
               "anaglyph-colour, anaglyph-dubois, rows, columns, checker (interleaved), autostereo (--barrier), "
               "quad-buffer (of the driver)",
       .limits = stereo::mode_names(),
       .reach = Reach::kRecorded},
      {.flag = "--eye-separation",
       .value = &f.eye_separation_m,
       .help = "metres from eye to eye",
       .limits = Range{0, 1},
       .reach = Reach::kRecorded},
      {.flag = "--screen-distance",
       .value = &f.screen_m,
       .help = "metres before the head to the plane whose points lie in one place of both pictures; 0: to the data "
               "set's middle, as it is in the first view",
       .limits = Range{0, 1000},
       .reach = Reach::kRecorded},
      {.flag = "--swap-eyes",
       .value = &f.swap_eyes,
       .help = "on: each eye's picture takes the other one's place",
       .reach = Reach::kRecorded,
       .on_off = true},
      {.flag = "--barrier",
       .value = &f.panel_file,
       .help = "--stereo autostereo: TOML file of the display and its line screen; it is read again when it changes",
       .reach = Reach::kRecorded,
       .is_file = true},
      {.flag = "--tracked-head",
       .value = &f.head_file,
       .help =
           "--stereo autostereo: CSV file of poses of the head before the display, metres from its middle, x to the "
           "right, y up, z towards the person; without it the head is straight before it",
       .is_file = true},
      {.flag = "--stereo-pattern",
       .value = &f.pattern,
       .help = "in place of the scene: calibration (left red, right blue, a cross in the middle of both), test",
       .limits = stereo::pattern_names(),
       .reach = Reach::kRecorded},
  };
}

namespace {

constexpr double kMostLooks = 1e5;  // looks a second at a tracked head's movement

Status read_files(const StereoFlags& f, StereoOptions& o) {
  const bool autostereo = o.mode == stereo::Mode::kAutostereo;
  for (const auto& [flag, file] : {std::pair{"--barrier", &f.panel_file}, {"--tracked-head", &f.head_file}})
    if (!file->empty() && !autostereo)
      return Error{fmt::format("{} {}: is for --stereo autostereo, not for {}", flag, *file, f.mode)};
  if (!autostereo) return ok_status();
  if (f.panel_file.empty()) return Error{"--stereo autostereo: needs --barrier, a file of the display's line screen"};
  const auto panel = stereo::read_panel(f.panel_file);
  if (!panel) return Error{"--barrier " + panel.error().text};
  o.panel = *panel;
  o.panel_file = f.panel_file;
  if (f.head_file.empty()) return ok_status();
  const auto head = geometry::Trajectory::read_csv(f.head_file);
  if (!head) return Error{"--tracked-head " + head.error().text};
  const double end_s = head->duration_s();
  const double step_s = std::max(0.01, end_s / kMostLooks);
  for (double t_s = 0; t_s <= end_s + step_s; t_s += step_s) {
    const glm::dvec3 at = head->at(t_s).position_room;
    const double reach_m = f.eye_separation_m;
    if (const Status s = stereo::validate(*panel, {at - glm::dvec3(0, 0, reach_m), at}); !s)
      return Error{fmt::format("--tracked-head {}: at {:.2f} s {}", f.head_file, t_s, s.error().text)};
  }
  o.tracked_head = *head;
  return ok_status();
}

}  // namespace

Result<StereoOptions> settle(const StereoFlags& f) {
  StereoOptions o;
  const auto mode = stereo::mode_named(f.mode);
  const auto pattern = stereo::pattern_named(f.pattern);
  if (!mode) return Error{fmt::format("--stereo {}: no such mode", f.mode)};
  if (!pattern) return Error{fmt::format("--stereo-pattern {}: no such pattern", f.pattern)};
  if (*pattern != stereo::Pattern::kNone && *mode == stereo::Mode::kOff)
    return Error{fmt::format("--stereo-pattern {}: needs --stereo", f.pattern)};
  o.mode = *mode;
  o.pattern = *pattern;
  o.eye_separation_m = f.eye_separation_m;
  o.screen_m = f.screen_m;
  o.swap_eyes = f.swap_eyes;
  if (const Status s = read_files(f, o); !s) return s.error();
  return o;
}

}  // namespace telesplat::viewer
