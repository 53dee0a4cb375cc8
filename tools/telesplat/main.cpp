// telesplat: the launcher. `run` starts a whole pipeline on this machine and records it, `view` shows it in a window.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/telesplat/bench/cache.h"
#include "tools/telesplat/bench/scaling.h"
#include "tools/telesplat/bench/volume.h"
#include "tools/telesplat/compare/command.h"
#include "tools/telesplat/control/command.h"
#include "tools/telesplat/inspect_command.h"
#include "tools/telesplat/presets_command.h"
#include "tools/telesplat/run/run_command.h"
#include "tools/telesplat/scene/scene_file.h"

namespace {

using namespace telesplat;

int telesplat_main(int argc, char** argv) {
  CLI::App app{"telesplat: explore data sets that are too large for this machine"};
  app.require_subcommand(1);
  app.option_defaults()->multi_option_policy(
      CLI::MultiOptionPolicy::TakeLast);  // the command line wins over a scene file
  launcher::RunOptions run_options;
  auto* run = app.add_subcommand("run", "run the whole pipeline on this machine, headless, and record it");
  launcher::add_run_flags(*run, run_options);
  launcher::RunOptions view_options = launcher::view_defaults();
  auto* view = app.add_subcommand("view", "open a window on a data set, with the whole pipeline on this machine");
  launcher::add_run_flags(*view, view_options);

  launcher::ControlOptions control_options;
  auto* ctl = app.add_subcommand("ctl", "ask or tell a running session's master");
  launcher::add_control_flags(*ctl, control_options);

  std::string path;
  data::MeshOptions mesh;
  auto* inspect =
      app.add_subcommand("inspect", "tell what a data file, a run folder, a recorded frame or a depth image holds");
  inspect->add_option("path", path, "file or folder")->required();
  inspect->add_option("--cache", mesh.cache_dir, "folder of the chunk store");
  std::string raw;
  inspect->add_option("--raw", raw,
                      "a raw volume's size and type, and its spacing: 256x256x256:u8 or 512x512x99:i16be:1,1,2.5");

  launcher::CompareOptions compare_options;
  auto* compare = app.add_subcommand(
      "compare", "draw poses of a recorded run with every kernel and renderer, and directly from the data");
  launcher::add_compare_flags(*compare, compare_options);

  launcher::ScalingOptions scaling_options;
  auto* bench = app.add_subcommand("bench", "measure the pipeline");
  bench->require_subcommand(1);
  auto* scaling = bench->add_subcommand(
      "scaling", "how a Julia set's frame speeds up with the number of samplers, beside table 7.2 of the thesis");
  launcher::add_scaling_flags(*scaling, scaling_options);
  launcher::VolumeBenchOptions volume_options;
  auto* bench_volume = bench->add_subcommand(
      "volume",
      "how fast views of a volume are made with 1-4 samplers and 1-4 viewers, beside tables 7.3 and 7.4 of the thesis");
  launcher::add_volume_bench_flags(*bench_volume, volume_options);
  launcher::CacheBenchOptions cache_options;
  auto* bench_cache = bench->add_subcommand(
      "cache", "what a point model costs, minute by minute of a walk that is replayed without waiting");
  launcher::add_cache_bench_flags(*bench_cache, cache_options);
  launcher::PresetsOptions presets_options;
  auto* presets = app.add_subcommand(
      "presets", "tell the Julia sets and transfer functions that have names, or draw the Julia sets");
  launcher::add_presets_flags(*presets, presets_options);

  auto arguments = launcher::expand_scene_file(argc, argv);
  if (!arguments) {
    std::fprintf(stderr, "telesplat: %s\n", arguments.error().text.c_str());
    return 2;
  }
  std::vector<char*> pointers{argv[0]};
  for (auto& a : *arguments) pointers.push_back(a.data());
  net::parse_or_exit(app, int(pointers.size()), pointers.data());
  if (*run) return launcher::run(*run, run_options);
  if (*view) return launcher::run(*view, view_options);
  if (*bench_volume) return launcher::bench_volume(volume_options);
  if (*bench_cache) return launcher::bench_cache(cache_options);
  if (*bench) return launcher::bench_scaling(scaling_options);
  if (*presets) return launcher::presets(presets_options);
  if (*compare) return launcher::compare(compare_options);
  if (*ctl) return launcher::control(control_options);
  return launcher::inspect(path, mesh, raw);
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] { return telesplat_main(argc, argv); });
}
