#include "tools/telesplat/report/reading/loose_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "common/core/check.h"
#include "common/core/utf8.h"
#include "common/core/whole_file.h"
#include "tools/common/csv_table.h"
#include "tools/common/line_reader.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kLongestText = 200, kLongestLine = size_t{64} << 10;
constexpr double kMost = 1e12;  // beyond it nothing was measured: no moment, size or number that a run can have

// The fields of a line, those that were in quotes without them. False: a quoted text does not end.
bool take_apart(std::string_view line, std::vector<std::string_view>& out, std::vector<std::string>& unquoted) {
  out.clear();
  if (line.find('"') == line.npos) {
    for (size_t begin = 0; begin <= line.size();) {
      const size_t end = std::min(line.find(',', begin), line.size());
      out.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
    return true;
  }
  auto fields = tools::csv_fields(line);
  if (!fields) return false;
  unquoted = std::move(*fields);
  out.assign(unquoted.begin(), unquoted.end());
  return true;
}

double number_of(std::string_view text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = read.ec == std::errc() && read.ptr == text.data() + text.size() && std::abs(value) <= kMost;
  return good ? value : std::numeric_limits<double>::quiet_NaN();
}

// Cut before it is made valid: a character that is cut in two becomes one sign.
std::string text_of(std::string_view text) { return to_utf8(text.substr(0, kLongestText)); }

// The header's names without what editors put in front of a file.
void read_header(std::string_view line, std::vector<std::string>& out) {
  if (line.starts_with("\xef\xbb\xbf")) line.remove_prefix(3);
  std::vector<std::string_view> fields;
  std::vector<std::string> unquoted;
  if (take_apart(line, fields, unquoted)) out.assign(fields.begin(), fields.end());
}

}  // namespace

Result<LooseTable> LooseTable::read(const std::string& path, const std::vector<std::string>& numbers,
                                    const std::vector<std::string>& texts) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) || std::filesystem::is_empty(path, error))
    return Error{fmt::format("{}: is not there or is empty", path)};
  if (const Status s = check_readable(path, kMostTableBytes); !s) return s.error();
  std::ifstream in(path, std::ios::binary);

  LooseTable out;
  std::vector<std::pair<size_t, std::vector<double>*>> number_columns;
  std::vector<std::pair<size_t, std::vector<std::string>*>> text_columns;
  const auto place = [&](const std::string& name, auto& column, auto& columns) {
    const auto at = std::find(out.header_.begin(), out.header_.end(), name);
    if (at != out.header_.end()) columns.emplace_back(size_t(at - out.header_.begin()), &column);
  };
  std::vector<std::string_view> fields;
  std::vector<std::string> unquoted;
  tools::LineReader reader(in, kLongestLine);
  while (const auto next = reader.next()) {
    std::string_view line = next->text;
    const bool whole = next->ended && next->left_out == 0;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (out.header_.empty()) {
      if (next->left_out > 0)
        return Error{fmt::format("{}: its first line has more than {} bytes", path, kLongestLine)};
      read_header(line, out.header_);
      for (const auto& name : numbers) place(name, out.numbers_[name], number_columns);
      for (const auto& name : texts) place(name, out.texts_[name], text_columns);
      continue;
    }
    if (!whole || !take_apart(line, fields, unquoted) || fields.size() != out.header_.size()) {
      ++out.damaged_;
      continue;
    }
    ++out.rows_;
    for (const auto& [at, column] : number_columns) column->push_back(number_of(fields[at]));
    for (const auto& [at, column] : text_columns) column->push_back(text_of(fields[at]));
  }
  if (in.bad()) return Error{path + ": cannot be read"};
  for (auto& [name, column] : out.numbers_) column.resize(out.rows_, std::numeric_limits<double>::quiet_NaN());
  for (auto& [name, column] : out.texts_) column.resize(out.rows_);
  return out;
}

bool LooseTable::has(std::string_view name) const {
  return std::find(header_.begin(), header_.end(), name) != header_.end();
}

const std::vector<double>& LooseTable::numbers(const std::string& name) const {
  const auto found = numbers_.find(name);
  CHECK(found != numbers_.end());
  return found->second;
}

void LooseTable::leave_out_below(const std::string& column, double least) {
  const std::vector<double> by = numbers(column);
  const auto cut = [&](auto& values) {
    size_t kept = 0;
    for (size_t row = 0; row < by.size(); ++row)
      if (!(by[row] < least)) std::swap(values[kept++], values[row]);
    values.resize(kept);
    rows_ = kept;
  };
  for (auto& [name, values] : numbers_) cut(values);
  for (auto& [name, values] : texts_) cut(values);
}

const std::vector<std::string>& LooseTable::texts(const std::string& name) const {
  const auto found = texts_.find(name);
  CHECK(found != texts_.end());
  return found->second;
}

}  // namespace telesplat::launcher
