#include "tools/telesplat/compare/compare_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "common/image/measures/reference.h"
#include "common/splat/render_options.h"

namespace telesplat::launcher {
namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> out;
  for (size_t begin = 0;;) {
    const size_t comma = std::min(text.find(',', begin), text.size());
    out.push_back(text.substr(begin, comma - begin));
    if (comma == text.size()) return out;
    begin = comma + 1;
  }
}

// "square,disc"
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

// "10,250"
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

// Where poses come from, and how they are drawn.
options::Table drawing_table(CompareOptions& o) {
  using options::Range;
  return {
      {.flag = "path",
       .value = &o.path,
       .help = "run folder, as telesplat run leaves it; with --still also a data file",
       .required = true},
      {.flag = "--scene", .value = &o.moved, .help = "the data file, if it is no longer where the run found it"},
      {.flag = "--out",
       .value = &o.out,
       .help = "folder for pictures and figures; default: compare (--still: compare-still) in the run folder"},
      {.flag = "--poses",
       .value = &o.poses,
       .help = "how many poses, evenly spaced over the frames that show the data",
       .limits = Range{1, 1000},
       .default_text = "4, with --still 1"},
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
  };
}

// Poses that are sampled anew.
options::Table still_table(CompareOptions& o) {
  using options::Range;
  return {
      {.flag = "--still",
       .value = &o.still,
       .help = "sample each pose itself, at the display's resolution, instead of replaying what the run had cached"},
      {.flag = "--magnify",
       .value = &o.magnify,
       .help = "with --still: sample at this fraction of the display's resolution",
       .limits = Range{1, 16}},
      {.flag = "--size", .value = &o.size, .help = "display size in pixels, WxH, for a data file"},
      {.flag = "--fov",
       .value = &o.fov_deg,
       .help = "horizontal field of view in degrees, for a data file",
       .limits = Range{1, 170}},
      {.flag = "--near",
       .value = &o.near_m,
       .help = "nearest depth seen in metres, for a data file",
       .limits = Range{1e-5, 1e3}},
      {.flag = "--octree-depth",
       .value = &o.octree_depth,
       .help = "levels of the point model's octree, for a data file",
       .limits = Range{1, 10}},
  };
}

}  // namespace

options::Table table(CompareOptions& o) {
  return joined(joined(drawing_table(o), still_table(o)), data::scene_table(o.data));
}

}  // namespace telesplat::launcher
