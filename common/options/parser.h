// Tables of flags as a command line.
#pragma once

#include <memory>
#include <string>

#include "common/options/table.h"

namespace telesplat::options {

/// A command line, or one of its sub-commands. Flags that are given twice take the last value.
class Parser {
 public:
  explicit Parser(const std::string& about);
  ~Parser();
  Parser(Parser&&) noexcept;

  /// Adds flags. What the rows point to must outlive parse().
  void add(const Table& table);
  /// A sub-command; one of them is then required. The reference lives as long as this.
  Parser& command(const std::string& name, const std::string& about);
  /// Text at the end of --help.
  void footer(const std::string& text);
  /// What --version tells behind the program's name, and --man, alone, in the foot of the manual page that it prints.
  /// Without it there are no such flags.
  void version(const std::string& text);

  /// --help prints and exits 0 (--help all: what few need, too), bad usage prints "PROGRAM: what is wrong" in one line
  /// and exits 2. program: its name, which may have a path in front. arguments: without it.
  void parse_or_exit(const std::string& program, std::vector<std::string> arguments);

  /// The same for words that a program was given for later: nothing is printed, and the program goes on. called: what a
  /// person would type in front of them. Error: what is wrong, or that they ask for help.
  Status parse(const std::string& called, std::vector<std::string> arguments);

  /// After parsing: whether this sub-command was chosen; the flags and arguments that were given here.
  bool chosen() const;
  Given given() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::options
