// One row a flag. A table says what the command line takes, what a child process is told, what a TOML file may hold,
// which scenes a flag fits, and what --help prints. A program's table is a function of its options struct: Table
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

/// A value of any other type: read from text, written as text. read's error says what is wrong with the value, without
/// naming the flag.
struct Text {
  std::function<Status(const std::string&)> read;
  std::function<std::string()> write;
};

/// Where the value lies; pointers are into the struct that the table was made for. An empty optional was not given. A
/// bool is a flag that is there or not ("!--no-cache": it sets false), or a switch that takes on or off if its row says
/// so.
using Value = std::variant<bool*, int*, uint64_t*, double*, std::string*, std::optional<double>*, std::optional<int>*,
                           std::vector<std::string>*, Text>;

/// least <= value <= most; NaN is neither.
struct Range {
  double least, most;
};
using Names = std::vector<std::string>;                        ///< one of them
using Check = std::function<std::string(const std::string&)>;  ///< empty: fine; else what is wrong
using Limits = std::variant<std::monostate, Range, Names, Check>;

/// Who is told of a flag beside the command line that has it.
enum class Reach {
  kHere,     ///< nobody
  kChild,    ///< the process that the launcher starts
  kRecorded  ///< the process, and the run's session.toml
};

struct Row {
  std::string flag;  ///< "--z-scale"; "--a,--b": two names of one; without dashes: an argument by its place
  Value value;
  std::string help;
  Limits limits = {};
  scene::Kinds fits = scene::Kinds::all();  ///< of another kind of scene the flag is refused
  Reach reach = Reach::kChild;
  std::string group = {};         ///< heading in --help
  bool seldom = false;            ///< few need it: --help all shows it, --help does not
  std::string default_text = {};  ///< in --help, where the value itself does not tell
  bool on_off = false;            ///< of a bool: takes on or off
  bool is_file = false;           ///< a file, beside the scene file that names it
  bool required = false;
  std::string environment = {};   ///< variable that is looked at where the flag is not given
  std::string not_in_scene = {};  ///< what a scene file, which may be a stranger's, does not say; empty: it may set it
};

using Table = std::vector<Row>;

/// Both, one after the other.
Table joined(Table a, Table b);
/// The rows whose name is not in `without`.
Table without(Table table, const std::vector<std::string>& flags);

/// "--z-scale" of "--z-scale,--height"; "--no-cache" of "!--no-cache".
std::string name_of(const Row& row);
/// All of them: {"--z-scale", "--height"}.
std::vector<std::string> names_of(const Row& row);
/// "z_scale": the key of a TOML file.
std::string key_of(const Row& row);
const Row* find(const Table& table, const std::string& flag);

/// The value as text that the flag takes; of a flag without value "true" or "false"; empty: not given.
std::string text_of(const Row& row);
/// Gives the row's value. Error: "--flag TEXT: what is wrong", within the row's limits.
Status set(const Row& row, const std::string& text);
/// The same refusals; the value stays as it is, unless its type is Text.
Status check(const Row& row, const std::string& text);

/// A number as people write it, without exponent: "0.00001", "1000000". The shortest that reads back the same.
std::string number_text(double number);

/// What another process must be told so that its options equal `table`'s: rows that differ from the same rows of
/// `defaults` (what that process takes without being told), of Reach::kChild or more: "--flag=value" or "--flag".
std::vector<std::string> arguments(const Table& table, const Table& defaults);
/// Rows of Reach::kRecorded that differ from `defaults`, as lines "key = value" of TOML. Paths are made absolute.
std::string recorded(const Table& table, const Table& defaults);

/// A text as TOML has it, quoted; what is not UTF-8 is replaced.
std::string quoted(const std::string& text);

/// What a command line gave: names of flags.
using Given = std::vector<std::string>;
/// Error: the first given flag that does not fit a scene of `kind`, and why. what: the scene's name.
Status refuse_misfits(const Table& table, const Given& given, scene::Kind kind, const std::string& what);

}  // namespace telesplat::options
