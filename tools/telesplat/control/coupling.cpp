#include "common/scene/settings.h"
#include "common/wire/limits.h"
#include "tools/common/complain.h"
#include "tools/telesplat/control/choice.h"
#include "tools/telesplat/control/commands.h"
#include "tools/telesplat/control/orders.h"

namespace telesplat::launcher {
namespace {

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
    return tools::complain({"--buffers is of loose coupling; " + o.coupling + " has none"});
  int exit_code = 0;
  const auto client = reach(o.session, given, exit_code);
  if (!client) return exit_code;
  std::map<std::string, std::string> arguments{{"coupling", o.coupling}};
  if (o.buffers) arguments["buffers"] = std::to_string(*o.buffers);
  if (!o.viewer.empty()) arguments["viewer"] = o.viewer;
  return tell_answer(client->order("coupling", kPatience_s, arguments));
}

}  // namespace

Command coupling_command() { return make_command("coupling", scene::help_of_order("coupling"), table, order); }

}  // namespace telesplat::launcher
