// Makes --help, manual pages and shell completion from a program or command with its table of flags.
#pragma once

#include <string>
#include <vector>

#include "common/options/table.h"

namespace telesplat::options {

struct Manual {
  std::string name;   ///< the words that call it: "telesplat run"
  std::string about;  ///< one line; may begin with the name and a colon
  Table table;
  std::string footer;
  std::vector<Manual> commands;
};

/// True if a flag is followed by a value.
bool takes_value(const Row& row);
/// Describes the valid values: "1 to 64", "on or off"; empty if only the help text does.
std::string values_text(const Row& row);
/// The about text without the name, beginning with a small letter.
std::string about_text(const Manual& manual);

/// Text of --help: rows by their groups. all: includes the rows that few users need.
std::string help_text(const Manual& manual, bool all);

/// A manual page (roff, section 1). Commands are its sections; with `separate` they are only named, and have pages of
/// their own. version: for the page's foot.
std::string man_page(const Manual& manual, const std::string& version, bool separate);

enum class Shell { kBash, kZsh, kFish };
/// A script that completes a program's commands, flags and values in a shell: it calls `PROGRAM completion words --
/// WORD...`, which prints candidates().
std::string completion(const std::string& program, Shell shell);
/// Completions of the last of the words that were typed behind the program's name, a line each: the word, a tabulator
/// and its meaning. Empty: anything, such as a file.
std::string candidates(const Manual& program, std::vector<std::string> words);

}  // namespace telesplat::options
