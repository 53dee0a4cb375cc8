#include "tools/telesplat/record/recorded_run.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>

namespace telesplat::launcher {
namespace {

constexpr double kMaxPixels = 64 << 20;  // a comparison keeps some dozen bytes a pixel
constexpr size_t kMaxFrames = 10'000'000, kMaxLine = 1 << 16;

Result<toml::table> read_toml(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error))
    return Error{fmt::format("{}: is not there, so its folder is not that of a finished run", path)};
  try {
    return toml::parse_file(path);
  } catch (const toml::parse_error& e) {
    return Error{fmt::format("{}:{}: {}", path, e.source().begin.line, e.description())};
  }
}

// A finite number that may stand as text: the facts of processes are.
double number(const toml::node_view<const toml::node>& node, double fallback) {
  double out = fallback;
  if (const auto v = node.value<double>())
    out = *v;
  else if (const auto text = node.value<std::string>())
    std::from_chars(text->data(), text->data() + text->size(), out);
  return std::isfinite(out) ? out : fallback;
}

// Fills everything but the frames; the name of the run's own viewer is what it returns.
Result<std::string> read_session(const std::string& path, RecordedRun& run) {
  auto parsed = read_toml(path);
  if (!parsed) return parsed.error();
  const toml::table& table = *parsed;
  const toml::table* viewer = nullptr;
  if (const auto* processes = table["process"].as_array())
    for (const auto& p : *processes)
      if (const auto* t = p.as_table(); !viewer && t && (*t)["role"].value_or(std::string()) == "viewer") viewer = t;
  if (!viewer) return Error{fmt::format("{}: names no viewer, so no frame of that run was displayed", path)};

  const auto fact = [&](const char* key) { return toml::node_view<const toml::node>((*viewer)[key]); };
  const double width = number(fact("width"), 0), height = number(fact("height"), 0);
  for (const double side : {width, height})
    if (!(side >= 1 && side <= geometry::kMaxImageSide) || side != std::floor(side))
      return Error{fmt::format("{}: the viewer's display has {} x {} pixels, limits are 1..{}", path, width, height,
                               geometry::kMaxImageSide)};
  if (width * height > kMaxPixels)
    return Error{fmt::format("{}: the viewer's display has {} x {} pixels, at most {} are compared", path, width,
                             height, kMaxPixels)};
  run.width = int(width), run.height = int(height);
  run.fov_deg = number(table["display"]["fov"], number(fact("fov_deg"), 90));
  if (!(run.fov_deg > 1 && run.fov_deg < 175))
    return Error{fmt::format("{}: the field of view is {} degrees, limits are 1..175", path, run.fov_deg)};
  run.near_m = number(table["display"]["near"], 0.02);
  run.renderer = fact("renderer").value_or(std::string("cpu"));
  run.kernel = fact("splat").value_or(std::string("?"));
  run.sampling_size = fmt::format("{}x{}", number(fact("sampling_width"), 0), number(fact("sampling_height"), 0));
  run.octree_depth = int(std::clamp(number(table["session"]["octree_depth"], 6), 1.0, 10.0));
  run.keeps_redundant = number(table["settings"]["packing.keep_redundant"], 0) != 0;
  const std::string shading = table["display"]["shading"].value_or(std::string("lit"));
  const auto known = image::shading_named(shading);
  if (!known) return Error{fmt::format("{}: shading is \"{}\", not lit, head or unlit", path, shading)};
  run.shading = *known;

  if (table["scene"]["kind"].value_or(std::string()) == julia::kSceneWord) {
    auto julia = read_recorded_julia(run.directory);
    if (!julia) return julia.error();
    run.julia = std::move(*julia);
  }
  run.volume = table["scene"]["kind"].value_or(std::string()) == "volume";
  run.scene = table["scene"]["file"].value_or(std::string());
  run.mesh.room_size_m = number(table["scene"]["room_size"], run.mesh.room_size_m);
  run.mesh.up = table["scene"]["up"].value_or(run.mesh.up);
  if (const auto iso = table["scene"]["iso"].value<double>()) run.mesh.iso = *iso;
  run.mesh.raw = table["scene"]["raw"].value_or(std::string());
  run.mesh.elevation.z_scale = number(table["scene"]["z_scale"], 0);
  run.mesh.elevation.texture = table["scene"]["texture"].value_or(std::string());
  run.mesh.cache_dir = table["scene"]["cache"].value_or(std::string());
  run.mesh.use_cache = !table["scene"]["no_cache"].value_or(false);
  if (!(run.mesh.room_size_m >= 1e-3 && run.mesh.room_size_m <= 1e3))
    return Error{fmt::format("{}: room_size is {} m, limits are 0.001..1000", path, run.mesh.room_size_m)};
  return (*viewer)["name"].value_or(std::string());
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> out;
  for (size_t begin = 0;;) {
    const size_t comma = line.find(',', begin);
    out.push_back(line.substr(begin, comma - begin));
    if (comma == std::string_view::npos) return out;
    begin = comma + 1;
  }
}

Status read_frames(const std::string& path, const std::string& viewer, RecordedRun& run) {
  std::ifstream in(path);
  std::string line;
  const auto next_line = [&] { return bool(std::getline(in, line)) && line.size() <= kMaxLine; };
  if (!in || !next_line()) return Error{fmt::format("{}: is not there or empty: no frame was displayed", path)};

  const std::vector<std::string> wanted{"viewer", "frame", "t_s", "sequence", "points_drawn", "px",
                                        "py",     "pz",    "qw",  "qx",       "qy",           "qz"};
  std::vector<size_t> at;
  const auto header = fields_of(line);
  const size_t columns = header.size();
  for (const auto& name : wanted) {
    const auto found = std::find(header.begin(), header.end(), name);
    if (found == header.end()) return Error{fmt::format("{}: has no column {}", path, name)};
    at.push_back(size_t(found - header.begin()));
  }

  const auto column = [&](const char* name) {
    return size_t(std::find(header.begin(), header.end(), name) - header.begin());
  };
  const size_t detail = column("detail"), epoch = column("epoch");  // none: 1, 0

  size_t row = 1;
  while (next_line()) {
    ++row;
    const auto wrong = [&](const std::string& what) { return Error{fmt::format("{}:{}: {}", path, row, what)}; };
    const auto fields = fields_of(line);
    if (fields.size() != columns) return wrong(fmt::format("{} values instead of {}", fields.size(), columns));
    if (in.eof()) return wrong("the line is cut off");
    if (fields[at[0]] != viewer) continue;
    double v[12] = {};
    for (size_t i = 1; i < wanted.size(); ++i) {
      const auto text = fields[at[i]];
      const auto end = text.data() + text.size();
      const auto read = std::from_chars(text.data(), end, v[i]);
      if (read.ec != std::errc() || read.ptr != end || !std::isfinite(v[i]))
        return wrong(fmt::format("{} is \"{}\", not a number", wanted[i], text.substr(0, 40)));
    }
    for (const int i : {1, 3, 4})
      if (!(v[i] >= 0 && v[i] < 9e15)) return wrong(fmt::format("{} is {}, limits are 0..9e15", wanted[i], v[i]));
    const geometry::Pose pose{{v[5], v[6], v[7]}, {v[8], v[9], v[10], v[11]}};
    DisplayedFrame f{uint64_t(v[1]),   v[2],
                     {uint64_t(v[3])}, 0,
                     uint64_t(v[4]),   geometry::make_camera(pose, run.fov_deg, run.width, run.height, run.near_m)};
    if (const Status s = geometry::validate(f.camera); !s) return wrong(s.error().text);
    if (detail < columns) {
      const auto text = fields[detail];
      const auto read = std::from_chars(text.data(), text.data() + text.size(), f.detail);
      if (read.ec != std::errc() || !(f.detail > 0 && f.detail <= 1))
        return wrong(fmt::format("detail is \"{}\", limits are above 0 and 1", text.substr(0, 40)));
    }
    if (epoch < columns) {
      const auto text = fields[epoch];
      const auto read = std::from_chars(text.data(), text.data() + text.size(), f.epoch.value);
      if (read.ec != std::errc()) return wrong(fmt::format("epoch is \"{}\", not a number", text.substr(0, 40)));
    }
    if (!run.frames.empty()) {
      const DisplayedFrame& before = run.frames.back();
      if (f.number <= before.number)
        return wrong(fmt::format("frame {} does not follow frame {}", f.number, before.number));
      f.replica = before.replica + (f.sequence < before.sequence ? 1 : 0);
    }
    if (run.frames.size() == kMaxFrames) return wrong(fmt::format("more than {} frames", kMaxFrames));
    run.frames.push_back(f);
  }
  if (!in.eof()) return Error{fmt::format("{}:{}: a line of more than {} bytes", path, row + 1, kMaxLine)};
  if (run.frames.empty()) return Error{fmt::format("{}: holds no frame of viewer \"{}\"", path, viewer)};
  return ok_status();
}

}  // namespace

Result<RecordedRun> read_recorded_run(const std::string& directory) {
  RecordedRun run;
  run.directory = directory;
  const auto viewer = read_session(directory + "/session.toml", run);
  if (!viewer) return viewer.error();
  if (const Status s = read_frames(directory + "/frames.csv", *viewer, run); !s) return s.error();
  return run;
}

Result<std::vector<DisplayedFrame>> choose_frames(const RecordedRun& run, int count,
                                                  const std::vector<uint64_t>& numbers) {
  std::vector<DisplayedFrame> out;
  if (!numbers.empty()) {
    for (const uint64_t n : numbers) {
      const auto found =
          std::find_if(run.frames.begin(), run.frames.end(), [&](const auto& f) { return f.number == n; });
      if (found == run.frames.end())
        return Error{fmt::format("--frames {}: {} holds frames {} to {}", n, run.directory, run.frames.front().number,
                                 run.frames.back().number)};
      out.push_back(*found);
    }
    std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
    out.erase(std::unique(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.number == b.number; }),
              out.end());
    return out;
  }
  uint64_t most = 0;
  for (const auto& f : run.frames) most = std::max(most, f.points_drawn);
  std::vector<const DisplayedFrame*> showing;
  for (const auto& f : run.frames)
    if (f.points_drawn > 0 && f.points_drawn >= most / 10) showing.push_back(&f);
  if (showing.empty()) return Error{fmt::format("{}: no frame shows the data set", run.directory)};
  const size_t n = std::min(showing.size(), size_t(count));
  for (size_t i = 0; i < n; ++i) out.push_back(*showing[(2 * i + 1) * showing.size() / (2 * n)]);
  return out;
}

}  // namespace telesplat::launcher
