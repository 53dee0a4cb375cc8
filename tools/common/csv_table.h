// Tables of comma-separated values that processes of a session wrote: epochs.csv, frames.csv, tiles.csv.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::tools {

/// The fields of a line; texts may be in quotes, where they hold commas, with "" for a quote (RFC 4180, within one
/// line). Nothing: a quote that does not end, or text after one.
std::optional<std::vector<std::string>> csv_fields(std::string_view line);

/// A file read whole, its fields taken apart when they are asked for. Errors name file, line, column and value.
class CsvTable {
 public:
  struct Limits {
    size_t rows = 10'000'000, line_bytes = 1 << 16;
    bool lenient = false;  ///< lines that cannot be read are left out, and counted by damaged()
  };
  /// Error: the file is not there or empty, there are too many rows, or a line cannot be read: it is longer than the
  /// limit, is cut off, has another number of values than the header, or a quoted text does not end. A file may have
  /// 4 GiB.
  static Result<CsvTable> read(const std::string& path, const Limits& limits);

  const std::string& path() const { return path_; }
  size_t rows() const { return lines_.size(); }
  size_t damaged() const { return damaged_; }
  const std::vector<std::string>& header() const { return header_; }

  /// Finds a column by its name. Error: the table has no such column.
  Result<size_t> column(std::string_view name) const;
  std::optional<size_t> find(std::string_view name) const;

  std::vector<std::string> fields(size_t row) const { return *csv_fields(line(row)); }
  std::string text(size_t row, size_t column) const;
  /// Error: not a finite number.
  Result<double> number(size_t row, size_t column) const;
  /// Reads a whole number from 0 up to, not including, `end`.
  Result<uint64_t> count(size_t row, size_t column, double end = 9e15) const;
  /// Returns a column's numbers. Text that is no number counts as 0: programs of this project write none.
  std::vector<double> numbers(size_t column) const;

  /// "PATH:LINE: what"
  Error wrong(size_t row, const std::string& what) const;

 private:
  std::string problem(std::string_view line, const Limits& limits) const;
  std::string take_header(std::string_view line, const Limits& limits);

  std::string path_, bytes_;
  std::vector<std::string> header_;
  std::map<std::string, size_t, std::less<>> places_;  // column name -> its index
  size_t damaged_ = 0;
  struct Line {
    size_t begin, size;
  };
  std::vector<Line> lines_;  // parts of bytes_, without the header; offsets, since short texts move with their table
  std::string_view line(size_t row) const { return {bytes_.data() + lines_[row].begin, lines_[row].size}; }
};

/// One row, its values by the names of their columns. It keeps its first error: the caller reads all values and asks
/// status() once, at the end.
class CsvRow {
 public:
  CsvRow(const CsvTable& table, size_t row) : table_(table), row_(row), fields_(table.fields(row)) {}

  const CsvTable& table() const { return table_; }
  bool has(std::string_view column) const { return table_.find(column).has_value(); }
  /// Returns the columns whose value is a number.
  std::map<std::string, double> numbers() const;
  /// Empty if the table has no such column.
  std::string text(std::string_view column) const;
  /// Wrong: there is no such column, or the value is no finite number.
  double number(std::string_view column);
  /// Returns `fallback` if the table has no such column.
  double number(std::string_view column, double fallback) { return has(column) ? number(column) : fallback; }
  /// Reads a whole number from 0 up to, not including, `end`.
  uint64_t count(std::string_view column, double end = 9e15);
  uint64_t count(std::string_view column, uint64_t fallback, double end) {
    return has(column) ? count(column, end) : fallback;
  }
  /// Notes that something is wrong with the row unless `good`.
  void demand(bool good, const std::string& what);
  Status status() const { return wrong_ ? Status(*wrong_) : ok_status(); }

 private:
  const CsvTable& table_;
  size_t row_;
  std::vector<std::string> fields_;
  std::optional<Error> wrong_;
};

}  // namespace telesplat::tools
