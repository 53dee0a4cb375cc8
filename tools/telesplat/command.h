// The commands of telesplat: one row a command holds its name, its help, its flags and its function.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/options/table.h"

namespace telesplat::launcher {

struct Command {
  std::string name, help;
  options::Table table;  ///< its flags
  /// Exit code: 0 done, 1 failed, 2 bad usage or input, 130 interrupted.
  std::function<int(const options::Given&)> run;
  /// Puts a scene file's flags in place of its name in the arguments; null: the command takes no scene file.
  Result<std::vector<std::string>> (*expand)(std::vector<std::string> arguments, const options::Table& table) = nullptr;
  std::string footer;             ///< at the end of --help
  std::vector<Command> commands;  ///< its sub-commands, instead of flags
};

/// Makes a command whose flags fill `o`, an options struct of its own. table: returns the flags' table, which points
/// into the struct.
template <class Options>
Command make_command(const std::string& name, const std::string& help, options::Table (*table)(Options&),
                     int (*run)(Options, const options::Given&),
                     std::shared_ptr<Options> o = std::make_shared<Options>()) {
  Command out{.name = name, .help = help, .table = table(*o), .run = {}};
  out.run = [o, run](const options::Given& given) { return run(*o, given); };
  return out;
}

/// Each has its own file.
Command run_command();
Command view_command();
Command control_command();
Command inspect_command();
Command build_command();
Command compare_command();
Command movie_command();
Command report_command();
Command sweep_command();
Command cache_command();
Command presets_command();
Command autostereo_command();
Command keys_command();

/// Returns `commands`, and two more that describe all of them: completion and man.
std::vector<Command> with_manuals(const std::string& about, std::vector<Command> commands);

/// Runs the command of `program` that the arguments name. --help prints and ends the program with code 0, bad usage
/// with code 2.
int run_commands(const std::string& program, const std::string& about, const std::vector<Command>& commands,
                 std::vector<std::string> arguments);

}  // namespace telesplat::launcher
