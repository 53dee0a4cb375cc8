#include "tools/telesplat/tune/subject.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <set>

#include "client/viewer/coupling/request_options.h"
#include "common/core/machine.h"
#include "common/julia/flags.h"
#include "common/options/parser.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/scene/scene_file.h"
#include "tools/telesplat/sweep/check.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr double kVerifiedFrames = 4;  // of a run, and the last
constexpr int kLargestSamplers = 64;   // of --samplers

// What a scene file is not to say: what a measuring run is told.
const std::set<std::string> kMeasuring{"--duration",           "--frames", "--verify", "--verify-samples",
                                       "--verify-consecutive", "scene"};

// A command line of `telesplat run`, read.
struct Read {
  RunOptions options;
  options::Table flags = table(options);
  options::Given given;

  Status parse(const std::vector<std::string>& words) {
    auto expanded = expand_scene_file(words, flags);
    if (!expanded) return expanded.error();
    options::Parser parser("");
    parser.add(flags);
    if (const Status s = parser.parse("telesplat tune", std::move(*expanded)); !s) return s;
    given = parser.given();
    return ok_status();
  }
  bool gives(const std::string& flag) const { return std::find(given.begin(), given.end(), flag) != given.end(); }
  std::string text(const std::string& flag) const {
    const options::Row* row = options::find(flags, flag);
    return row ? options::text_of(*row) : std::string();
  }
  double number(const std::string& flag, double otherwise) const {
    const std::string value = text(flag);
    return value.empty() ? otherwise : std::strtod(value.c_str(), nullptr);
  }
  bool fits(const std::string& flag, scene::Kind kind) const {
    const options::Row* row = options::find(flags, flag);
    return row && row->fits.has(kind);
  }
};

std::vector<std::string> front_words(const TuneRequest& r) {
  std::vector<std::string> out{r.scene};
  out.insert(out.end(), r.flags.begin(), r.flags.end());
  for (const std::string& link : r.links) out.push_back("--link=" + link);
  return out;
}

bool names(const std::vector<std::string>& words, const std::string& flag) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return word == flag || word.starts_with(flag + "="); });
}

bool is_julia_parameter(const std::string& name) {
  const auto infos = julia::parameter_infos();
  return name.starts_with("c.") ||
         std::any_of(infos.begin(), infos.end(), [&](const auto& info) { return info.name == name; });
}

// Where a key of a scene file stands.
std::pair<std::string, std::string> place_of(const options::Row& row) {
  const std::string name = options::name_of(row).substr(2);
  if (name.starts_with("packing.")) return {"packing", name.substr(8)};
  if (name == "preset" || name == "c" || name == "animate") return {"scene", name};
  if (is_julia_parameter(name)) return {"julia", name};
  return {row.fits == scene::Kinds::all() ? "view" : "scene", options::key_of(row)};
}

std::string whole_path(const std::string& path) {
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) return path;
  return fs::absolute(path, error).lexically_normal().string();
}

void keep_keys(const Read& read, const Read& file, TuneSubject& out) {
  for (const std::string& flag : read.given) {
    const options::Row* row = options::find(read.flags, flag);
    if (!row) continue;
    if (!row->not_in_scene.empty()) continue;
    if (kMeasuring.contains(options::name_of(*row)) && !file.gives(flag)) continue;
    if (std::holds_alternative<std::vector<std::string>*>(row->value) || flag == "scene") continue;
    const auto [group, key] = place_of(*row);
    const std::string text = options::text_of(*row);
    out.keys[group][key] = row->is_file ? whole_path(text) : text;
  }
  if (out.kind == scene::Kind::kJulia)
    out.keys["scene"]["kind"] = "julia";
  else
    out.keys["scene"]["file"] = whole_path(read.options.data.scene);
}

void set_defaults(const Read& read, TuneSubject& out) {
  TuneSettings& d = out.defaults;
  d.samplers = int(read.number("--samplers", 1));
  d.tile_px = int(read.number("--tile-size", 256));
  d.update_rate_hz = read.number("--update-rate", 0);
  if (d.update_rate_hz <= 0) d.update_rate_hz = viewer::RequestOptions{}.max_rate_hz;  // what a run's viewers take then
  d.octree_depth = int(read.number("--octree-depth", double(master::MasterOptions{}.octree_depth)));
  const std::string sampling = read.text("--sampling-size");
  int width = 0, height = 0;
  TuneCosts& c = out.base;
  if (std::sscanf(read.text("--size").c_str(), "%dx%d", &width, &height) == 2)
    c.display_width = width, c.display_height = height, c.display_pixels = double(width) * height;
  d.adaptive = sampling == "auto";
  if (!d.adaptive && std::sscanf(sampling.c_str(), "%dx%d", &width, &height) == 2)
    d.scale = std::clamp(width / c.display_width, 0.05, 1.0);
  c.slices = scene::pipeline_of(out.kind) == scene::Pipeline::kSlices;
  c.polled = read.options.viewer.coupling == "async";
  c.cores = std::max(1, this_machine().cores);
  c.target_fps = read.number("--target-fps", 60);
  c.data_servers = read.options.data_servers, c.viewers = read.options.viewers;
  c.frames_in_flight = int(read.number("--frames-in-flight", 2));
  c.sampler_threads = int(read.number("--sampler-threads", 0));
}

// Only what is free has more than one value.
void set_grid(const Read& read, TuneSubject& out) {
  TuneGrid& g = out.grid;
  const TuneSettings& d = out.defaults;
  g = grid_around(d, int(out.base.cores), kLargestSamplers);
  const auto free = [&](const char* flag) { return !read.gives(flag) && read.fits(flag, out.kind); };
  if (!free("--samplers")) g.samplers = {d.samplers};
  if (!free("--tile-size")) g.tile_px = {d.tile_px};
  if (!free("--octree-depth")) g.octree_depth = {d.octree_depth};
  if (!free("--update-rate") || !out.base.polled) g.update_rate_hz = {d.update_rate_hz};
  // The raster of a volume's slices follows the data.
  if (!free("--sampling-size") || out.base.slices) g.scale.clear();
}

}  // namespace

Result<TuneSubject> look_at(const TuneRequest& request) {
  if (request.scene.empty()) return Error{"a scene is needed: telesplat tune SCENE"};
  if (names(request.flags, "--link")) return Error{"--link: stands in front of --, of the tune itself"};
  TuneSubject out{.request = request};
  Read read, file;
  if (const Status s = read.parse(front_words(request)); !s) return s.error();
  if (request.scene.ends_with(".toml"))
    if (const Status s = file.parse({request.scene}); !s) return s.error();
  for (const char* flag : {"--wall", "--movie", "--out", "--overwrite", "--master"})
    if (read.gives(flag)) return Error{fmt::format("{}: is not for tune, which starts sessions of its own", flag)};
  const bool timed = names(request.flags, "--duration") || names(request.flags, "--frames");
  out.run_s = timed ? read.options.viewer.display.duration_s : request.run_s;
  out.kind = scene::Kind::kMesh;
  Read settled;
  if (const Status s = settled.parse(front_words(request)); !s) return s.error();
  settled.options.out = "run";
  const auto scene = settle(settled.options, settled.given);
  if (!scene) return scene.error();
  if (!*scene) return Error{"a scene is needed: telesplat tune SCENE"};
  out.kind = (*scene)->kind();
  set_defaults(read, out);
  if (out.base.display_pixels <= 0) return Error{"--size: is not the size of a display"};
  set_grid(read, out);
  if (settings_of(out.grid, out.defaults).size() == 1)
    return Error{"nothing is left to tune: the flags give all that could be"};
  if (const auto link = settled.options.links.find(links::Place::kViewer); link != settled.options.links.end())
    out.base.viewer = way_of(link->second), out.link_stated = true;
  if (const auto link = settled.options.links.find(links::Place::kSampler); link != settled.options.links.end())
    out.base.sampler = way_of(link->second);
  const double frames = out.run_s * (out.base.target_fps > 0 ? out.base.target_fps : 60);
  out.verify_every = std::max(2, int(frames / kVerifiedFrames));
  keep_keys(read, file, out);
  // All that the command itself looks at, in the words of a run.
  const auto lasts = check_run([&] {
    auto words = run_words(out, out.defaults, "", true);
    words.erase(words.begin());
    return words;
  }());
  if (!lasts) return lasts.error();
  return out;
}

std::vector<std::string> tuned_flags(const TuneSubject& subject, const TuneSettings& s) {
  const TuneSettings& d = subject.defaults;
  std::vector<std::string> out;
  if (s.samplers != d.samplers) out.push_back(fmt::format("--samplers={}", s.samplers));
  if (s.tile_px != d.tile_px) out.push_back(fmt::format("--tile-size={}", s.tile_px));
  if (s.adaptive != d.adaptive || s.scale != d.scale)
    out.push_back(fmt::format("--sampling-size={:.0f}x{:.0f}", std::ceil(subject.base.display_width * s.scale),
                              std::ceil(subject.base.display_height * s.scale)));
  if (s.octree_depth != d.octree_depth) out.push_back(fmt::format("--octree-depth={}", s.octree_depth));
  if (s.update_rate_hz != d.update_rate_hz)
    out.push_back(fmt::format("--update-rate={}", options::number_text(s.update_rate_hz)));
  return out;
}

std::string words(const TuneSubject& subject, const TuneSettings& settings) {
  std::string out;
  for (std::string flag : tuned_flags(subject, settings)) {
    flag = flag.substr(2);
    std::replace(flag.begin(), flag.end(), '=', ' ');
    out += (out.empty() ? "" : ", ") + flag;
  }
  return out.empty() ? "defaults" : out;
}

std::vector<std::string> run_words(const TuneSubject& subject, const TuneSettings& settings, const std::string& out,
                                   bool verified) {
  const auto& flags = subject.request.flags;
  std::vector<std::string> words{"run"};
  for (const std::string& word : front_words(subject.request)) words.push_back(word);
  for (const std::string& flag : tuned_flags(subject, settings)) words.push_back(flag);
  if (!names(flags, "--duration") && !names(flags, "--frames"))
    words.push_back("--duration=" + options::number_text(subject.run_s));
  if (!names(flags, "--record-points")) words.emplace_back("--record-points=0");
  if (verified && !names(flags, "--verify")) words.push_back(fmt::format("--verify={}", subject.verify_every));
  if (verified && subject.request.quick && !names(flags, "--verify-samples") && !subject.base.slices)
    words.emplace_back("--verify-samples=4");
  if (!out.empty()) words.push_back("--out=" + out);
  return words;
}

}  // namespace telesplat::launcher
