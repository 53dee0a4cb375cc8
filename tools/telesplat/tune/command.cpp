// `telesplat tune SCENE`: measures what computing and the link cost, predicts which settings suit, checks that by short
// runs, and writes a scene file with the choice.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/record/dated_folder.h"
#include "tools/telesplat/run/process_group.h"
#include "tools/telesplat/sweep/check.h"
#include "tools/telesplat/tune/tune.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr double kQuickRun_s = 2.5;

struct TuneOptions {
  std::string scene, out, runs;
  std::vector<std::string> links, flags;
  std::optional<double> run_s;
  bool quick = false, dry_run = false, overwrite = false;
};

std::string default_out(const std::string& scene) {
  const std::string stem = fs::path(scene).stem().string();
  return (stem.empty() ? "scene" : stem) + "-tuned.toml";
}

// Nothing is written over, and what is written can be.
Status check_out(const TuneOptions& o) {
  std::error_code error;
  if (!o.out.ends_with(".toml")) return Error{fmt::format("--out {}: does not end in .toml", o.out)};
  if (fs::exists(o.out, error) && !o.overwrite)
    return Error{fmt::format("--out {}: is there already; --overwrite replaces it", o.out)};
  if (fs::is_directory(o.out, error)) return Error{fmt::format("--out {}: is a folder", o.out)};
  const fs::path folder = fs::absolute(o.out, error).parent_path();
  if (!fs::is_directory(folder, error)) return Error{fmt::format("--out {}: {} is no folder", o.out, folder.string())};
  if (fs::exists(o.runs, error) && !fs::is_empty(o.runs, error))
    return Error{fmt::format("--runs {}: is there already, and not empty", o.runs)};
  return ok_status();
}

void list(const Tune& tune) {
  const auto measuring = tune.measuring();
  std::printf("%zu runs measure costs:\n", measuring.size());
  for (size_t i = 0; i < measuring.size(); ++i)
    std::printf(
        "telesplat %s\n",
        shell_line(run_words(tune.subject(), measuring[i], fmt::format("RUNS/costs-{}", i + 1), false)).c_str());
  const size_t known = settings_of(tune.subject().grid, tune.subject().defaults).size();
  std::printf("%zu settings are predicted; the defaults and at most %d others are checked, %d runs each:\n", known,
              tune.candidates(), tune.repetitions());
  std::printf("telesplat %s\n",
              shell_line(run_words(tune.subject(), tune.subject().defaults, "RUNS/defaults/1", true)).c_str());
}

int carry_out(Tune& tune, const TuneOptions& o) {
  tools::ProgressLine progress;
  const auto end = tune.carry_out(progress);
  progress.close();
  if (!end) return tools::complain(end.error(), 1);
  if (*end == Tune::End::kInterrupted) {
    std::fprintf(stderr, "telesplat: interrupted; no scene file was written, the runs so far are in %s\n",
                 o.runs.c_str());
    return kInterrupted;
  }
  std::printf("%s\n%s\n", table_text(tune.checked(), "").c_str(), tune.choice().sentence.c_str());
  const auto& reasons = tune.choice().reasons;
  for (size_t i = 1; i < reasons.size(); ++i)
    if (i != tune.choice().chosen)
      std::printf("  %s: %s\n", tune.checked()[i].measured.name.c_str(), reasons[i].c_str());
  const std::string text = scene_text(tune.subject(), tune.costs(), tune.checked(), tune.choice());
  if (const Status s = write_whole(o.out, text); !s) return tools::complain(s.error(), 1);
  if (const auto taken = check_run({o.out}); !taken) return tools::complain(taken.error(), 1);
  std::printf("scene file: %s\nruns: %s\n", o.out.c_str(), o.runs.c_str());
  std::fflush(stdout);
  return 0;
}

int tune(TuneOptions o, const options::Given&) {
  log::initialise("telesplat", "warn");
  if (o.scene.starts_with("-")) return tools::complain({"a scene is needed: telesplat tune SCENE"});
  if (o.out.empty()) o.out = default_out(o.scene);
  if (o.runs.empty()) o.runs = dated_folder("tune-");
  TuneRequest request{o.scene, o.links, o.flags, o.run_s.value_or(o.quick ? kQuickRun_s : TuneRequest{}.run_s),
                      o.quick};
  auto subject = look_at(request);
  if (!subject) return tools::complain(subject.error());
  if (const Status s = check_out(o); !s) return tools::complain(s.error());
  std::error_code error;
  const std::string directory = fs::absolute(o.runs, error).lexically_normal().string();
  Tune tune(std::move(*subject), directory, program_directory() + "/telesplat");
  if (o.dry_run) {
    list(tune);
    return 0;
  }
  fs::create_directories(directory, error);
  if (error) return tools::complain({fmt::format("--runs {}: cannot be made: {}", o.runs, error.message())});
  net::install_signal_handlers();
  return carry_out(tune, o);
}

options::Table tune_table(TuneOptions& o) {
  return {
      {.flag = "scene", .value = &o.scene, .help = "as telesplat run takes it", .required = true},
      {.flag = "flags",
       .value = &o.flags,
       .help = "behind --: flags of telesplat run, of every run; what they give is not tuned"},
      {.flag = "--link",
       .value = &o.links,
       .help = "simulate a link of a network in every run, as telesplat run does; it is what the scene is tuned for"},
      {.flag = "--out",
       .value = &o.out,
       .help = "scene file that is written",
       .default_text = "SCENE-tuned.toml in this folder"},
      {.flag = "--overwrite", .value = &o.overwrite, .help = "the file of --out may be there already"},
      {.flag = "--runs", .value = &o.runs, .help = "folder of the runs", .default_text = "runs/tune-DATE-TIME"},
      {.flag = "--seconds",
       .value = &o.run_s,
       .help = "that each run lasts, where the flags behind -- do not say",
       .limits = options::Range{1, 3600},
       .default_text = "6; with --quick 2.5"},
      {.flag = "--quick", .value = &o.quick, .help = "fewer and shorter runs, which tell less"},
      {.flag = "--dry-run", .value = &o.dry_run, .help = "check everything, print what would be run, start none"}};
}

}  // namespace

Command tune_command() {
  Command out = make_command("tune", "choose settings for a scene, this machine and a link by model and short runs",
                             tune_table, tune);
  out.footer =
      "telesplat tune terrain.ply --link 50ms:100mbit\n"
      "telesplat run terrain-tuned.toml     with the choice\n"
      "telesplat tune julia --quick --out coral.toml -- --preset coral --size 1920x1080";
  return out;
}

}  // namespace telesplat::launcher
