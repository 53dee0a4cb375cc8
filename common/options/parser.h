// Parses command lines by tables of flags.
#pragma once

#include <memory>
#include <string>

#include "common/options/table.h"

namespace telesplat::options {

/// A command line, or one of its sub-commands. If a flag is given twice, the last value counts.
class Parser {
 public:
  explicit Parser(const std::string& about);
  ~Parser();
  Parser(Parser&&) noexcept;

  /// Adds flags. The variables that the rows point to must outlive parse().
  void add(const Table& table);
  /// Adds a sub-command; the command line must name one of them. The reference lives as long as this parser.
  Parser& command(const std::string& name, const std::string& about);
  /// Text at the end of --help.
  void footer(const std::string& text);
  /// Text that --version prints behind the program's name, and that --man prints in the foot of the manual page.
  /// Without it these flags do not exist.
  void version(const std::string& text);

  /// --help prints and exits 0 (--help all: also what few users need); bad usage prints "PROGRAM: PROBLEM" in one line
  /// and exits 2. program: its name, perhaps with a path in front. arguments: without the name.
  void parse_or_exit(const std::string& program, std::vector<std::string> arguments);

  /// The same for words that came later: prints nothing and does not exit. called: text that a person would type before
  /// them. Error: the problem, or that they ask for help.
  Status parse(const std::string& called, std::vector<std::string> arguments);

  /// After parsing: true if this sub-command was chosen; the flags and arguments that were given here.
  bool chosen() const;
  Given given() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::options
