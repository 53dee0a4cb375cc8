// `telesplat bench codec FILE...`: bits, speed and errors of the codecs of depth images and slice images.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/viewer/viewer_service.h"
#include "common/core/log.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "services/data/kinds.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/codec/report.h"
#include "tools/telesplat/bench/walk.h"

namespace telesplat::launcher {
namespace {

using options::Range;

constexpr double kQuiet_s = 1.5;  // nothing is told of work that is over by then

struct CodecBenchOptions {
  std::vector<std::string> files;
  data::DataOptions data;  ///< how scenes are read; its own scene is none
  ViewOptions views;
  std::string coders = "all", depth_error = "0";
  int normal_error = 0, colour_error = 0;
  double seconds = 0.5;
  std::string errors, json;
};

options::Table measure_table(CodecBenchOptions& o) {
  return {
      {.flag = "files",
       .value = &o.files,
       .help = "recorded depth images (FILE.depth, or a folder with some in it, such as a run's), or scenes, of which "
               "views are sampled: mesh files, the word julia, volumes",
       .required = true},
      {.flag = "--coders",
       .value = &o.coders,
       .help = "what the codec stands beside, with commas between: lzw, tiff, png, zstd, rvl, jxl; all, or none"},
      {.flag = "--seconds",
       .value = &o.seconds,
       .help = "for each instruction set, encoding and decoding are timed so long; 0: not at all",
       .limits = Range{0, 60}},
      {.flag = "--depth-error",
       .value = &o.depth_error,
       .help = "with this or the other bounds of error, images are coded within bounds, too, and refined: of a pixel's "
               "size at its depth, a number or a quotient such as 1/32, up to 16"},
      {.flag = "--normal-error",
       .value = &o.normal_error,
       .help = "codes of both coordinates of normals",
       .limits = Range{0, codec::ErrorBounds::kMostNormal}},
      {.flag = "--colour-error",
       .value = &o.colour_error,
       .help = "codes of each channel of colours",
       .limits = Range{0, codec::ErrorBounds::kMostColour}},
      {.flag = "--errors",
       .value = &o.errors,
       .help = "PNG for error maps, 8 times: for each file the image that has the largest errors"},
      {.flag = "--json", .value = &o.json, .help = "file for all figures"}};
}

options::Table view_table(ViewOptions& o) {
  return {{.flag = "--views", .value = &o.views, .help = "views of a scene that are sampled", .limits = Range{1, 1000}},
          {.flag = "--trajectory",
           .value = &o.trajectory,
           .help = "where they stand: orbit, or CSV files of poses with commas between; evenly spaced"},
          {.flag = "--size", .value = &o.size, .help = "size of the views in pixels, WxH"},
          {.flag = "--fov",
           .value = &o.fov_deg,
           .help = "horizontal field of view in degrees; of recorded images too, where cameras.csv does not lie beside "
                   "them",
           .limits = Range{1, 170}},
          {.flag = "--threads",
           .value = &o.threads,
           .help = "threads to sample with; 0: one a core",
           .limits = Range{0, 1024}}};
}

options::Table table(CodecBenchOptions& o) {
  return joined(joined(measure_table(o), view_table(o.views)), data::scene_table(o.data));
}

Result<std::vector<const Baseline*>> named_coders(const std::string& names) {
  std::vector<const Baseline*> out;
  if (names == "none") return out;
  std::string known;
  for (const Baseline& b : baselines()) known += (known.empty() ? "" : ", ") + b.name;
  if (names == "all")
    for (const Baseline& b : baselines()) out.push_back(&b);
  if (names == "all") return out;
  std::istringstream list(names);
  for (std::string name; std::getline(list, name, ',');) {
    const auto& all = baselines();
    const auto found = std::find_if(all.begin(), all.end(), [&](const Baseline& b) { return b.name == name; });
    if (found == all.end())
      return Error{fmt::format("--coders {}: there is no {}; there are {}, all and none", names, name, known)};
    out.push_back(&*found);
  }
  return out;
}

// "0.03", "1/32"
Result<double> pixels_of(const std::string& text) {
  constexpr double kMost = 16;
  double parts[2] = {0, 1};
  const char *at = text.data(), *const end = at + text.size();
  for (double& part : parts) {
    const auto [stop, error] = std::from_chars(at, end, part);
    if (error != std::errc() || (stop != end && (*stop != '/' || &part == &parts[1]))) break;
    if (stop == end) {
      const double pixels = parts[0] / parts[1];
      if (pixels >= 0 && pixels <= kMost) return pixels;
      break;
    }
    at = stop + 1;
  }
  return Error{fmt::format("--depth-error {}: expected pixels, 0 to {}, such as 1/32", text, kMost)};
}

class CodecBench {
 public:
  CodecBench(CodecBenchOptions& o, std::vector<const Baseline*> coders, const ErrorWish& wish)
      : o_(o), measure_({std::move(coders), o.seconds, !o.errors.empty(), wish}) {}

  Status recorded(const FrameSet& set) {
    for (size_t i = 0; i < set.files.size(); ++i) {
      if (net::stop_requested()) return Error{"told to stop"};
      progress_.show(fmt::format("{}: image {} of {}", set.name, i + 1, set.files.size()));
      const auto frame = read_frame(set.files[i], o_.views.fov_deg);
      if (!frame) return frame.error();
      if (const Status s = measure_.add(*frame); !s) return Error{fmt::format("{}: {}", set.files[i], s.error().text)};
    }
    return finish(set.name);
  }

  Status scene(const std::string& name) {
    o_.data.scene = name;
    const auto kind = data::kind_of(o_.data);
    if (!kind) return kind.error();
    const ShowProgress show = [&](const std::string& text) { progress_.show(text); };
    if (scene::pipeline_of(*kind) == scene::Pipeline::kSlices) {
      const auto report = measure_slices(o_.data, o_.views, o_.seconds, show);
      if (!report) return report.error();
      tell(*report);
      return ok_status();
    }
    const auto frames = sample_frames(o_.data, o_.views, show);
    if (!frames) return frames.error();
    for (size_t i = 0; i < frames->size(); ++i) {
      progress_.show(fmt::format("{}: image {} of {}", name, i + 1, frames->size()));
      if (const Status s = measure_.add((*frames)[i]); !s) return Error{fmt::format("{}: {}", name, s.error().text)};
    }
    return finish(name.substr(name.find_last_of('/') + 1));
  }

  /// Writes what is to be written.
  Status write() {
    if (!o_.json.empty())
      if (const Status s = write_whole(o_.json, nlohmann::json{{"sets", json_}}.dump(2) + "\n"); !s) return s;
    if (o_.errors.empty() || maps_.empty()) return ok_status();
    const auto sheet = stacked(maps_);
    return sheet ? image::write_png(o_.errors, *sheet) : Status(sheet.error());
  }

 private:
  Status finish(const std::string& name) {
    progress_.show(fmt::format("{}: measuring speeds", name));
    const CodecReport report = measure_.finish(name);
    if (measure_.worst_maps()) maps_.push_back(*measure_.worst_maps());
    if (net::stop_requested()) return Error{"told to stop"};
    tell(report);
    return ok_status();
  }
  void tell(const auto& report) {
    progress_.close();
    std::printf("%s%s", json_.empty() ? "" : "\n", to_markdown(report).c_str());
    std::fflush(stdout);
    json_.push_back(to_json(report));
  }

  CodecBenchOptions& o_;
  CodecMeasure measure_;
  tools::ProgressLine progress_{kQuiet_s};
  nlohmann::json json_ = nlohmann::json::array();
  std::vector<image::View> maps_;
};

int bench_codec(CodecBenchOptions o, const options::Given&) {
  log::initialise("telesplat", "warn");
  net::install_signal_handlers();
  if (const auto size = viewer::parse_size(o.views.size, "--size"); !size) return tools::complain(size.error());
  if (const auto walk = Walk::open(o.views.trajectory); !walk) return tools::complain(walk.error());
  auto coders = named_coders(o.coders);
  if (!coders) return tools::complain(coders.error());
  std::vector<CodecSubject> subjects;
  for (const std::string& file : o.files) {
    const auto subject = codec_subject(file);
    if (!subject) return tools::complain(subject.error());
    subjects.push_back(*subject);
  }
  const auto depth_error = pixels_of(o.depth_error);
  if (!depth_error) return tools::complain(depth_error.error());
  CodecBench bench(o, std::move(*coders), {*depth_error, o.normal_error, o.colour_error});
  const auto ended = [&](const Status& s) {
    return net::stop_requested() ? tools::complain({"interrupted"}, 130) : tools::complain(s.error());
  };
  for (const FrameSet& set : joined_sets(subjects))
    if (const Status s = bench.recorded(set); !s) return ended(s);
  for (const CodecSubject& subject : subjects)
    if (!subject.scene.empty())
      if (const Status s = bench.scene(subject.scene); !s) return ended(s);
  const Status written = bench.write();
  return written ? 0 : tools::complain(written.error(), 1);
}

}  // namespace

Command bench_codec_command() {
  return make_command("codec",
                      "bits a pixel, speed and errors of the codecs of depth images and slice images, beside LZW, PNG, "
                      "zstd, RVL and JPEG XL",
                      table, bench_codec);
}

}  // namespace telesplat::launcher
