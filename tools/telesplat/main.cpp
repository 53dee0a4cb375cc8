// telesplat: the launcher. `run` starts a whole pipeline on this machine and records it, `view` shows it in a window.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/telesplat/compare_command.h"
#include "tools/telesplat/control_client.h"
#include "tools/telesplat/inspect_command.h"
#include "tools/telesplat/run_command.h"
#include "tools/telesplat/scene_file.h"

namespace {

using namespace telesplat;

int control(const std::string& master, const std::string& command) {
  log::initialise("ctl", "warn");
  launcher::ControlClient client(master);
  const auto answer = client.ask(command, 5.0);
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
                  "status: who takes part and what they count; stop: end the session; epoch: drop all points")
      ->required()
      ->check(CLI::IsMember({"status", "stop", "epoch"}));
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

  auto arguments = launcher::expand_scene_file(argc, argv);
  if (!arguments) {
    std::fprintf(stderr, "telesplat: %s\n", arguments.error().text.c_str());
    return 2;
  }
  std::vector<char*> pointers{argv[0]};
  for (auto& a : *arguments) pointers.push_back(a.data());
  net::parse_or_exit(app, int(pointers.size()), pointers.data());
  if (*run) return launcher::run(run_options);
  if (*view) return launcher::run(view_options);
  if (*compare) return launcher::compare(compare_options);
  if (*ctl) return control(master, command);
  return launcher::inspect(path, mesh);
}

}  // namespace

int main(int argc, char** argv) {
  return net::guarded_main([&] { return telesplat_main(argc, argv); });
}
