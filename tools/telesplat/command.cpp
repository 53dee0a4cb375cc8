#include "tools/telesplat/command.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "common/core/version.h"
#include "common/options/complain.h"
#include "common/options/parser.h"

namespace telesplat::launcher {
namespace {

/// The parsers of a tree of commands, beside the commands themselves.
using Parsers = std::vector<std::pair<const Command*, const options::Parser*>>;

void declare(options::Parser& parser, const std::vector<Command>& commands, Parsers& out) {
  for (const Command& command : commands) {
    options::Parser& own = parser.command(command.name, command.help);
    own.add(command.table);
    if (!command.footer.empty()) own.footer(command.footer);
    if (command.run) out.emplace_back(&command, &own);
    declare(own, command.commands, out);
  }
}

// Puts the flags of a scene file behind the command's name.
Status expand(const std::vector<Command>& commands, std::vector<std::string>& arguments) {
  for (const Command& command : commands) {
    if (!command.expand || arguments.empty() || arguments.front() != command.name) continue;
    auto expanded = command.expand({arguments.begin() + 1, arguments.end()}, command.table);
    if (!expanded) return expanded.error();
    arguments.resize(1);
    arguments.insert(arguments.end(), std::make_move_iterator(expanded->begin()),
                     std::make_move_iterator(expanded->end()));
  }
  return ok_status();
}

// `ctl --master ADDRESS status` means `ctl status --master ADDRESS`: flags before a sub-command belong to it.
void put_flags_behind(const std::vector<Command>& commands, std::vector<std::string>& arguments) {
  for (const Command& command : commands) {
    if (command.commands.empty() || arguments.size() < 3 || arguments.front() != command.name) continue;
    if (!arguments[1].starts_with("--") || arguments[1] == "--help") continue;
    const auto is_command = [&](const std::string& word) {
      return std::any_of(command.commands.begin(), command.commands.end(),
                         [&](const Command& c) { return c.name == word; });
    };
    const auto begin = arguments.begin() + 1, named = std::find_if(begin, arguments.end(), is_command);
    if (named != arguments.end()) std::rotate(begin, named, named + 1);
  }
}

// `help ctl pick` means `ctl pick --help`, `help run all` means `run --help all`.
void put_help_behind(std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments.front() != "help") return;
  arguments.erase(arguments.begin());
  const bool all = arguments.size() > 1 && arguments.back() == "all";
  arguments.insert(arguments.end() - (all ? 1 : 0), "--help");
}

}  // namespace

int run_commands(const std::string& program, const std::string& about, const std::vector<Command>& commands,
                 std::vector<std::string> arguments) {
  put_help_behind(arguments);
  if (const Status s = expand(commands, arguments); !s) return complain(s.error());
  put_flags_behind(commands, arguments);
  options::Parser parser(about);
  parser.version(version());
  parser.footer(program + " help COMMAND tells what a command does, and its flags.");
  Parsers parsers;
  declare(parser, commands, parsers);
  parser.parse_or_exit(program, std::move(arguments));
  for (const auto& [command, own] : parsers)
    if (own->chosen()) return command->run(own->given());
  return 2;
}

}  // namespace telesplat::launcher
