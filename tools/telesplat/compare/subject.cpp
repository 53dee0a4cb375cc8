#include "tools/telesplat/compare/subject.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "common/image/measures/reference.h"
#include "common/metrics/run_folder.h"
#include "common/splat/render_options.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> out;
  for (size_t begin = 0;;) {
    const size_t comma = std::min(text.find(',', begin), text.size());
    out.push_back(text.substr(begin, comma - begin));
    if (comma == text.size()) return out;
    begin = comma + 1;
  }
}

// Reads names: "square,disc".
options::Text names(std::vector<std::string>& value, std::vector<std::string> known) {
  return {.read =
              [&value, known](const std::string& text) {
                const auto given = split(text);
                for (const auto& name : given)
                  if (std::find(known.begin(), known.end(), name) == known.end())
                    return Status(Error{fmt::format("{} is not one of {}", name, fmt::join(known, ", "))});
                value = given;
                return ok_status();
              },
          .write = [&value] { return fmt::format("{}", fmt::join(value, ",")); }};
}

// Reads numbers: "10,250".
options::Text numbers(std::vector<uint64_t>& value) {
  return {.read =
              [&value](const std::string& text) {
                value.clear();
                for (const auto& one : split(text)) {
                  uint64_t n = 0;
                  const auto [stop, error] = std::from_chars(one.data(), one.data() + one.size(), n);
                  if (error != std::errc() || stop != one.data() + one.size())
                    return Status(Error{fmt::format("{} is not a whole number of 0 or more", one.substr(0, 40))});
                  value.push_back(n);
                }
                return ok_status();
              },
          .write = [&value] { return fmt::format("{}", fmt::join(value, ",")); }};
}

Status refuse_what_no_points_show(const CompareOptions& o, const Scene& scene) {
  if (scene.pipeline() == scene::Pipeline::kPoints) return ok_status();
  return Error{fmt::format("{}: shows {}, which is not drawn from points; telesplat run --verify compares its frames",
                           o.path, scene::described(scene.kind()))};
}

// Points the scene of a run at its data's present place.
Status settle_scene(const CompareOptions& o, Scene& scene) {
  if (!o.moved.empty())
    if (const Status s = scene.move_to(o.moved); !s) return s;
  if (scene.options().scene.empty() && !scene.check())
    return Error{fmt::format("{}/session.toml: does not tell where the data is (key file of [scene]); --scene names it",
                             o.path)};
  const Status there = scene.check();
  if (there || !o.moved.empty()) return there;
  return Error{there.error().text + "; if it was moved, --scene tells where to"};
}

}  // namespace

options::Table table(CompareOptions& o) {
  using options::Range;
  const options::Table of_data = data::scene_table(o.data);
  return {
      {.flag = "path", .value = &o.path, .help = "run folder, as telesplat run leaves it", .required = true},
      {.flag = "--scene", .value = &o.moved, .help = "the data file, if it is no longer where the run found it"},
      {.flag = "--out", .value = &o.out, .help = "folder for pictures and figures; default: compare in the run folder"},
      {.flag = "--poses",
       .value = &o.poses,
       .help = "how many poses, evenly spaced over the frames that show the data",
       .limits = Range{1, 1000}},
      {.flag = "--frames", .value = numbers(o.frames), .help = "numbers of the frames to compare instead, as 10,250"},
      {.flag = "--kernels",
       .value = names(o.kernels, splat::kernel_names()),
       .help = fmt::format("which of {}", fmt::join(splat::kernel_names(), ","))},
      {.flag = "--renderers",
       .value = names(o.renderers, {"cpu", "gl"}),
       .help = "which of cpu,gl; default: cpu, and gl where there is OpenGL"},
      {.flag = "--finish",
       .value = &o.finish,
       .help = "work per pixel after splatting: on, off, or some of fill,smooth,antialias"},
      {.flag = "--splat-scale",
       .value = &o.splat_scale,
       .help = "scale factor of splat sizes; 0: what suits the kernel",
       .limits = Range{0, 10}},
      {.flag = "--samples",
       .value = &o.samples,
       .help = "rays a pixel of the direct rendering that all pictures are compared with, a square number",
       .limits = Range{1, image::kMostSamples}},
      {.flag = "--repeat",
       .value = &o.repeat,
       .help = "frames timed for each picture; the median counts",
       .limits = Range{1, 1000}},
      {.flag = "--pixels-per-degree",
       .value = &o.pixels_per_degree,
       .help = "of the viewing conditions that FLIP assumes; default: a 0.7 m wide monitor of 3840 pixels at 0.7 m",
       .limits = Range{1, 1000}},
      {.flag = "--threads",
       .value = &o.threads,
       .help = "threads to draw with; 0: one a core",
       .limits = Range{0, 1024}},
      {.flag = "--pictures", .value = &o.pictures, .help = "write every picture and error map in full size too"},
      *options::find(of_data, "--cache"),
      *options::find(of_data, "--no-cache"),
  };
}

Result<CompareSubject> find_subject(const CompareOptions& o) {
  std::error_code error;
  if (!fs::exists(o.path, error)) return Error{fmt::format("{}: no such file or folder", o.path)};
  if (!fs::is_directory(o.path, error)) return Error{fmt::format("{}: is not a run folder", o.path)};
  auto run = read_recorded_run(o.path);
  if (!run) return run.error();
  if (const Status s = refuse_what_no_points_show(o, *run->scene); !s) return s.error();
  CompareSubject s;
  s.events = o.path + "/points.events";
  if (!fs::is_regular_file(s.events, error))
    return Error{
        fmt::format("{}: is not there, so what the frames showed cannot be made again; telesplat run keeps it unless "
                    "it is given --record-points 0",
                    s.events)};
  if (const Status safe = metrics::refuse_links(o.path, metrics::Logs::kOurs); o.out.empty() && !safe)
    return safe.error();
  run->scene->use_cache_of(o.data);
  if (const Status settled = settle_scene(o, *run->scene); !settled) return settled.error();
  s.shading = run->shading;
  s.best_patch_only = run->keeps_redundant;
  s.sampling = run->sampling_size;
  s.out = o.out.empty() ? o.path + "/compare" : o.out;
  auto frames = choose_frames(*run, o.poses, o.frames);
  if (!frames) return frames.error();
  s.frames = std::move(*frames);
  s.scene = std::move(run->scene);
  return s;
}

}  // namespace telesplat::launcher
