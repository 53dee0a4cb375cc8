// What --help, manual pages and shell completion are made from: a program or command with its table of flags.
#pragma once

#include <string>
#include <vector>

#include "common/options/table.h"

namespace telesplat::options {

struct Manual {
  std::string name;   ///< as it is called: "telesplat run"
  std::string about;  ///< one line; may begin with the name and a colon
  Table table;
  std::string footer;
  std::vector<Manual> commands;
};

/// Whether a flag is followed by a value.
bool takes_value(const Row& row);
/// What a value may be, in words: "1 to 64", "on or off"; empty where only the help text tells.
std::string values_text(const Row& row);
/// The about without the name, and with a small letter.
std::string about_text(const Manual& manual);

/// What --help prints: rows by their groups; all: those that are seldom of use, too.
std::string help_text(const Manual& manual, bool all);

/// A manual page (roff, section 1). Commands are sections of it; with `separate` they are named, and have pages of
/// their own. version: for the page's foot.
std::string man_page(const Manual& manual, const std::string& version, bool separate);

enum class Shell { kBash, kZsh, kFish };
/// A script that completes a program's commands, flags and values in a shell: it asks `PROGRAM completion words --
/// WORD...`, which prints candidates().
std::string completion(const std::string& program, Shell shell);
/// What the last of the words that were typed behind the program's name may become, a line each: the word, a tabulator
/// and what it means. Empty: anything, such as a file.
std::string candidates(const Manual& program, std::vector<std::string> words);

}  // namespace telesplat::options
