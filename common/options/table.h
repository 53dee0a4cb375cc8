// One row a flag. A table lists the flags of the command line, those for a child process, those of a TOML file, the
// scenes that each flag fits, and the text of --help. A program's table is a function of its options struct: Table
// table(Options&).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/core/result.h"
#include "common/scene/kind.h"

namespace telesplat::options {

/// A value of any other type: read from text, written as text. The error of read states the problem with the value,
/// without naming the flag.
struct Text {
  std::function<Status(const std::string&)> read;
  std::function<std::string()> write;
};

/// Pointer to the value, in the struct that the table was made for. An empty optional means "not given". A bool is a
/// flag that is present or not ("!--no-cache": it sets false), or a switch that takes on or off if its row has on_off.
using Value = std::variant<bool*, int*, uint64_t*, double*, std::string*, std::optional<double>*, std::optional<int>*,
                           std::vector<std::string>*, Text>;

/// least <= value <= most; false for NaN.
struct Range {
  double least, most;
};
using Names = std::vector<std::string>;                        ///< one of them is valid
using Check = std::function<std::string(const std::string&)>;  ///< returns the problem; empty: the value is valid
using Limits = std::variant<std::monostate, Range, Names, Check>;

/// Destinations of a flag beyond the command line that has it.
enum class Reach {
  kHere,     ///< no other process
  kChild,    ///< the process that the launcher starts
  kRecorded  ///< the process, and the run's session.toml
};

struct Row {
  std::string flag;  ///< "--z-scale"; "--a,--b": two names; without dashes: an argument by its position
  Value value;
  std::string help;
  Limits limits = {};
  scene::Kinds fits = scene::Kinds::all();  ///< with other kinds of scenes the flag is refused
  Reach reach = Reach::kChild;
  std::string group = {};         ///< heading in --help
  bool seldom = false;            ///< few users need it: --help all shows it, --help does not
  std::string default_text = {};  ///< in --help, if the value itself is not readable
  bool on_off = false;            ///< for a bool: takes on or off
  bool is_file = false;           ///< a file; its path is relative to the scene file that names it
  bool required = false;
  std::string environment = {};   ///< variable that is read if the flag is not given
  std::string not_in_scene = {};  ///< reason why a scene file, perhaps a stranger's, must not set it; or empty
};

using Table = std::vector<Row>;

/// Joins both, one after the other.
Table joined(Table a, Table b);
/// The rows whose name is not in `without`.
Table without(Table table, const std::vector<std::string>& flags);

/// "--z-scale" of "--z-scale,--height"; "--no-cache" of "!--no-cache".
std::string name_of(const Row& row);
/// All names: {"--z-scale", "--height"}.
std::vector<std::string> names_of(const Row& row);
/// "z_scale": the key of a TOML file.
std::string key_of(const Row& row);
const Row* find(const Table& table, const std::string& flag);

/// The value as text that the flag takes; for a flag without value "true" or "false"; empty: not given.
std::string text_of(const Row& row);
/// Sets the row's value, within its limits. Error: "--flag TEXT: PROBLEM".
Status set(const Row& row, const std::string& text);
/// Checks a text as set() does; the value does not change, unless its type is Text.
Status check(const Row& row, const std::string& text);

/// A number as people write it, without exponent: "0.00001", "1000000". The shortest that reads back the same.
std::string number_text(double number);

/// Arguments that give another process the options of `table`: rows of Reach::kChild or more that differ from the same
/// rows of `defaults` (that process' defaults), as "--flag=value" or "--flag".
std::vector<std::string> arguments(const Table& table, const Table& defaults);
/// Rows of Reach::kRecorded that differ from `defaults`, as lines "key = value" of TOML. Paths become absolute.
std::string recorded(const Table& table, const Table& defaults);

/// Quotes a text for TOML; replaces bytes that are not UTF-8.
std::string quoted(const std::string& text);

/// Names of the flags that a command line gave.
using Given = std::vector<std::string>;
/// Error: names the first given flag that does not fit a scene of `kind`, and the reason. what: the scene's name.
Status refuse_misfits(const Table& table, const Given& given, scene::Kind kind, const std::string& what);

}  // namespace telesplat::options
