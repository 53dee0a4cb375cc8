// `telesplat sweep SCENE --vary FLAG=V1,V2,...`: runs a grid over flags of `telesplat run`, each configuration several
// times, each run by the real command in a folder of its own.
#include <fcntl.h>
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "common/core/descriptor.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/version.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/report/report.h"
#include "tools/telesplat/run/process_group.h"
#include "tools/telesplat/run/run_options.h"
#include "tools/telesplat/sweep/sweep.h"
#include "tools/telesplat/sweep/tables.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

struct SweepOptions {
  std::string scene, out;
  std::vector<std::string> vary, flags;
  std::optional<int> repeat, shuffle;
  double run_limit_s = 0, skip_s = 0;
  bool dry_run = false;
};

// Locks the folder against other sweeps as long as the returned file is open.
Result<Descriptor> claim(const std::string& directory) {
  auto file = Descriptor::open_file(directory + "/.sweep.lock", O_RDWR | O_CREAT);
  if (!file.valid()) return Error{fmt::format("{}: cannot be written to", directory)};
  if (!file.lock(LOCK_EX | LOCK_NB)) return Error{fmt::format("{}: another sweep works there", directory)};
  return file;
}

bool asks_for_nothing(const SweepOptions& o) { return o.scene.empty() && o.vary.empty() && o.flags.empty(); }

// Returns the grid of the command line; `before`: the folder's manifest.
Result<Grid> wanted_grid(SweepOptions o, const std::optional<Manifest>& before) {
  // Without a scene, the parser took the first flag behind "--" for the scene.
  if (o.scene.starts_with("-")) o.flags.insert(o.flags.begin(), std::exchange(o.scene, {}));
  Grid out;
  if (before && asks_for_nothing(o)) {
    out = before->grid;
  } else {
    RunOptions run;
    const options::Table flags = table(run);
    out.scene = o.scene, out.flags = o.flags;
    for (const std::string& text : o.vary)
      if (const Status s = add_axis(text, flags, out.axes); !s) return s.error();
    for (const Axis& axis : out.axes)
      if (axis.flag == "scene" && !out.scene.empty())
        return Error{fmt::format("{} is given, and --vary scene too", out.scene)};
  }
  out.repeat = o.repeat.value_or(before ? before->grid.repeat : out.repeat);
  if (o.shuffle)
    out.shuffle = uint64_t(*o.shuffle);
  else if (before)
    out.shuffle = before->grid.shuffle;
  return out;
}

Result<Manifest> manifest_for(const SweepOptions& o, std::optional<Manifest> before) {
  const auto grid = wanted_grid(o, before);
  if (!grid) return grid.error();
  std::error_code error;
  const std::string here = fs::current_path(error).string();
  if (!before) return begin_manifest(*grid, version(), here);
  if (const Status s = extend(*before, *grid); !s) return holds_another(o.out, "sweep", s.error().text);
  if (before->directory != here && !asks_for_nothing(o))
    return Error{fmt::format("{}: was begun in {}, from where paths count; telesplat sweep --out {} goes on", o.out,
                             before->directory, shell_line({o.out}))};
  return std::move(*before);
}

void list(const Sweep& sweep) {
  const auto runs = sweep.to_do();
  const Manifest& m = sweep.manifest();
  std::printf("%zu runs (%zu configurations, %d times each), %zu to do\n", sweep.runs(), m.configurations.size(),
              m.grid.repeat, runs.size());
  for (const NextRun& run : runs) std::printf("telesplat %s\n", shell_line(sweep.command(run)).c_str());
}

// Writes and prints the results; returns the exit code.
Result<int> conclude(const Sweep& sweep, const std::string& directory, double skip_s, tools::ProgressLine& progress) {
  const SweepRecord record = read_record(sweep.manifest(), directory, skip_s);
  if (const Status s = write_whole(directory + "/sweep.csv", to_csv(record)); !s) return s.error();
  if (const Status s = write_whole(directory + "/cells.csv", cells_csv(record)); !s) return s.error();
  // There is no report before a run is done.
  std::string report;
  if (const auto settled = settle_report({.runs = {directory}, .labels = {}, .skip_s = skip_s})) {
    const auto made = make_report(*settled, progress, [] { return false; });
    progress.close();
    if (!made) return made.error();
    report = fmt::format("report: {}\n", made->page);
  }
  std::printf("%s", to_text(record).c_str());
  for (const Noise& n : noises(record)) std::printf("! %s\n", sentence(record, n).c_str());
  if (const std::string few = too_few(record.grid); !few.empty()) std::printf("! %s\n", few.c_str());
  const auto failed = failures(record);
  for (const std::string& f : failed) std::printf("failed: %s\n", f.c_str());
  std::printf("\n%stable: %s/sweep.csv\nmeans, intervals, tests: %s/cells.csv\n", report.c_str(), directory.c_str(),
              directory.c_str());
  std::fflush(stdout);
  return failed.empty() ? 0 : 1;
}

int carry_out(Sweep& sweep, const std::string& directory, double skip_s) {
  tools::ProgressLine progress;
  const size_t to_do = sweep.to_do().size();
  const Manifest& m = sweep.manifest();
  progress.line(fmt::format("{} runs in {} ({} configurations, {} times each){}", sweep.runs(), directory,
                            m.configurations.size(), m.grid.repeat,
                            to_do < sweep.runs() ? fmt::format("; {} are done", sweep.runs() - to_do) : ""));
  if (m.version != version())
    progress.line(fmt::format("telesplat: the sweep was begun with version {}; this is {}", m.version, version()));
  const auto end = sweep.carry_out(progress);
  progress.close();
  if (!end) return complain(end.error(), 1);
  const auto code = conclude(sweep, directory, skip_s, progress);
  if (!code) return complain(code.error(), 1);
  if (*end == Sweep::End::kDone) return *code;
  std::fprintf(stderr, "telesplat: interrupted; %zu of %zu runs are done, telesplat sweep --out %s goes on\n",
               sweep.runs() - sweep.to_do().size(), sweep.runs(), shell_line({directory}).c_str());
  return kInterrupted;
}

// Refuses a folder with other files in it.
Status check_folder(const std::string& directory, bool has_sweep) {
  std::error_code error;
  if (has_sweep || !fs::exists(directory, error)) return ok_status();
  if (!fs::is_directory(directory, error)) return Error{fmt::format("--out {}: is no folder", directory)};
  for (const auto& entry : fs::directory_iterator(directory, error))
    if (entry.path().filename() != ".sweep.lock")
      return Error{fmt::format("--out {}: is not empty, and holds no sweep", directory)};
  return ok_status();
}

int sweep(SweepOptions o, const options::Given&) {
  log::initialise("telesplat", "warn");
  if (o.out.empty()) o.out = dated_folder("sweep-");
  std::error_code error;
  // An absolute path: the sweep may go on from another working folder.
  const std::string directory = fs::absolute(o.out, error).lexically_normal().string();
  auto before = read_manifest(directory);
  if (!before) return complain(before.error());
  if (!*before && asks_for_nothing(o))
    return complain(
        {"a scene is needed, telesplat sweep SCENE --vary FLAG=VALUE,VALUE; or --out FOLDER of a "
         "sweep that shall go on"});
  if (const Status s = check_folder(directory, before->has_value()); !s) return complain(s.error());
  auto manifest = manifest_for(o, std::move(*before));
  if (!manifest) return complain(manifest.error());
  fs::current_path(manifest->directory, error);
  if (error) return complain({fmt::format("{}: the sweep was begun there: {}", manifest->directory, error.message())});
  Sweep sweep(std::move(*manifest), directory, program_directory() + "/telesplat", o.run_limit_s);
  if (const Status s = sweep.check(); !s) return complain(s.error());
  if (o.dry_run) {
    list(sweep);
    return 0;
  }
  fs::create_directories(directory, error);
  if (error) return complain({fmt::format("--out {}: cannot be made: {}", o.out, error.message())});
  const auto claimed = claim(directory);
  if (!claimed) return complain(claimed.error());
  if (const Status s = write_manifest(sweep.manifest(), directory); !s) return complain(s.error());
  net::install_signal_handlers();
  return carry_out(sweep, directory, o.skip_s);
}

options::Table sweep_table(SweepOptions& o) {
  return {
      {.flag = "scene", .value = &o.scene, .help = "as telesplat run takes it; none where --vary scene names several"},
      {.flag = "flags", .value = &o.flags, .help = "behind --: flags of telesplat run, of every run"},
      {.flag = "--vary",
       .value = &o.vary,
       .help =
           "FLAG=VALUE,VALUE,...: a flag of telesplat run and its values, or scene and several; again for another "
           "flag, or more values; with ; between values, commas belong to them; on and off of a flag without value"},
      {.flag = "--out",
       .value = &o.out,
       .help = "folder of the sweep; default: runs/sweep-DATE-TIME; of one that was begun: alone, it goes on"},
      {.flag = "--repeat",
       .value = &o.repeat,
       .help = "runs of each configuration",
       .limits = options::Range{1, kMostRepetitions},
       .default_text = "3"},
      {.flag = "--shuffle",
       .value = &o.shuffle,
       .help = "seed: within a repetition the runs come in an order that it decides",
       .limits = options::Range{0, 2147483647}},
      {.flag = "--run-limit",
       .value = &o.run_limit_s,
       .help = "seconds after which a run has failed; 0: ten times what it is asked to last, and ten minutes",
       .limits = options::Range{0, 1e6}},
      {.flag = "--skip",
       .value = &o.skip_s,
       .help = "seconds after the first displayed frame of each run that figures leave out: its warming up",
       .limits = options::Range{0.0, 1e6}},
      {.flag = "--dry-run", .value = &o.dry_run, .help = "check everything, print the runs, start none"}};
}

}  // namespace

Command sweep_command() {
  Command out =
      make_command("sweep", "run a grid over flags of telesplat run, several times, and compare", sweep_table, sweep);
  out.footer =
      "telesplat sweep terrain.ply --vary coupling=sync,loose,async --vary samplers=1,2 --out sweep -- --duration 20\n"
      "telesplat sweep --out sweep     goes on, if it was interrupted";
  return out;
}

}  // namespace telesplat::launcher
