#include "tools/telesplat/report/reading/loose_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "common/core/check.h"
#include "common/core/utf8.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

constexpr size_t kLongestText = 200, kLongestLine = size_t{64} << 10;
constexpr double kMost = 1e12;  // beyond it nothing was measured: no moment, size or number that a run can have

double number_of(const std::string& text) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = read.ec == std::errc() && read.ptr == text.data() + text.size() && std::abs(value) <= kMost;
  return good ? value : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

Result<LooseTable> LooseTable::read(const std::string& path, const std::vector<std::string>& numbers,
                                    const std::vector<std::string>& texts) {
  const auto table = tools::CsvTable::read(
      path, {.rows = std::numeric_limits<size_t>::max(), .line_bytes = kLongestLine, .lenient = true});
  if (!table) return table.error();
  LooseTable out;
  out.rows_ = table->rows();
  out.damaged_ = table->damaged();
  out.header_ = table->header();
  const auto place = [&](const auto& names, auto& columns, const auto& nothing) {
    std::vector<std::pair<size_t, decltype(&columns.begin()->second)>> found;
    for (const auto& name : names) {
      auto& column = columns[name];
      column.resize(out.rows_, nothing);
      if (const auto at = table->find(name)) found.emplace_back(*at, &column);
    }
    return found;
  };
  const auto number_columns = place(numbers, out.numbers_, std::numeric_limits<double>::quiet_NaN());
  const auto text_columns = place(texts, out.texts_, std::string());
  for (size_t row = 0; row < out.rows_; ++row) {
    const auto fields = table->fields(row);
    for (const auto& [at, column] : number_columns) (*column)[row] = number_of(fields[at]);
    // Cut before it is made valid: a character that is cut in two becomes one sign.
    for (const auto& [at, column] : text_columns) (*column)[row] = to_utf8(fields[at].substr(0, kLongestText));
  }
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

const std::vector<std::string>& LooseTable::texts(const std::string& name) const {
  const auto found = texts_.find(name);
  CHECK(found != texts_.end());
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

}  // namespace telesplat::launcher
