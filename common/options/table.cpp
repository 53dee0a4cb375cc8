#include "common/options/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>

#include "common/core/utf8.h"
#include "common/options/suggest.h"

namespace telesplat::options {
namespace {

// The shortest text that reads back as the same number.
std::string text_of_number(double v) { return fmt::format("{}", v); }

template <class T>
Result<T> read_number(const std::string& text, const char* what) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + (text.starts_with('+') ? 1 : 0), end, value);
  if (stop == end && error == std::errc::result_out_of_range) return Error{"is too large or too small a number"};
  if constexpr (std::is_same_v<T, uint64_t>)  // counts of points: "20e6"
    if (const auto number = read_number<double>(text, what); error == std::errc() && *stop == 'e' && number)
      if (*number == std::floor(*number) && *number >= 0 &&
          *number < static_cast<double>(std::numeric_limits<T>::max()))
        return static_cast<T>(*number);
  if (error != std::errc() || stop != end) return Error{fmt::format("is not {}", what)};
  return value;
}

std::string complain(const Limits& limits, const std::string& text) {
  if (const auto* range = std::get_if<Range>(&limits)) {
    const auto value = read_number<double>(text, "a number");
    if (!value || !(*value >= range->least && *value <= range->most))
      return fmt::format("is not between {} and {}", number_text(range->least), number_text(range->most));
  } else if (const auto* names = std::get_if<Names>(&limits)) {
    if (std::find(names->begin(), names->end(), text) == names->end())
      return fmt::format("is not one of {}{}", fmt::join(*names, ", "), did_you_mean(text, *names));
  } else if (const auto* check = std::get_if<Check>(&limits)) {
    return (*check)(text);
  }
  return {};
}

template <class T>
Status read_into(T& out, const std::string& text, const char* what) {
  const auto value = read_number<T>(text, what);
  if (!value) return value.error();
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(*value)) return Error{"is not a finite number"};
  out = *value;
  return ok_status();
}

struct Reader {
  const std::string& text;
  bool clears;  // a flag that sets false
  Status operator()(bool* v) const {
    if (text != "on" && text != "off" && text != "true" && text != "false") return Error{"is neither on nor off"};
    *v = (text == "on" || text == "true") != clears;
    return ok_status();
  }
  Status operator()(int* v) const { return read_into(*v, text, "a whole number"); }
  Status operator()(uint64_t* v) const { return read_into(*v, text, "a whole number of 0 or more"); }
  Status operator()(double* v) const { return read_into(*v, text, "a number"); }
  Status operator()(std::string* v) const {
    *v = text;
    return ok_status();
  }
  Status operator()(std::optional<double>* v) const { return read_into(v->emplace(), text, "a number"); }
  Status operator()(std::optional<int>* v) const { return read_into(v->emplace(), text, "a whole number"); }
  Status operator()(std::vector<std::string>* v) const {
    v->push_back(text);
    return ok_status();
  }
  Status operator()(const Text& v) const { return v.read(text); }
};

struct Writer {
  bool clears, on_off;
  std::string operator()(const bool* v) const {
    if (on_off) return *v ? "on" : "off";
    return *v != clears ? "true" : "false";
  }
  std::string operator()(const int* v) const { return std::to_string(*v); }
  std::string operator()(const uint64_t* v) const { return std::to_string(*v); }
  std::string operator()(const double* v) const { return text_of_number(*v); }
  std::string operator()(const std::string* v) const { return *v; }
  std::string operator()(const std::optional<double>* v) const { return *v ? text_of_number(**v) : std::string(); }
  std::string operator()(const std::optional<int>* v) const { return *v ? std::to_string(**v) : std::string(); }
  std::string operator()(const std::vector<std::string>* v) const { return fmt::format("{}", fmt::join(*v, ",")); }
  std::string operator()(const Text& v) const { return v.write(); }
};

bool clears(const Row& row) { return row.flag.starts_with("!"); }
bool is_plain_flag(const Row& row) { return std::holds_alternative<bool*>(row.value) && !row.on_off; }
bool is_number(const Row& row) {
  return std::holds_alternative<int*>(row.value) || std::holds_alternative<uint64_t*>(row.value) ||
         std::holds_alternative<double*>(row.value) || std::holds_alternative<std::optional<double>*>(row.value) ||
         std::holds_alternative<std::optional<int>*>(row.value);
}

// Text before a flag's name, as in "only volumes have --tf".
std::string owners(const Row& row) {
  if (row.fits == scene::Kinds{scene::Kind::kVolume}) return "only volumes have";
  if (row.fits == scene::Kinds{scene::Kind::kJulia}) return "only Julia sets have";
  if (row.fits == scene::Kinds{scene::Kind::kMesh}) return "only meshes have";
  if (row.fits == scene::Kinds{scene::Kind::kMesh, scene::Kind::kVolume}) return "only meshes and volumes have";
  return "others have";
}

}  // namespace

std::string number_text(double number) {
  std::array<char, 512> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed).ptr;
  return {text.data(), end};
}

Table joined(Table a, Table b) {
  a.insert(a.end(), std::make_move_iterator(b.begin()), std::make_move_iterator(b.end()));
  return a;
}

Table without(Table table, const std::vector<std::string>& flags) {
  std::erase_if(table,
                [&](const Row& row) { return std::find(flags.begin(), flags.end(), name_of(row)) != flags.end(); });
  return table;
}

std::string name_of(const Row& row) {
  const std::string first = row.flag.substr(0, row.flag.find(','));
  return clears(row) ? first.substr(1) : first;
}

std::vector<std::string> names_of(const Row& row) {
  std::vector<std::string> out;
  for (size_t at = clears(row) ? 1 : 0; at <= row.flag.size();) {
    const size_t comma = std::min(row.flag.find(',', at), row.flag.size());
    out.push_back(row.flag.substr(at, comma - at));
    at = comma + 1;
  }
  return out;
}

std::string key_of(const Row& row) {
  std::string key = name_of(row);
  key.erase(0, key.find_first_not_of('-'));
  std::replace(key.begin(), key.end(), '-', '_');
  return key;
}

const Row* find(const Table& table, const std::string& flag) {
  for (const Row& row : table) {
    const std::string names = fmt::format(",{},", row.flag.substr(clears(row) ? 1 : 0));
    if (names.find(fmt::format(",{},", flag)) != std::string::npos) return &row;
  }
  return nullptr;
}

std::string text_of(const Row& row) { return std::visit(Writer{clears(row), row.on_off}, row.value); }

Status set(const Row& row, const std::string& text) {
  const auto wrong = [&](const std::string& why) {
    return Error{fmt::format("{} {}: {}", name_of(row), text.empty() ? "\"\"" : text.substr(0, 200), why)};
  };
  // A text that is not a number is reported as such, before its range is checked.
  if (const std::string why = is_number(row) ? std::string() : complain(row.limits, text); !why.empty())
    return wrong(why);
  if (is_number(row)) {
    if (const std::string why = complain(row.limits, text); !why.empty() && read_number<double>(text, ""))
      return wrong(why);
  }
  if (const Status s = std::visit(Reader{text, clears(row)}, row.value); !s) return wrong(s.error().text);
  return ok_status();
}

namespace {

// Checks with a row of the same type, whose value is discarded.
template <class T>
Status check_as(Row row, const std::string& text) {
  T scratch{};
  row.value = &scratch;
  return set(row, text);
}

}  // namespace

Status check(const Row& row, const std::string& text) {
  return std::visit(
      [&](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_pointer_v<T>)
          return check_as<std::remove_pointer_t<T>>(row, text);
        else
          return set(row, text);
      },
      row.value);
}

std::vector<std::string> arguments(const Table& table, const Table& defaults) {
  std::vector<std::string> out;
  for (const Row& row : table) {
    if (row.reach == Reach::kHere) continue;
    const std::string name = name_of(row), value = text_of(row);
    const Row* usual = find(defaults, name);
    if (usual && text_of(*usual) == value) continue;
    if (is_plain_flag(row)) {
      if (value == "true") out.push_back(name);
    } else if (!name.starts_with("-")) {
      out.push_back(value);
    } else if (const auto* many = std::get_if<std::vector<std::string>*>(&row.value)) {
      for (const auto& one : **many) out.push_back(fmt::format("{}={}", name, one));
    } else {
      out.push_back(fmt::format("{}={}", name, value));
    }
  }
  return out;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : to_utf8(text)) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 32 || c == 127 ? ' ' : c;
  }
  return out + '"';
}

std::string recorded(const Table& table, const Table& defaults) {
  std::string out;
  for (const Row& row : table) {
    if (row.reach != Reach::kRecorded) continue;
    std::string value = text_of(row);
    const Row* usual = find(defaults, name_of(row));
    if (usual && text_of(*usual) == value) continue;
    if (is_plain_flag(row)) {
      out += fmt::format("{} = {}\n", key_of(row), value);
    } else if (is_number(row)) {
      out += fmt::format("{} = {}\n", key_of(row), value);
    } else {
      std::error_code error;
      if (row.is_file && std::filesystem::exists(value, error))
        value = std::filesystem::absolute(value, error).string();
      out += fmt::format("{} = {}\n", key_of(row), options::quoted(value));
    }
  }
  return out;
}

Status refuse_misfits(const Table& table, const Given& given, scene::Kind kind, const std::string& what) {
  for (const auto& flag : given) {
    const Row* row = find(table, flag);
    if (!row || row->fits.has(kind)) continue;
    const auto described = scene::described(kind);
    if (row->fits == scene::Kinds::of(scene::Pipeline::kPoints))
      return Error{fmt::format("{}: {} is {}, which is not drawn from points", flag, what, described)};
    return Error{fmt::format("{}: {} is {}; {} {}", flag, what, described, owners(*row), flag)};
  }
  return ok_status();
}

}  // namespace telesplat::options
