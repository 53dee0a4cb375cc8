#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <set>

#include "client/viewer/viewer_options.h"
#include "common/julia/flags.h"
#include "common/options/complain.h"
#include "common/scene/settings.h"
#include "common/wire/limits.h"
#include "services/data/data_options.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/control/orders.h"

namespace telesplat::launcher {
namespace {

using options::Names;
using options::Row;

struct ChangeOptions {
  SessionChoice session;
  const scene::Setting* setting = nullptr;
  std::string value, viewer;
};

// Returns the row of the setting's first flag, as a positional argument. A setting without a flag takes any text.
Row value_row(const ChangeOptions& o) {
  static viewer::ViewerOptions viewer;
  static data::DataOptions data;
  static const options::Table flags = joined(viewer::table(viewer), data::scene_table(data));
  static std::string any;
  Row out{.flag = "ctl " + std::string(o.setting->order), .value = &any, .help = ""};
  const Row* flag = o.setting->flag.empty() ? nullptr : options::find(flags, std::string(o.setting->flag));
  if (!flag) return out;
  const std::string name = out.flag;
  out = *flag;
  out.flag = name;
  return out;
}

bool is_switch(const Row& row) { return std::holds_alternative<bool*>(row.value); }

options::Table change_table(ChangeOptions& o) {
  const Row flag = value_row(o);
  Row value{.flag = "value", .value = &o.value, .help = flag.help, .required = true};
  if (is_switch(flag))
    value.limits = Names{"on", "off"};
  else if (const auto* names = std::get_if<Names>(&flag.limits))
    value.limits = *names;
  if (value.help.empty()) value.help = std::string(o.setting->what);
  options::Table out{std::move(value)};
  if (o.setting->keeper == scene::Keeper::kViewer)
    out.push_back({.flag = "--viewer", .value = &o.viewer, .help = "name of the viewer; default: all that are here"});
  return joined(std::move(out), session_rows(o.session));
}

int change(ChangeOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  const Row flag = value_row(o);
  if (!is_switch(flag))
    if (const Status s = options::check(flag, o.value); !s) return complain(s.error());
  // The launcher may run in another folder.
  if (o.setting->order == "open" && o.value != julia::kSceneWord) {
    std::error_code error;
    o.value = std::filesystem::absolute(o.value, error).lexically_normal().string();
  }
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  std::map<std::string, std::string> arguments{{"value", o.value}};
  if (!o.viewer.empty()) arguments["viewer"] = o.viewer;
  const std::string order(o.setting->order);
  return tell_answer(client->order(order, kPatience_s, arguments), fmt::format("{} {}", order, o.value));
}

struct NoOptions {};

int list(NoOptions, const options::Given&) {
  std::fputs(scene::settings_page().c_str(), stdout);
  return 0;
}

struct CouplingOptions {
  SessionChoice session;
  std::string coupling, viewer;
  std::optional<int> buffers;
};

options::Table table(CouplingOptions& o) {
  return joined({{.flag = "coupling",
                  .value = &o.coupling,
                  .help = "async: the display never waits; sync: each frame waits for its own view update; loose: for "
                          "the next of --buffers; images: of a session from its beginning alone",
                  .limits = options::Names{"async", "sync", "loose", "images"},
                  .required = true},
                 {.flag = "--buffers",
                  .value = &o.buffers,
                  .help = "of loose: view updates that are on their way or complete and not displayed, at most",
                  .limits = options::Range{1, double(wire::kMaxBuffers)},
                  .default_text = "3"},
                 {.flag = "--viewer", .value = &o.viewer, .help = "name of the viewer; default: all that are here"}},
                session_rows(o.session));
}

int order(CouplingOptions o, const options::Given& given) {
  log::initialise("ctl", "warn");
  if (o.buffers && o.coupling != "loose")
    return complain({"--buffers is of loose coupling; " + o.coupling + " has none"});
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  std::map<std::string, std::string> arguments{{"coupling", o.coupling}};
  if (o.buffers) arguments["buffers"] = std::to_string(*o.buffers);
  if (!o.viewer.empty()) arguments["viewer"] = o.viewer;
  return tell_answer(client->order("coupling", kPatience_s, arguments));
}

}  // namespace

std::vector<Command> setting_commands() {
  std::vector<Command> out{make_command<NoOptions>(
      "settings", "what can be changed while a session runs, by which order and widget of a window's panel",
      [](NoOptions&) { return options::Table{}; }, list)};
  std::set<std::string_view> made;
  for (const auto& setting : scene::settings()) {
    const bool here = setting.keeper == scene::Keeper::kViewer || setting.keeper == scene::Keeper::kLauncher;
    if (!here || setting.order == "overlay" || !made.insert(setting.order).second) continue;
    auto o = std::make_shared<ChangeOptions>();
    o->setting = &setting;
    out.push_back(make_command(std::string(setting.order), scene::help_of_order(setting.order), change_table, change,
                               std::move(o)));
  }
  return out;
}

Command coupling_command() { return make_command("coupling", scene::help_of_order("coupling"), table, order); }

}  // namespace telesplat::launcher
