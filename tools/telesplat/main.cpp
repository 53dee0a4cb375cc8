// telesplat: the launcher. `run` starts a whole pipeline on this machine and records it, `view` shows it in a window.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/telesplat/bench_scaling.h"
#include "tools/telesplat/compare_command.h"
#include "tools/telesplat/control_client.h"
#include "tools/telesplat/inspect_command.h"
#include "tools/telesplat/presets_command.h"
#include "tools/telesplat/run_command.h"
#include "tools/telesplat/scene_file.h"

namespace {

using namespace telesplat;

// "NAME=VALUE" of `set`, the timeline of `animate`.
Result<std::map<std::string, std::string>> control_arguments(const std::string& command,
                                                             const std::vector<std::string>& given) {
  std::map<std::string, std::string> out;
  if (command == "set") {
    if (given.empty()) return Error{"ctl set: needs NAME=VALUE, such as c.y=0.3"};
    for (const auto& a : given) {
      const size_t equals = a.find('=');
      if (equals == std::string::npos || equals == 0)
        return Error{fmt::format("ctl set: \"{}\" is not NAME=VALUE, such as c.y=0.3", a.substr(0, 80))};
      const std::string name = a.substr(0, equals);
      const auto value = julia::read_value(name, a.substr(equals + 1));
      if (!value) return Error{"ctl set: " + value.error().text};
      out[name] = fmt::format("{}", *value);
    }
  } else if (command == "animate") {
    if (given.size() != 1) return Error{"ctl animate: needs one timeline, such as c.y=-0.4:0.4:10s, or off"};
    if (given.front() != "off")
      if (const auto timeline = julia::parse_timeline(given.front()); !timeline) return timeline.error();
    out["timeline"] = given.front();
  } else if (!given.empty()) {
    return Error{fmt::format("ctl {}: takes nothing more, not \"{}\"", command, given.front().substr(0, 80))};
  }
  return out;
}

int control(const std::string& master, const std::string& command, const std::vector<std::string>& given) {
  log::initialise("ctl", "warn");
  const auto arguments = control_arguments(command, given);
  if (!arguments) {
    std::fprintf(stderr, "telesplat: %s\n", arguments.error().text.c_str());
    return 2;
  }
  launcher::ControlClient client(master);
  const auto answer = client.ask(command, 5.0, *arguments);
  if (!answer) {
    std::fprintf(stderr, "telesplat: %s\n", answer.error().text.c_str());
    return 1;
  }
  const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
  std::printf("%s\n", json.is_object() ? json.dump(2).c_str() : answer->c_str());
  return 0;
}

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

  std::string command, master = "tcp://127.0.0.1:7700";
  auto* ctl = app.add_subcommand("ctl", "ask or tell a running session's master");
  ctl->add_option("command", command,
                  "status: who takes part and what they count; stop: end the session; epoch: drop all points; set "
                  "NAME=VALUE...: change a Julia set's parameters; animate TIMELINE: as --animate of run, or off")
      ->required()
      ->check(CLI::IsMember({"status", "stop", "epoch", "set", "animate"}));
  std::vector<std::string> given;
  ctl->add_option("arguments", given, "of set and animate")->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  ctl->add_option("--master", master, "address of the master")->capture_default_str();

  std::string path;
  data::MeshOptions mesh;
  auto* inspect =
      app.add_subcommand("inspect", "tell what a data file, a run folder, a recorded frame or a depth image holds");
  inspect->add_option("path", path, "file or folder")->required();
  inspect->add_option("--cache", mesh.cache_dir, "folder of the chunk store");

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
  launcher::PresetsOptions presets_options;
  auto* presets = app.add_subcommand("presets", "tell or draw the Julia sets that have names");
  launcher::add_presets_flags(*presets, presets_options);

  auto arguments = launcher::expand_scene_file(argc, argv);
  if (!arguments) {
    std::fprintf(stderr, "telesplat: %s\n", arguments.error().text.c_str());
    return 2;
  }
  std::vector<char*> pointers{argv[0]};
  for (auto& a : *arguments) pointers.push_back(a.data());
  net::parse_or_exit(app, int(pointers.size()), pointers.data());
  if (*run) launcher::apply_scene_defaults(*run, run_options);
  if (*view) launcher::apply_scene_defaults(*view, view_options);
  if (*run) return launcher::run(run_options);
  if (*view) return launcher::run(view_options);
  if (*bench) return launcher::bench_scaling(scaling_options);
  if (*presets) return launcher::presets(presets_options);
  if (*compare) return launcher::compare(compare_options);
  if (*ctl) return control(master, command, given);
  return launcher::inspect(path, mesh);
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] { return telesplat_main(argc, argv); });
}
