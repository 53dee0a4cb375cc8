#include "common/scene/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace telesplat::scene {
namespace {

constexpr Kinds kAll = Kinds::all(), kPoints{Kind::kMesh, Kind::kJulia}, kMeshes{Kind::kMesh}, kSets{Kind::kJulia},
                kVolumes{Kind::kVolume}, kFiles{Kind::kMesh, Kind::kVolume};
using enum Keeper;

constexpr Setting kSettings[] = {
    {"open", "Data", "open", "", kAll, kLauncher, "another data set: a file, a folder of DICOM slices, or julia",
     "panel/open ..."},
    {"up", "Data", "up", "--up", kFiles, kLauncher, "the axis of the data that points up"},
    {"room-size", "Data", "room-size", "--room-size", kFiles, kLauncher, "metres of the data set's longest side"},
    {"z-scale", "Data", "z-scale", "--z-scale", kMeshes, kLauncher, "heights of a terrain times this"},
    {"lighting", "Data", "lighting", "--lighting", kVolumes, kLauncher,
     "whether a volume's voxels are shaded by their gradients"},

    {"coupling", "Display", "coupling", "--coupling", kAll, kSession,
     "async: the display never waits; sync: each frame waits for its own view update; loose: for the next of several"},
    {"buffers", "Display", "coupling", "--buffers", kAll, kSession,
     "of loose: view updates that are on their way or complete and not displayed, at most"},
    {"splat", "Display", "splat", "--splat", kPoints, kViewer, "how a point becomes pixels"},
    {"fill", "Display", "finish", "--finish", kPoints, kViewer,
     "pixels inside a surface that show nothing, or something farther, are filled"},
    {"smooth", "Display", "finish", "--finish", kPoints, kViewer,
     "interpolates between magnified splats of one surface"},
    {"antialias", "Display", "finish", "--finish", kPoints, kViewer,
     "silhouettes; and still pictures become finer only with it"},
    {"detail", "Display", "detail", "", kPoints, kViewer,
     "points drawn on each axis for a sample or a display pixel, at most; less is coarser and faster"},
    {"background", "Display", "background", "--background", kAll, kViewer, "the colour behind the data"},
    {"panel", "Display", "panel", "--panel", kAll, kViewer, "whether the panel is shown", "panel/hide"},
    {"fullscreen", "Display", "fullscreen", "--fullscreen", kAll, kViewer, "whether the window fills the screen",
     "Pictures and paths/full screen"},
    {"shading", "Light", "shading", "--shading", kPoints, kViewer,
     "lit: a light from the upper left and the head's; head: the head's alone; unlit: colours as they are"},

    {"sampling-size", "Sampling", "sampling-size", "--sampling-size", kAll, kViewer,
     "auto: as fine as view updates in time allow; else WxH, W times H pixels in the window's shape"},
    {"least-sampling", "Sampling", "least-sampling", "--least-sampling", kAll, kViewer,
     "sampling-size auto: sampled pixels a displayed pixel, on each axis, at least"},

    {"array", "Colours", "colour", "--colour-by", kMeshes, kSession, "the array of the file that colours the mesh"},
    {"range", "Colours", "colour", "--colour-by", kMeshes, kSession, "the values at the ends of the colour map"},
    {"map", "Colours", "colour", "--colour-map", kMeshes, kSession, "the colours from the least value to the largest"},
    {"preset", "Transfer function", "tf", "--tf", kVolumes, kSession, "a transfer function that is ready"},
    {"curve", "Transfer function", "tf", "--tf", kVolumes, kSession, "colour and opacity of a volume's values"},
    {"clip", "Cut", "clip", "--clip", kAll, kSession, "planes and boxes that cut part of the data away"},
    {"iso", "Isosurface", "iso", "--iso", kMeshes, kLauncher, "the value at which the surface of a volume lies"},

    {"step", "Series", "set", "", kVolumes, kSession, "volume.step: the step of a series of volumes"},
    {"steps/s", "Series", "set", "--series-rate", kVolumes, kSession,
     "volume.steps-per-s: the speed of a series that plays"},
    {"play", "Series", "play", "", kVolumes, kSession, "an animation or a series goes on, pauses, or goes a step"},
    {"parameters", "Parameters", "set", "--preset", kSets, kSession, "the parameters of a Julia set", "Parameters/c.x"},
    {"timeline", "Timeline", "animate", "--animate", kSets, kSession, "parameters that change with time",
     "key frame of its value now"},

    {"axes", "Over the picture", "overlay", "", kAll, kViewer, "the data's axes"},
    {"scale", "Over the picture", "overlay", "", kAll, kViewer, "a bar of a round length"},
    {"cursor", "Over the picture", "overlay", "", kAll, kViewer, "what lies under the cursor"},
    {"fps", "Over the picture", "overlay", "", kAll, kViewer, "frames a second"},
    {"legend", "Over the picture", "legend", "--legend", kAll, kViewer, "what colours mean"},

    {"stereo", "Stereo", "stereo", "--stereo", kAll, kViewer, "how two eyes' pictures share the display"},
    {"eye-separation", "Stereo", "eye-separation", "--eye-separation", kAll, kViewer, "metres from eye to eye"},
    {"screen-distance", "Stereo", "screen-distance", "--screen-distance", kAll, kViewer,
     "metres before the head to the plane whose points lie in one place of both pictures; 0: to the data set's middle"},
    {"swap-eyes", "Stereo", "swap-eyes", "--swap-eyes", kAll, kViewer,
     "each eye's picture takes the other one's place"},

    {"samplers", "Samplers", "samplers", "--samplers", kAll, kLauncher, "sampler processes of the session"},
    {"bookmarks", "Bookmarks and notes", "bookmark", "", kAll, kNotes, "views that are kept beside the data set",
     "keep this view"},
    {"notes", "Bookmarks and notes", "notes", "", kAll, kNotes, "texts that are kept beside the data set", "add"},
};

std::string_view text_of(Keeper keeper) {
  return keeper == kSession ? "session" : keeper == kViewer ? "window" : keeper == kLauncher ? "launcher" : "file";
}

}  // namespace

std::span<const Setting> settings() { return kSettings; }

const Setting* find_setting(std::string_view name) {
  const auto found = std::find_if(std::begin(kSettings), std::end(kSettings), [&](auto& s) { return s.name == name; });
  return found == std::end(kSettings) ? nullptr : found;
}

const Setting* setting_of_order(std::string_view order) {
  const auto found =
      std::find_if(std::begin(kSettings), std::end(kSettings), [&](auto& s) { return s.order == order; });
  return found == std::end(kSettings) ? nullptr : found;
}

std::string help_of_order(std::string_view order) {
  std::string out, only;
  for (const Setting& s : kSettings) {
    if (s.order != order) continue;
    only = out.empty() ? std::string(s.what) : std::string();
    out += fmt::format("{}{}: {}", out.empty() ? "" : "; ", s.name, s.what);
  }
  return only.empty() ? out : only;
}

std::string text_of(Kinds kinds) {
  if (kinds == kAll) return "all";
  std::string out;
  for (const Kind kind : kKinds)
    if (kinds.has(kind)) out += (out.empty() ? "" : ", ") + std::string(name_of(kind));
  return out;
}

std::string settings_page() {
  std::string out =
      "| section | setting | `telesplat ctl` | at the start | of | whose | |\n|---|---|---|---|---|---|---|\n";
  for (const Setting& s : kSettings)
    out += fmt::format("| {} | {} | `{}` | {} | {} | {} | {} |\n", s.section, s.name, s.order,
                       s.flag.empty() ? "" : fmt::format("`{}`", s.flag), text_of(s.kinds), text_of(s.keeper), s.what);
  return out;
}

}  // namespace telesplat::scene
