#include "tools/telesplat/record/recorded_run.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr double kMaxPixels = 64 << 20;  // a comparison keeps some dozen bytes a pixel
constexpr tools::CsvTable::Limits kFrames{.rows = 10'000'000, .line_bytes = 1 << 16};

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

// The viewer whose frames the run's own record has.
const toml::table* own_viewer(const toml::table& session) {
  if (const auto* processes = session["process"].as_array())
    for (const auto& p : *processes)
      if (const auto* t = p.as_table(); t && (*t)["role"].value_or(std::string()) == "viewer") return t;
  return nullptr;
}

Status read_size(const std::string& path, const toml::table& viewer, RecordedRun& run) {
  const auto fact = [&](const char* key) { return toml::node_view<const toml::node>(viewer[key]); };
  const double width = number(fact("width"), 0), height = number(fact("height"), 0);
  for (const double side : {width, height})
    if (!(side >= 1 && side <= geometry::kMaxImageSide) || side != std::floor(side))
      return Error{fmt::format("{}: the viewer's display has {} x {} pixels, limits are 1..{}", path, width, height,
                               geometry::kMaxImageSide)};
  if (width * height > kMaxPixels)
    return Error{fmt::format("{}: the viewer's display has {} x {} pixels, at most {} are compared", path, width,
                             height, kMaxPixels)};
  run.width = int(width), run.height = int(height);
  return ok_status();
}

Status read_display(const std::string& path, const toml::table& session, const toml::table& viewer, RecordedRun& run) {
  const auto fact = [&](const char* key) { return toml::node_view<const toml::node>(viewer[key]); };
  if (const Status s = read_size(path, viewer, run); !s) return s;
  run.fov_deg = number(session["display"]["fov"], number(fact("fov_deg"), 90));
  if (!(run.fov_deg > 1 && run.fov_deg < 175))
    return Error{fmt::format("{}: the field of view is {} degrees, limits are 1..175", path, run.fov_deg)};
  run.near_m = number(session["display"]["near"], 0.02);
  run.renderer = fact("renderer").value_or(std::string("cpu"));
  run.kernel = fact("splat").value_or(std::string("?"));
  run.sampling_size = fmt::format("{}x{}", number(fact("sampling_width"), 0), number(fact("sampling_height"), 0));
  run.octree_depth = int(std::clamp(number(session["session"]["octree_depth"], 6), 1.0, 10.0));
  run.keeps_redundant = number(session["settings"]["packing.keep_redundant"], 0) != 0;
  const std::string shading = session["display"]["shading"].value_or(std::string("lit"));
  const auto known = image::shading_named(shading);
  if (!known) return Error{fmt::format("{}: shading is \"{}\", not lit, head or unlit", path, shading)};
  run.shading = *known;
  return ok_status();
}

// Fills everything but the frames. Returns the name of the run's own viewer.
Result<std::string> read_session(const std::string& path, RecordedRun& run) {
  const auto session = read_toml(path);
  if (!session) return session.error();
  const toml::table* viewer = own_viewer(*session);
  if (!viewer) return Error{fmt::format("{}: names no viewer, so no frame of that run was displayed", path)};
  if (const Status s = read_display(path, *session, *viewer, run); !s) return s.error();
  auto scene = recorded_scene(run.directory);
  if (!scene) return scene.error();
  run.scene = std::move(*scene);
  return (*viewer)["name"].value_or(std::string());
}

// The columns of frames.csv that make a frame again.
struct FrameColumns {
  size_t viewer, frame, t_s, sequence, points_drawn;
  std::array<size_t, 7> pose;           // px py pz qw qx qy qz
  std::optional<size_t> detail, epoch;  // not there: 1, 0
};

Result<FrameColumns> find_columns(const tools::CsvTable& table) {
  FrameColumns out{};
  const std::pair<const char*, size_t*> wanted[] = {{"viewer", &out.viewer},
                                                    {"frame", &out.frame},
                                                    {"t_s", &out.t_s},
                                                    {"sequence", &out.sequence},
                                                    {"points_drawn", &out.points_drawn},
                                                    {"px", &out.pose[0]},
                                                    {"py", &out.pose[1]},
                                                    {"pz", &out.pose[2]},
                                                    {"qw", &out.pose[3]},
                                                    {"qx", &out.pose[4]},
                                                    {"qy", &out.pose[5]},
                                                    {"qz", &out.pose[6]}};
  for (const auto& [name, column] : wanted) {
    const auto found = table.column(name);
    if (!found) return found.error();
    *column = *found;
  }
  out.detail = table.find("detail");
  out.epoch = table.find("epoch");
  return out;
}

Result<DisplayedFrame> read_frame(const tools::CsvTable& table, size_t row, const FrameColumns& at,
                                  const RecordedRun& run) {
  const auto number = table.count(row, at.frame), sequence = table.count(row, at.sequence),
             drawn = table.count(row, at.points_drawn);
  for (const auto* count : {&number, &sequence, &drawn})
    if (!*count) return count->error();
  double v[8] = {};
  for (size_t i = 0; i < 8; ++i) {
    const auto value = table.number(row, i < 7 ? at.pose[i] : at.t_s);
    if (!value) return value.error();
    v[i] = *value;
  }
  const geometry::Pose pose{{v[0], v[1], v[2]}, {v[3], v[4], v[5], v[6]}};
  DisplayedFrame f{*number, v[7],   {*sequence},
                   0,       *drawn, geometry::make_camera(pose, run.fov_deg, run.width, run.height, run.near_m)};
  if (const Status s = geometry::validate(f.camera); !s) return table.wrong(row, s.error().text);
  if (at.detail) {
    const auto detail = table.number(row, *at.detail);
    if (!detail) return detail.error();
    if (!(*detail > 0 && *detail <= 1))
      return table.wrong(row, fmt::format("detail is {}, limits are above 0 and 1", *detail));
    f.detail = *detail;
  }
  if (at.epoch) {
    const auto epoch = table.count(row, *at.epoch);
    if (!epoch) return epoch.error();
    f.epoch = EpochId{*epoch};
  }
  return f;
}

Status read_frames(const std::string& path, const std::string& viewer, RecordedRun& run) {
  const auto table = tools::CsvTable::read(path, kFrames);
  if (!table) return table.error();
  const auto at = find_columns(*table);
  if (!at) return at.error();
  for (size_t row = 0; row < table->rows(); ++row) {
    if (table->text(row, at->viewer) != viewer) continue;
    auto f = read_frame(*table, row, *at, run);
    if (!f) return f.error();
    if (!run.frames.empty()) {
      const DisplayedFrame& before = run.frames.back();
      if (f->number <= before.number)
        return table->wrong(row, fmt::format("frame {} does not follow frame {}", f->number, before.number));
      f->replica = before.replica + (f->sequence < before.sequence ? 1 : 0);
    }
    run.frames.push_back(*f);
  }
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
