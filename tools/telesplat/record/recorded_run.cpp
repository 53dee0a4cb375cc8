#include "tools/telesplat/record/recorded_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "client/viewer/stereo_flags.h"
#include "common/core/whole_file.h"
#include "common/image/background.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/scene/scene_keys.h"

namespace telesplat::launcher {
namespace {

constexpr double kMaxFramePixels = 64 << 20;  // a comparison keeps some dozen bytes a pixel
constexpr tools::CsvTable::Limits kFrames{.rows = 10'000'000, .line_bytes = 1 << 16};

Result<toml::table> read_session(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    return Error{fmt::format("{}: is not there, so its folder is not that of a finished run", path)};
  return read_toml(path, kMostSessionBytes);
}

// Reads a finite number that may stand as text, as in the facts of processes.
double number(const toml::node_view<const toml::node>& node, double fallback) {
  double out = fallback;
  if (const auto v = node.value<double>())
    out = *v;
  else if (const auto text = node.value<std::string>())
    std::from_chars(text->data(), text->data() + text->size(), out);
  return std::isfinite(out) ? out : fallback;
}

std::string text_of(const toml::table& viewer, const char* key) { return viewer[key].value_or(std::string()); }

std::vector<const toml::table*> viewers(const toml::table& session) {
  std::vector<const toml::table*> out;
  if (const auto* processes = session["process"].as_array())
    for (const auto& p : *processes)
      if (const auto* t = p.as_table(); t && text_of(*t, "role") == "viewer") out.push_back(t);
  return out;
}

// Finds the viewer whose frames stand in the run's own record: the launcher's first, else the first that joined.
const toml::table* own_viewer(const toml::table& session) {
  const auto all = viewers(session);
  // Older records do not say where each viewer recorded: take the launcher's first.
  auto first =
      std::find_if(all.begin(), all.end(), [](const toml::table* t) { return text_of(*t, "records_in") == "."; });
  if (first == all.end())
    first =
        std::find_if(all.begin(), all.end(), [](const toml::table* t) { return text_of(*t, "name") == "viewer-1"; });
  return first != all.end() ? *first : all.empty() ? nullptr : all.front();
}

Status read_size(const std::string& path, const toml::table& viewer, RecordedRun& run) {
  const auto fact = [&](const char* key) { return toml::node_view<const toml::node>(viewer[key]); };
  const double width = number(fact("width"), 0), height = number(fact("height"), 0);
  for (const double side : {width, height})
    if (!(side >= 1 && side <= geometry::kMaxImageSide) || side != std::floor(side))
      return Error{fmt::format("{}: the viewer's display has {} x {} pixels, limits are 1..{}", path, width, height,
                               geometry::kMaxImageSide)};
  if (width * height > kMaxFramePixels)
    return Error{fmt::format("{}: the viewer's display has {} x {} pixels, at most {} are compared", path, width,
                             height, kMaxFramePixels)};
  run.width = int(width), run.height = int(height);
  return ok_status();
}

// Returns the record's own copy of a file, if it has one.
std::string kept_or(const std::string& session, const char* name, const std::string& file) {
  const std::string kept = (std::filesystem::path(session).parent_path() / name).string();
  std::error_code error;
  return std::filesystem::is_regular_file(kept, error) ? kept : file;
}
std::string described_in(const std::string& session, const std::string& wall) {
  return viewer::is_description(wall) ? kept_or(session, "wall.toml", wall) : wall;
}

// Reads the viewer's part of the wall.
Status read_wall(const std::string& path, const toml::table& viewer, RecordedRun& run) {
  const std::string text = viewer["wall"].value_or(std::string());
  if (text.empty()) return ok_status();
  const double tile = number(toml::node_view<const toml::node>(viewer["wall_tile"]), 0),
               scale = number(toml::node_view<const toml::node>(viewer["wall_scale"]), 1);
  if (!(scale > 0 && scale <= 1)) return Error{fmt::format("{}: wall_scale is {}, limits are 0 and 1", path, scale)};
  const auto wall = viewer::wall_tile(described_in(path, text), int(std::clamp(tile, -1.0, 1e6)), scale);
  if (!wall) return Error{fmt::format("{}: {}", path, wall.error().text)};
  run.wall = *wall;
  return ok_status();
}

// Reads how the two eyes' pictures were shown.
Status read_stereo(const std::string& path, const toml::table& session, RecordedRun& run) {
  const auto& display = session["display"];
  viewer::StereoFlags flags;
  flags.mode = display["stereo"].value_or(std::string("off"));
  flags.eye_separation_m = number(display["eye_separation"], flags.eye_separation_m);
  flags.swap_eyes = display["swap_eyes"].value_or(std::string("off")) == "on";
  flags.pattern = display["stereo_pattern"].value_or(std::string("off"));
  flags.panel_file = display["barrier"].value_or(std::string());
  if (!flags.panel_file.empty()) flags.panel_file = kept_or(path, "barrier.toml", flags.panel_file);
  auto stereo = viewer::settle(flags);
  if (!stereo) return Error{fmt::format("{}: {}", path, stereo.error().text)};
  run.stereo = std::move(*stereo);
  return ok_status();
}

// Reads how the display drew. An unknown kernel is refused when it draws, if ever: volumes have no kernels.
Status read_look(const std::string& path, const toml::table& viewer, RecordedRun& run) {
  if (const auto kernel = splat::kernel_named(run.kernel)) run.look.render.kernel = *kernel;
  const std::string finish = viewer["finish"].value_or(std::string("on"));
  const auto known = splat::finish_named(finish);
  if (!known)
    return Error{fmt::format("{}: finish is \"{}\", not on, off or some of fill,smooth,antialias", path, finish)};
  run.look.render.finish = *known;
  run.look = viewer::first_look(run.look.render, run.shading);
  const float suits = splat::suitable_scale(run.look.render.kernel);
  const auto scale = float(number(toml::node_view<const toml::node>(viewer["splat_scale"]), suits));
  if (!(scale > 0 && scale <= 10))
    return Error{fmt::format("{}: splat_scale is {}, limits are above 0 and 10", path, scale)};
  run.splat_scale = scale == suits ? 0 : scale;
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
  run.keeps_redundant = number(session["settings"]["keep_redundant"], 0) != 0;
  const std::string shading = session["display"]["shading"].value_or(std::string("lit"));
  const auto known = image::shading_named(shading);
  if (!known) return Error{fmt::format("{}: shading is \"{}\", not lit, head or unlit", path, shading)};
  run.shading = *known;
  const auto background = image::parse_background(session["display"]["background"].value_or(std::string("#141820")));
  if (!background) return Error{fmt::format("{}: background of [display]: {}", path, background.error().text)};
  run.shading.background = background->colour;
  run.transparent = background->transparent;
  run.legend = session["display"]["legend"].value_or(std::string("on")) != "off";
  if (const Status s = read_wall(path, viewer, run); !s) return s;
  if (const Status s = read_stereo(path, session, run); !s) return s;
  return read_look(path, viewer, run);
}

// Reads how the frame was drawn, if its row says so; else as the run began.
void read_look(tools::CsvRow& row, viewer::Look& look) {
  const auto kernel = row.count("splat", uint64_t(look.render.kernel), splat::kKernels.size());
  const auto finish = row.count("finish", splat::finish_bits(look.render.finish), 8);
  const bool halved = row.count("halved", 0, 2) == 1;
  look = {.render = {splat::kKernels[kernel], *splat::finish_of_bits(finish), halved},
          .lit = row.count("lit", look.lit, 2) == 1,
          .head_light = row.count("head_light", look.head_light, 2) == 1,
          .background = uint32_t(row.count("background", look.background, 0x1000000))};
}

void read_refinement(tools::CsvRow& row, DisplayedFrame& f) {
  if (!row.has("refined") || !row.has("sub_pixels")) return;
  f.refined = row.number("refined");
  f.sub_pixels = int(row.count("sub_pixels", 5));
  row.demand(f.refined >= 0 && f.refined <= 1, fmt::format("refined is {}, limits are 0 and 1", f.refined));
  row.demand(f.refined <= 0 || f.sub_pixels == 2 || f.sub_pixels == 4,
             fmt::format("sub_pixels is {}, limits are 2 and 4", f.sub_pixels));
}

// Reads the places of the two eyes.
void read_eyes(tools::CsvRow& row, DisplayedFrame& f) {
  for (const char* column : {"left_x", "left_y", "left_z", "right_x", "right_y", "right_z", "screen_m"})
    row.demand(row.has(column), "two eyes saw the frame, but there are no columns that tell where they were");
  f.eyes_room = {glm::dvec3(row.number("left_x"), row.number("left_y"), row.number("left_z")),
                 glm::dvec3(row.number("right_x"), row.number("right_y"), row.number("right_z"))};
  f.screen_m = row.number("screen_m");
  row.demand(f.screen_m > 0 && f.screen_m <= 1e6,
             fmt::format("screen_m is {}, limits are above 0 and 1e6", f.screen_m));
}

Result<DisplayedFrame> read_frame(const tools::CsvTable& table, size_t index, const RecordedRun& run) {
  tools::CsvRow row(table, index);
  DisplayedFrame f;
  f.number = row.count("frame");
  f.sequence = {row.count("sequence")};
  f.points_drawn = row.count("points_drawn");
  f.head = {{row.number("px"), row.number("py"), row.number("pz")},
            {row.number("qw"), row.number("qx"), row.number("qy"), row.number("qz")}};
  f.t_s = row.number("t_s");
  f.shown_s = f.t_s + row.number("construction_ms", 0) / 1e3 + row.number("swap_wait_ms", 0) / 1e3;
  f.summaries = row.count("summaries", f.summaries, 9e15);
  f.epoch = EpochId{row.count("epoch", 0, 9e15)};
  f.detail = row.number("detail", 1);
  row.demand(f.detail > 0 && f.detail <= 1, fmt::format("detail is {}, limits are above 0 and 1", f.detail));
  f.look = run.look;
  read_look(row, f.look);
  read_refinement(row, f);
  if (run.stereo.on()) read_eyes(row, f);
  if (const Status s = row.status(); !s) return s.error();
  f.camera = run.camera_at(f.head, run.width, run.height);
  if (const Status s = geometry::validate(f.camera); !s) return table.wrong(index, s.error().text);
  return f;
}

Status read_frames(const std::string& path, const std::string& viewer, RecordedRun& run) {
  const auto table = tools::CsvTable::read(path, kFrames);
  if (!table) return table.error();
  const auto whose = table->column("viewer");
  if (!whose) return whose.error();
  for (size_t row = 0; row < table->rows(); ++row) {
    if (table->text(row, *whose) != viewer) continue;
    auto f = read_frame(*table, row, run);
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

// Reads the frames that one viewer displayed.
Result<RecordedRun> read_viewer(const std::string& directory, const toml::table& session, const toml::table& viewer) {
  RecordedRun run;
  run.directory = directory;
  if (const Status s = read_display(directory + "/session.toml", session, viewer, run); !s) return s.error();
  auto scene = recorded_scene(directory);
  if (!scene) return scene.error();
  run.scene = std::move(*scene);
  if (const Status s = read_frames(directory + "/frames.csv", text_of(viewer, "name"), run); !s) return s.error();
  return run;
}

// Returns the folder, within the run's, that the viewer recorded in.
std::string folder_of(const toml::table& viewer) {
  const std::string told = text_of(viewer, "records_in");
  return told.empty() ? text_of(viewer, "name") : told;
}

// Returns the viewers of the wall's tiles, in their order.
Result<std::vector<const toml::table*>> wall_viewers(const std::string& path, const toml::table& session,
                                                     const std::string& wall) {
  const auto whole = viewer::wall_tile(described_in(path, wall), 0, 1);
  if (!whole) return Error{fmt::format("{}: {}", path, whole.error().text)};
  std::vector<const toml::table*> out(size_t(whole->tiles()));
  for (const toml::table* t : viewers(session)) {
    const double tile = number(toml::node_view<const toml::node>((*t)["wall_tile"]), -1);
    const std::string name = folder_of(*t);
    if (text_of(*t, "wall") != wall || !(tile >= 0 && tile < whole->tiles())) continue;
    const bool folder = name == "." || (!name.empty() && name.front() != '.' && name.find('/') == name.npos);
    if (!folder) return Error{fmt::format("{}: a viewer recorded in {:?}, which is no folder in it", path, name)};
    out[size_t(tile)] = t;
  }
  for (size_t i = 0; i < out.size(); ++i)
    if (!out[i]) return Error{fmt::format("{}: names no viewer of the wall's tile {}", path, i)};
  return out;
}

}  // namespace

geometry::Camera RecordedRun::camera_at(const geometry::Pose& pose, int width_px, int height_px) const {
  const stereo::Size eye = stereo.eye_size(width_px, height_px);
  if (wall.described) {
    geometry::Camera camera = wall::screen_camera(*wall.described, wall.tile, pose, near_m);
    camera.width = eye.width, camera.height = eye.height;
    return camera;
  }
  return viewer::tile_of(geometry::make_camera(pose, fov_deg, eye.width * wall.columns, eye.height * wall.rows, near_m),
                         wall);
}

Result<RecordedRun> read_recorded_run(const std::string& directory) {
  const std::string path = directory + "/session.toml";
  const auto session = read_session(path);
  if (!session) return session.error();
  const toml::table* viewer = own_viewer(*session);
  if (!viewer) return Error{fmt::format("{}: names no viewer, so no frame of that run was displayed", path)};
  return read_viewer(directory, *session, *viewer);
}

Result<std::vector<RecordedRun>> read_recorded_displays(const std::string& directory) {
  const std::string path = directory + "/session.toml";
  const auto session = read_session(path);
  if (!session) return session.error();
  const toml::table* own = own_viewer(*session);
  if (!own) return Error{fmt::format("{}: names no viewer, so no frame of that run was displayed", path)};
  std::vector<const toml::table*> all{own};
  if (const std::string wall = text_of(*own, "wall"); !wall.empty()) {
    auto found = wall_viewers(path, *session, wall);
    if (!found) return found.error();
    all = std::move(*found);
  }
  std::vector<RecordedRun> out;
  for (const toml::table* viewer : all) {
    auto run = read_viewer(directory, *session, *viewer);
    if (!run) return run.error();
    if (!out.empty() && !run->wall.described && (run->width != out.front().width || run->height != out.front().height))
      return Error{fmt::format("{}: the wall's tile {} has {}x{} pixels, its first {}x{}", path, out.size(), run->width,
                               run->height, out.front().width, out.front().height)};
    if (viewer != own) run->directory += "/" + folder_of(*viewer);
    out.push_back(std::move(*run));
  }
  return out;
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
