#include "tools/telesplat/scene/scene_kind.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <initializer_list>

#include "services/data/volume/volume.h"
#include "tools/telesplat/run/run_command.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// A frame of a Julia set is dear: coarser while the head moves. Points of views long past are of no use, since nothing is eliminated.
constexpr double kJuliaLeastSampling = 0.4, kJuliaMaxPoints = 8e6;
// The tiles of a wall are compared where the head stands still.
constexpr double kWallHold_s = 2;

constexpr std::initializer_list<const char*> kOfVolumes{"--tf", "--lighting", "--series-rate", "--data-servers",
                                                        "--layers"};
constexpr std::initializer_list<const char*> kOfRasters{"--z-scale", "--texture"};
constexpr std::initializer_list<const char*> kOfPoints{
    "--sampler",        "--splat",        "--splat-scale",        "--finish",
    "--detail-budget",  "--least-detail", "--speed-detail",       "--record-depth",
    "--progressive",    "--lease-target", "--packing.redundancy", "--packing.max_points",
    "--epoch-patience",
};

// The first of these flags that was given; none: empty.
std::string first_given(const CLI::App& flags, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const auto* option = flags.get_option_no_throw(name); option && option->count() > 0) return name;
  return {};
}

Result<SceneKind> kind_of(const RunOptions& o) {
  if (o.shows_julia()) return SceneKind::kJulia;
  if (o.scene.empty()) return SceneKind::kNone;
  std::error_code error;
  if (!fs::exists(o.scene, error)) return Error{fmt::format("{}: no such file", o.scene)};
  if (!o.volume.raw.empty() || data::looks_like_volume(o.scene))
    return o.mesh.iso ? SceneKind::kMesh : SceneKind::kVolume;
  if (o.mesh.iso) return Error{fmt::format("--iso: {} is no volume", o.scene)};
  if (fs::is_directory(o.scene, error))
    return Error{fmt::format(
        "{}: is a folder, and not one of DICOM slices or of a numbered series of volume files; a data file is needed, "
        "or the word julia",
        o.scene)};
  return SceneKind::kMesh;
}

}  // namespace

const char* name_of(SceneKind kind) {
  switch (kind) {
    case SceneKind::kMesh:
      return "a mesh";
    case SceneKind::kJulia:
      return "a Julia set";
    case SceneKind::kVolume:
      return "a volume";
    case SceneKind::kNone:
      break;
  }
  return "no scene";
}

Status settle_scene(const CLI::App& flags, RunOptions& o) {
  const auto given = [&](const char* name) { return !first_given(flags, {name}).empty(); };
  const auto kind = kind_of(o);
  if (!kind) return kind.error();
  o.kind = *kind;

  if (o.kind != SceneKind::kVolume) {
    std::string flag = first_given(flags, kOfVolumes);
    if (flag.empty() && given("--raw")) flag = "--raw";
    if (!flag.empty() && o.kind == SceneKind::kNone)
      return Error{
          fmt::format("{} is given, but no scene; the volume of a running session is changed with telesplat "
                      "ctl tf and ctl set volume.step=N",
                      flag)};
    if (!flag.empty())
      return Error{fmt::format("{}: {} is {}; only volumes have {}", flag, o.scene, name_of(o.kind), flag)};
  } else if (const std::string flag = first_given(flags, kOfPoints); !flag.empty()) {
    return Error{fmt::format("{}: {} is a volume, which is not drawn from points", flag, o.scene)};
  }

  if (o.kind == SceneKind::kJulia) {
    if (!given("--least-sampling")) o.viewer.requests.min_scale = kJuliaLeastSampling;
    if (!given("--packing.max_points")) o.master.master.settings["packing.max_points"] = kJuliaMaxPoints;
  }
  if (!o.wall.empty()) {
    const auto wall = parse_wall(o.wall);
    if (!wall) return wall.error();
    if (!given("--viewers")) o.viewers = wall->tiles();
    if (!given("--hold")) o.viewer.display.hold_s = kWallHold_s;
  }
  return ok_status();
}

}  // namespace telesplat::launcher
