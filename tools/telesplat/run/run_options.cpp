#include "tools/telesplat/run/run_options.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/core/machine.h"
#include "common/image/measures/reference.h"
#include "common/metrics/run_folder.h"
#include "common/net/master_address.h"
#include "common/net/service.h"
#include "common/net/session_file.h"
#include "services/data/kinds.h"
#include "tools/telesplat/run/wall.h"

namespace telesplat::launcher {
namespace {

using options::Range;
using options::Table;

// Time at which a wall's head stands still, so that its tiles can be compared.
constexpr double kWallHold_s = 2;

constexpr const char* kWhatIsKept = "what a run keeps";

// Flags that a person looks for first, by purpose: --help shows these, and --help all the others, too.
struct Purpose {
  const char* group;
  std::vector<std::string_view> flags;
};
const std::vector<Purpose>& purposes() {
  static const std::vector<Purpose> all{
      {"Data",
       {"--room-size", "--up", "--colour-by", "--colour-map", "--z-scale", "--texture", "--clip", "--iso", "--tf",
        "--raw", "--preset", "--animate"}},
      {"Looking", {"--trajectory", "--eye", "--look-at", "--duration", "--fov", "--poses"}},
      {"Display", {"--size", "--fullscreen", "--panel", "--wall", "--stereo", "--xr", "--background", "--shading"}},
      {"Quality", {"--target-fps", "--sampling-size", "--splat", "--renderer"}},
      {"Processes and network", {"--samplers", "--sampler", "--viewers", "--master", "--keys", "--link", "--coupling"}},
      {"Records", {"--out", "--record-every", "--verify", "--movie", "--report"}}};
  return all;
}

// Returns the row's place in the help; sets its group, and whether --help shows it.
size_t place_of(options::Row& row) {
  const std::string name = options::name_of(row);
  size_t place = 0;
  if (!name.starts_with("-")) return place;
  for (const Purpose& purpose : purposes())
    for (const std::string_view flag : purpose.flags) {
      ++place;
      if (flag != name) continue;
      row.group = purpose.group;
      return place;
    }
  row.seldom = true;
  if (row.group.empty()) row.group = "Others";
  return place + 1;
}

Table by_purpose(const Table& table) {
  std::multimap<size_t, options::Row> sorted;
  for (options::Row row : table) {
    const size_t place = place_of(row);
    sorted.emplace(place, std::move(row));
  }
  Table out;
  for (auto& [place, row] : sorted) out.push_back(std::move(row));
  return out;
}

// Returns the rows of `run` or of `view`.
Table display_rows(RunOptions& o) {
  if (o.viewer.window.shown)
    return joined(
        {{.flag = "--out",
          .value = &o.out,
          .help = "run folder; without it nothing is recorded",
          .not_in_scene = "where a run writes"},
         {.flag = "--fullscreen", .value = &o.viewer.window.fullscreen, .help = "the window fills the screen"},
         {.flag = "--panel",
          .value = &o.viewer.window.panel,
          .help = "on: the window begins with its panel, which Tab hides and shows",
          .on_off = true}},
        viewer::xr_table(o.viewer.xr));
  const Table rows{
      {.flag = "--out",
       .value = &o.out,
       .help = "run folder; default: runs/DATE-TIME",
       .not_in_scene = "where a run writes"},
      {.flag = "--viewers",
       .value = &o.viewers,
       .help = "viewers, each of which follows the trajectory; the first one is verified",
       .limits = Range{1, kMaxViewers}},
      {.flag = "--wall",
       .value = &o.viewer.wall.name,
       .help = "a display wall of one viewer a screen: COLUMNSxROWS tiles, each with --size pixels of one picture of "
               "--fov, or the description of one, NAME.toml; its picture at the end becomes images/wall.png",
       .is_file = true}};
  return joined(rows, viewer::wall_table(o.viewer.wall));
}

options::Row metrics_port_row(RunOptions& o) {
  options::Row out = master::metrics_port_row(o.master);
  out.not_in_scene = "whom a session answers";
  return out;
}

options::Row give_up_row(RunOptions& o) {
  options::Row out = net::give_up_row(o.viewer.service.give_up_after_s);
  out.help += "; of a session that is joined (--master)";
  out.not_in_scene = "how long a viewer waits";
  return out;
}

options::Row keys_row(RunOptions& o) {
  options::Row out = net::keys_row(o.keys);
  out.help += "; auto: keys that are made for this run and go with it, or those of your session that is joined";
  out.not_in_scene = "who is let in";
  return out;
}

Table own_rows(RunOptions& o) {
  const auto points = scene::Kinds::of(scene::Pipeline::kPoints);
  return {
      {.flag = "scene", .value = &o.data.scene, .help = data::scene_help() + ", or a scene file (TOML)"},
      {.flag = "--samplers", .value = &o.samplers, .help = "sampler processes", .limits = Range{1, 64}},
      {.flag = "--sampler-threads",
       .value = &o.sampler.threads,
       .help = "threads of each sampler; 0: the cores shared among them",
       .limits = Range{0, 1024}},
      {.flag = "--sampler-memory",
       .value = &o.sampler.memory_mb,
       .help =
           "MB of chunks or voxels that each sampler holds; 0: a quarter of the machine's memory, shared among them",
       .limits = Range{0, 1e7}},
      {.flag = "--data-servers",
       .value = &o.data_servers,
       .help = "processes that each serve a part of a volume",
       .limits = Range{1, 16},
       .fits = {scene::Kind::kVolume}},
      {.flag = "--master",
       .value = &o.join_master,
       .help =
           "join the running session at this address instead of starting one; auto: yours on this machine; default, "
           "where no scene is named: $TELESPLAT_MASTER",
       .not_in_scene = "which session is joined"},
      keys_row(o),
      {.flag = "--overwrite",
       .value = &o.overwrite,
       .help = "the folder of --out may hold a record already: its files are replaced, others stay",
       .not_in_scene = "what a run replaces"},
      metrics_port_row(o),
      {.flag = "--link",
       .value = &o.link_texts,
       .help = "simulate a link of a network: [PLACE:]rtt=40ms,rate=100mbit,jitter=5ms,stall=2s/30s, or shorter "
               "50ms:100mbit, 20mbit, local; PLACE is viewer (default: between each viewer and the rest), sampler "
               "(each sampler and the rest) or data (samplers and data servers)",
       .not_in_scene = "through what network a session runs"},
      {.flag = "--record-depth",
       .value = &o.record_depth,
       .help = "keep the first 50 sampled depth images (telesplat inspect reads them)",
       .fits = points,
       .not_in_scene = kWhatIsKept},
      {.flag = "--report",
       .value = &o.report,
       .help = "at the end make a page about the run, report.html in the run folder (telesplat report)",
       .not_in_scene = kWhatIsKept},
      {.flag = "--verify-samples",
       .value = &o.verify_samples,
       .help = "rays a pixel of the direct rendering that --verify compares with, a square number; volumes have 1",
       .limits = Range{1, image::kMostSamples},
       .fits = points},
      {.flag = "--log-level",
       .value = &o.log_level,
       .help = "trace, debug, info, warn, error or off",
       .limits = options::Names{"trace", "debug", "info", "warn", "error", "off"},
       .not_in_scene = "what is logged"}};
}

// Only --sampler: the launcher chooses threads and memory of samplers.
Table sampler_rows(RunOptions& o) {
  const Table all = sampler::table(o.sampler);
  return {*options::find(all, "--sampler")};
}

// Without a scene, refuses flags that only some scenes have.
Status refuse_scene_flags(RunOptions& o, const options::Given& given) {
  const Table of_scenes = data::scene_table(o.data), of_all = table(o);
  const auto means_nothing = [&](const std::string& flag) {
    if (const auto* row = options::find(of_scenes, flag)) return row->fits != scene::Kinds::all();
    const auto* row = options::find(of_all, flag);
    return row && row->fits == scene::Kinds{scene::Kind::kVolume};
  };
  for (const auto& flag : given)
    if (means_nothing(flag))
      return Error{
          fmt::format("{} is given, but no scene; that of a running session is changed with telesplat ctl set, ctl "
                      "animate and ctl tf",
                      flag)};
  return ok_status();
}

Status settle_wall(RunOptions& o, const options::Given& given) {
  if (o.viewer.wall.name.empty()) {
    for (const char* flag : {"--wall-scale", "--swap-barrier"})
      if (std::find(given.begin(), given.end(), flag) != given.end())
        return Error{fmt::format("{} is given, but no --wall", flag)};
    return ok_status();
  }
  const auto is_given = [&](const char* flag) { return std::find(given.begin(), given.end(), flag) != given.end(); };
  const auto wall = viewer::wall_tile(o.viewer.wall.name, 0, o.viewer.wall.scale);
  if (!wall) return wall.error();
  if (wall->tiles() > kMaxViewers)
    return Error{fmt::format("--wall {}: it has {} {}; at most {}", o.viewer.wall.name, wall->tiles(),
                             wall->described ? "screens" : "tiles", kMaxViewers)};
  for (const char* flag : {"--size", "--fov"})
    if (wall->described && is_given(flag))
      return Error{fmt::format("{}: the screens of {} have their own; --wall-scale draws fewer pixels", flag,
                               o.viewer.wall.name)};
  if (!wall->described && is_given("--wall-scale"))
    return Error{fmt::format("--wall-scale: --wall {} is no description; --size is its tiles'", o.viewer.wall.name)};
  if (!is_given("--viewers")) o.viewers = wall->tiles();
  if (!is_given("--hold")) o.viewer.display.span.hold_s = kWallHold_s;
  if (o.viewers == wall->tiles()) return ok_status();
  return Error{fmt::format("--viewers {}: a wall of {} has {}", o.viewers, o.viewer.wall.name, wall->tiles())};
}

// Refuses a flag that records into a folder, if there is no folder.
Status refuse_records_without_folder(const RunOptions& o) {
  const auto& d = o.viewer.display;
  for (const auto& [asked, flag] : {std::pair{d.kept.verify_every > 0, "--verify"},
                                    {d.kept.picture_every > 0, "--record-every"},
                                    {d.kept.exr, "--exr"},
                                    {o.record_depth, "--record-depth"},
                                    {!o.movie.file.empty(), "--movie"},
                                    {o.report, "--report"}})
    if (asked && o.out.empty())
      return Error{fmt::format("{} needs --out: nothing is recorded without a run folder", flag)};
  return ok_status();
}

// A viewer that joins is told by its session.
bool shows_pictures(const RunOptions& o) { return o.viewer.coupling.mode == "images" && o.join_master.empty(); }

namespace fs = std::filesystem;

// True if `file` is this path, or lies in the folder of this path.
bool is_or_holds(const fs::path& path, const fs::path& file) {
  return std::mismatch(path.begin(), path.end(), file.begin(), file.end()).first == path.end();
}

}  // namespace

Status check_pictures(const RunOptions& o, const Scene* scene) {
  if (!shows_pictures(o) || !scene || scene->pipeline() == scene::Pipeline::kPoints) return ok_status();
  return Error{fmt::format("--coupling images: {} is {}, which comes as slice images; pictures are of {}", o.data.scene,
                           scene::described(scene->kind()), "meshes and Julia sets")};
}

namespace {

// A movie needs the record.
Status check_movie(const RunOptions& o, const options::Given& given) {
  if (o.movie.file.empty()) {
    for (const char* flag : {"--movie-fps", "--movie-size"})
      if (std::find(given.begin(), given.end(), flag) != given.end())
        return Error{fmt::format("{} is given, but no --movie", flag)};
    return ok_status();
  }
  if (!o.join_master.empty())
    return Error{
        "--movie needs a session of its own: the record of a joined one is its master's; telesplat movie RUN "
        "FILE makes a movie of it afterwards"};
  if (shows_pictures(o))
    return Error{"--movie and --coupling images: a movie is drawn of recorded points, and pictures leave none"};
  if (o.viewer.record.points_mb == 0) return Error{"--movie needs the record that --record-points 0 leaves out"};
  return ok_status();
}

Status check_report(const RunOptions& o) {
  if (!o.report || o.join_master.empty()) return ok_status();
  return Error{
      "--report needs a session of its own: the record of a joined one is its master's; telesplat report RUN makes a "
      "report of it afterwards"};
}

// If a place is given twice, the last one counts, as with other flags.
Status settle_links(RunOptions& o) {
  for (const auto& text : o.link_texts) {
    const auto placed = links::parse_placed(text);
    if (!placed) return Error{"--link " + placed.error().text};
    o.links[placed->place] = placed->link;
  }
  std::erase_if(o.links, [](const auto& l) { return l.second.is_local(); });
  const bool joins = !o.join_master.empty();
  for (const auto& [place, link] : o.links)
    if (joins && place != links::Place::kViewer)
      return Error{fmt::format("--link {}:{}: a session that is joined has its own {}", name_of(place),
                               links::text_of(link), place == links::Place::kData ? "data servers" : "samplers")};
  return ok_status();
}

// Returns arguments for a program with these options, without those that equal its defaults.
template <class Options>
std::vector<std::string> arguments(Options o) {
  Options defaults;
  return options::arguments(table(o), table(defaults));
}

}  // namespace

RunOptions view_defaults() {
  RunOptions o;
  o.viewer.window.shown = true;
  return o;
}

Table table(RunOptions& o) {
  const Table own = joined(joined(own_rows(o), display_rows(o)), movie_rows(o.movie));
  const Table launcher = joined(joined(own, sampler_rows(o)), {give_up_row(o)});
  const Table services = joined(data::scene_table(o.data), viewer::view_table(o.viewer));
  // Limits for a service that strangers use; all processes of this session belong to the person.
  const Table limits = without(joined(master::limit_table(o.master), net::peer_limit_table(o.master.service)),
                               {"--max-peers", "--max-messages", "--queue-limit-mb"});
  const Table of_master = joined(joined(master::record_table(o.master), limits), master::session_table(o.master));
  return by_purpose(joined(joined(launcher, services), of_master));
}

Result<std::shared_ptr<Scene>> settle(RunOptions& o, const options::Given& given) {
  std::shared_ptr<Scene> out;
  if (o.data.scene.empty()) {
    if (o.join_master.empty()) o.join_master = net::master_from_environment();
    // A window may begin with nothing: the person opens something there.
    if (o.join_master.empty() && !(o.viewer.window.shown && o.out.empty()))
      return Error{"a scene is needed: a mesh or volume file, a folder of DICOM slices, or the word julia"};
    if (const Status s = refuse_scene_flags(o, given); !s) return s.error();
  } else {
    auto scene = scene_of(o.data);
    if (!scene) return scene.error();
    if (const Status s = options::refuse_misfits(table(o), given, (*scene)->kind(), o.data.scene); !s) return s.error();
    out = std::move(*scene);
    if (o.join_master.empty())
      if (const Status s = out->check(); !s) return s.error();
  }
  if (o.join_master.empty() && o.viewer.service.give_up_after_s > 0)
    return Error{"--give-up-after is given, but no --master: what a session of its own lacks is started again"};
  if (const Status s = settle_wall(o, given); !s) return s.error();
  if (const Status s = settle_links(o); !s) return s.error();
  if (const Status s = refuse_records_without_folder(o); !s) return s.error();
  if (const Status s = check_pictures(o, out.get()); !s) return s.error();
  if (const Status s = check_movie(o, given); !s) return s.error();
  if (const Status s = check_report(o); !s) return s.error();
  if (const Status s = image::validate_samples(o.verify_samples); !s)
    return Error{"--verify-samples: " + s.error().text};
  if (const Status s = viewer::settle(o.viewer); !s) return s.error();
  o.viewer.window.launched = o.viewer.window.shown && o.join_master.empty();
  o.viewer.window.begins_empty = o.viewer.window.launched && o.data.scene.empty();
  return out;
}

std::vector<std::string> master_arguments(const RunOptions& o) {
  auto out = arguments(o.master);
  out.insert(out.end(), {"--bind", "tcp://127.0.0.1:*", "--started-by", o.viewer.window.shown ? "view" : "run"});
  if (!o.out.empty()) out.insert(out.end(), {"--out", o.out});
  if (shows_pictures(o))
    out.insert(out.end(), {"--images", o.viewer.drawing.shading, "--image-background", o.viewer.drawing.background});
  return out;
}

std::vector<std::string> data_arguments(const RunOptions& o, int part) {
  data::DataServiceOptions d = o.data;
  d.companions = "anywhere";  // the files belong to the person, who alone sees them
  d.service.max_connections = o.master.service.max_connections;
  if (o.data_servers > 1) d.volume.part = fmt::format("{}/{}", part, o.data_servers);
  auto out = arguments(d);
  out.push_back("--report-progress");
  return out;
}

std::vector<std::string> packer_arguments(const RunOptions& o) {
  packer::PackerOptions p = o.packer;
  p.service.max_connections = o.master.service.max_connections;
  if (o.record_depth) p.record_depth = o.out + "/depth";
  return arguments(p);
}

std::vector<std::string> sampler_arguments(const RunOptions& o) {
  const int cores = usable_processors();
  sampler::SamplerOptions s = o.sampler;
  if (s.threads == 0) s.threads = std::max(1, cores / o.samplers);
  if (s.memory_mb == 0) s.memory_mb = std::round(usable_memory_mb() / 4 / o.samplers);
  return arguments(s);
}

std::vector<std::string> viewer_arguments(const RunOptions& o, int number, double clock_from_s) {
  viewer::ViewerOptions v = o.viewer;
  v.window.shown = v.window.shown && !v.xr.on;
  if (number != 1) v.display.kept.verify_every = 0;
  if (o.out.empty())
    v.record.join = false;  // a guest without a folder leaves nothing in that of others
  else
    v.record.out = viewer_directory(o.out, number);
  if (!v.wall.name.empty()) v.wall.tile = number - 1;
  v.display.span.clock_from_s = clock_from_s;
  return arguments(v);
}

std::string dated_folder(const std::string& prefix) {
  const std::string first = fmt::format("runs/{}{:%Y%m%d-%H%M%S}", prefix, fmt::localtime(std::time(nullptr)));
  std::string folder = first;
  std::error_code error;
  for (int n = 2; fs::exists(folder, error) && n < 1000; ++n) folder = fmt::format("{}-{}", first, n);
  return folder;
}

Status check_overwrite(const RunOptions& o) {
  if (const Status s = net::refuse_folder_in_use(o.out); !s) return s;
  const auto record = metrics::recorded_files(o.out);
  std::error_code error;
  const fs::path folder = fs::canonical(o.out, error);
  for (const std::string& input : {o.data.scene, o.viewer.head.trajectory, o.data.mesh.elevation.texture,
                                   o.data.volume.transfer, o.data.mesh.colouring.map}) {
    const fs::path path = input.empty() ? fs::path() : fs::canonical(input, error);
    if (path.empty() || is_or_holds(path, folder)) continue;
    if (std::any_of(record.begin(), record.end(), [&](const auto& f) { return is_or_holds(path, folder / f); }))
      return Error{
          fmt::format("{}: is part of the record that --overwrite would remove; copy it elsewhere first, or "
                      "give another --out",
                      input)};
  }
  return ok_status();
}

}  // namespace telesplat::launcher
