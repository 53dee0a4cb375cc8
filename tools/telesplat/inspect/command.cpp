// `telesplat inspect PATH`: describes a data set, a run folder, a picture, a recorded frame, a depth image or a file of
// the cache.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "common/core/log.h"
#include "common/options/complain.h"
#include "services/data/inspect.h"
#include "services/data/kinds.h"
#include "services/data/volume/volume.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/inspect/pictures.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

struct InspectOptions {
  data::DataOptions data;  // data.scene is the path
  bool json = false;
  double skip_s = 0;
  std::string out;               // .npy or .exr file for depth; empty: none
  std::optional<double> near_m;  // near plane of a depth image that has no cameras.csv
};

options::Table own_table(InspectOptions& o) {
  return {
      {.flag = "--json", .value = &o.json, .help = "print all that is known, as JSON"},
      {.flag = "--skip",
       .value = &o.skip_s,
       .help = "of run folders: seconds after the first displayed frame that figures leave out: its warming up",
       .limits = options::Range{0.0, 1e6}},
      {.flag = "--out",
       .value = &o.out,
       .help = "of depth images and pictures with depth: write the depth in metres, rows from the top, infinity where "
               "nothing is, into FILE.npy (float32) or FILE.exr (channel Z, with R, G, B and normals N)"},
      {.flag = "--near",
       .value = &o.near_m,
       .help = "of depth images: near plane of the camera that saw them, metres; default: as cameras.csv beside them "
               "says",
       .limits = options::Range{1e-6, 1e6}},
  };
}

options::Table table(InspectOptions& o) {
  options::Table path{{.flag = "path",
                       .value = &o.data.scene,
                       .help = data::scene_help() +
                               "; or a run folder, a picture, a recorded frame, a depth image (.depth), a chunk store "
                               "of the cache (.mesh)",
                       .required = true}};
  return joined(joined(std::move(path), own_table(o)), data::scene_table(o.data));
}

// Kind of the path's content, as far as flags depend on it.
enum class Inspected { kData, kRun, kPicture, kDepthImage, kStore };

std::string lower_extension(const std::string& path) {
  std::string out = fs::path(path).extension().string();
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return out;
}

Inspected subject_of(const data::DataOptions& o) {
  std::error_code error;
  const std::string& path = o.scene;
  if (path == julia::kSceneWord || !o.volume.raw.empty()) return Inspected::kData;
  // A folder counts as a run's, unless it holds a volume or a mesh and no run.
  if (fs::is_directory(path, error))
    return fs::exists(path + "/summary.json", error) || !(data::looks_like_volume(path) || data::is_mesh_file(path))
               ? Inspected::kRun
               : Inspected::kData;
  const std::string extension = lower_extension(path);
  if (extension == ".depth") return Inspected::kDepthImage;
  if (extension == ".mesh") return Inspected::kStore;
  const bool picture = extension == ".exr" || extension == ".png" || extension == ".jpg" || extension == ".jpeg";
  if (extension == ".frame" || (picture && !data::is_mesh_file(path))) return Inspected::kPicture;
  return Inspected::kData;
}

// Refuses flags that do not fit the path's content.
Status refuse_misfits(const InspectOptions& o, const options::Given& given, Inspected subject) {
  constexpr const char* kWords[] = {"a data set", "a run folder", "a picture", "a depth image", "a chunk store"};
  InspectOptions any;
  const options::Table own = own_table(any), data = data::scene_table(any.data);
  for (const std::string& flag : given) {
    const bool deep = subject == Inspected::kPicture || subject == Inspected::kDepthImage;
    const bool fits = options::find(data, flag) ? subject == Inspected::kData
                      : flag == "--out"         ? deep
                      : flag == "--near"        ? subject == Inspected::kDepthImage
                      : flag == "--skip"        ? subject == Inspected::kRun
                                                : true;
    if (!fits)
      return Error{fmt::format("{}: {} is {}, which has no {}", flag, o.data.scene, kWords[size_t(subject)], flag)};
  }
  return ok_status();
}

Result<data::Description> inspect_data(const data::DataOptions& options) {
  const auto scene = scene_of(options);
  if (!scene) return scene.error();
  tools::ProgressLine progress(1);
  return (*scene)->describe_data([&](const char* what, double fraction) { progress.show(what, fraction); });
}

Result<data::Description> inspect_with_depth(const InspectOptions& o, Inspected subject) {
  const std::string& path = o.data.scene;
  auto picture = subject == Inspected::kPicture ? inspect_picture(path) : inspect_depth_image(path, o.near_m);
  if (!picture) return picture.error();
  if (o.out.empty()) return std::move(picture->description);
  if (const Status s = write_depth(o.out, *picture, path); !s) return s.error();
  picture->description.row("written", o.out);
  picture->description.json["written"] = o.out;
  return std::move(picture->description);
}

Result<data::Description> inspect_store(const std::string& path) {
  const auto facts = data::inspect_store(path);
  if (!facts) return facts.error();
  return data::describe(*facts);
}

int inspect(InspectOptions o, const options::Given& given) {
  log::initialise("telesplat", "warn");  // to stderr: stdout may be JSON
  const std::string& path = o.data.scene;
  std::error_code error;
  if (path != julia::kSceneWord && !fs::exists(path, error)) return complain({fmt::format("{}: no such file", path)});
  const Inspected subject = subject_of(o.data);
  if (const auto kind = data::kind_of(o.data); !kind && fs::exists(path + "/ept.json", error))
    return complain(kind.error());
  // The folder holds no run: print why, without regard to flags.
  if (subject == Inspected::kRun && !fs::exists(path + "/summary.json", error))
    return complain(inspect_run(path).error());
  if (const Status s = refuse_misfits(o, given, subject); !s) return complain(s.error());
  const auto told = subject == Inspected::kData    ? inspect_data(o.data)
                    : subject == Inspected::kRun   ? inspect_run(path, o.skip_s)
                    : subject == Inspected::kStore ? inspect_store(path)
                                                   : inspect_with_depth(o, subject);
  if (!told) return complain(told.error());
  std::printf("%s", (o.json ? told->to_json() + "\n" : told->table()).c_str());
  return 0;
}

}  // namespace

Command inspect_command() {
  return make_command("inspect",
                      "tell what a data set, a run folder, a picture or a depth image holds, and where it will stand",
                      table, inspect);
}

}  // namespace telesplat::launcher
