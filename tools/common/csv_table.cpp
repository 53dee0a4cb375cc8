#include "tools/common/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "common/core/whole_file.h"

namespace telesplat::tools {
namespace {

// Calls take(text) for each field; a quoted one comes without its quotes. take returns whether to go on. False: a quote
// that does not end, or text after one.
template <class Take>
bool each_field(std::string_view line, Take&& take) {
  std::string field;
  enum { kBegin, kPlain, kQuoted, kAfterQuote } state = kBegin;
  for (const char c : line) {
    if (state == kQuoted) {
      if (c == '"')
        state = kAfterQuote;
      else
        field += c;
    } else if (c == ',') {
      if (!take(field)) return true;
      field.clear();
      state = kBegin;
    } else if (c == '"' && state != kPlain) {
      if (state == kAfterQuote) field += '"';
      state = kQuoted;
    } else if (state == kAfterQuote) {
      return false;
    } else {
      field += c;
      state = kPlain;
    }
  }
  if (state == kQuoted) return false;
  take(field);
  return true;
}

std::optional<double> finite(const std::string& text) {
  double value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string out_of(std::string_view column, double value, double end) {
  const std::string most = end >= 9e15 ? "9e15" : fmt::format("{}", end - 1);
  return fmt::format("{} is {}, limits are 0..{}", column, value, most);
}

}  // namespace

std::optional<std::vector<std::string>> csv_fields(std::string_view line) {
  std::vector<std::string> out;
  const auto keep = [&](const std::string& field) {
    out.push_back(field);
    return true;
  };
  if (!each_field(line, keep)) return std::nullopt;
  return out;
}

Result<CsvTable> CsvTable::read(const std::string& path, const Limits& limits) {
  CsvTable out;
  out.path_ = path;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return Error{fmt::format("{}: is not there", path)};
  auto content = read_whole(path, kMostTableBytes);
  if (!content) return content.error();
  if (content->empty()) return Error{fmt::format("{}: is empty", path)};
  out.bytes_ = *std::move(content);

  for (size_t begin = 0, number = 1; begin < out.bytes_.size(); ++number) {
    const size_t end = std::min(out.bytes_.find('\n', begin), out.bytes_.size()), place = begin;
    std::string_view line(out.bytes_.data() + begin, end - begin);
    begin = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    const std::string wrong = number == 1 ? out.take_header(line, limits) : out.problem(line, limits);
    if (number > 1 && limits.lenient && (!wrong.empty() || end == out.bytes_.size())) {
      ++out.damaged_;
      continue;
    }
    if (!wrong.empty()) return Error{fmt::format("{}:{}: {}", path, number, wrong)};
    if (number == 1) continue;
    if (end == out.bytes_.size()) return Error{fmt::format("{}:{}: the line is cut off", path, number)};
    if (out.lines_.size() == limits.rows)
      return Error{fmt::format("{}:{}: more than {} rows", path, number, limits.rows)};
    out.lines_.push_back({place, line.size()});
  }
  return out;
}

// Says why a line cannot be read; empty: it can.
std::string CsvTable::problem(std::string_view line, const Limits& limits) const {
  if (line.size() > limits.line_bytes) return fmt::format("a line of more than {} bytes", limits.line_bytes);
  size_t fields = 0;
  if (!each_field(line, [&](const std::string&) { return ++fields > 0; })) return "a quoted text that does not end";
  return fields == header_.size() ? "" : fmt::format("{} values instead of {}", fields, header_.size());
}

// Does the same for the first line. Editors put a byte order mark in front of it.
std::string CsvTable::take_header(std::string_view line, const Limits& limits) {
  if (line.starts_with("\xef\xbb\xbf")) line.remove_prefix(3);
  if (line.size() <= limits.line_bytes) header_ = csv_fields(line).value_or(std::vector<std::string>());
  for (size_t i = 0; i < header_.size(); ++i) places_.emplace(header_[i], i);
  return problem(line, limits);
}

std::optional<size_t> CsvTable::find(std::string_view name) const {
  const auto found = places_.find(name);
  return found == places_.end() ? std::nullopt : std::optional(found->second);
}

Result<size_t> CsvTable::column(std::string_view name) const {
  if (const auto found = find(name)) return *found;
  return Error{fmt::format("{}: has no column {}", path_, name)};
}

std::string CsvTable::text(size_t row, size_t column) const {
  std::string out;
  each_field(line(row), [&, i = size_t{0}](const std::string& field) mutable {
    if (i++ == column) out = field;
    return i <= column;
  });
  return out;
}

Result<double> CsvTable::number(size_t row, size_t column) const {
  const std::string field = text(row, column);
  if (const auto value = finite(field)) return *value;
  return wrong(row, fmt::format("{} is \"{}\", not a number", header_[column], field.substr(0, 40)));
}

Result<uint64_t> CsvTable::count(size_t row, size_t column, double end) const {
  const auto value = number(row, column);
  if (!value) return value.error();
  if (*value >= 0 && *value < end) return uint64_t(*value);
  return wrong(row, out_of(header_[column], *value, end));
}

std::vector<double> CsvTable::numbers(size_t column) const {
  std::vector<double> out;
  for (size_t row = 0; row < rows(); ++row) out.push_back(finite(text(row, column)).value_or(0));
  return out;
}

void CsvRow::demand(bool good, const std::string& what) {
  if (!good && !wrong_) wrong_ = table_.wrong(row_, what);
}

std::string CsvRow::text(std::string_view column) const {
  const auto at = table_.find(column);
  return at ? fields_[*at] : std::string();
}

std::map<std::string, double> CsvRow::numbers() const {
  std::map<std::string, double> out;
  for (size_t i = 0; i < fields_.size(); ++i)
    if (const auto value = finite(fields_[i])) out[table_.header()[i]] = *value;
  return out;
}

double CsvRow::number(std::string_view column) {
  const auto at = table_.column(column);
  if (!at && !wrong_) wrong_ = at.error();
  if (!at) return 0;
  const auto value = finite(fields_[*at]);
  if (!value) demand(false, fmt::format("{} is \"{}\", not a number", column, fields_[*at].substr(0, 40)));
  return value.value_or(0);
}

uint64_t CsvRow::count(std::string_view column, double end) {
  const double value = number(column);
  if (value >= 0 && value < end) return uint64_t(value);
  demand(false, out_of(column, value, end));
  return 0;
}

Error CsvTable::wrong(size_t row, const std::string& what) const {
  return Error{fmt::format("{}:{}: {}", path_, row + 2, what)};
}

}  // namespace telesplat::tools
