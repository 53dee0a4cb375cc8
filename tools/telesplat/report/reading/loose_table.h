// CSV files of runs that may have ended anyhow: what can be read of them counts.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Columns of a table, by name. Lines that cannot be read (tools::CsvTable), or have more than 64 KiB, are left out.
class LooseTable {
 public:
  /// The columns that are asked for, as far as the file has them. Error: as of tools::CsvTable.
  static Result<LooseTable> read(const std::string& path, const std::vector<std::string>& numbers,
                                 const std::vector<std::string>& texts = {});

  size_t rows() const { return rows_; }
  size_t damaged() const { return damaged_; }  ///< lines that were left out
  bool has(std::string_view name) const;
  /// A value a row, within 1e12 of 0; NaN where there is no such number. All NaN if the file has no such column.
  const std::vector<double>& numbers(const std::string& name) const;
  /// Valid UTF-8, at most 200 bytes each; empty if the file has no such column.
  const std::vector<std::string>& texts(const std::string& name) const;
  /// Leaves out the rows whose value in this column, which was asked for, is less.
  void leave_out_below(const std::string& column, double least);

 private:
  size_t rows_ = 0, damaged_ = 0;
  std::vector<std::string> header_;
  std::map<std::string, std::vector<double>, std::less<>> numbers_;
  std::map<std::string, std::vector<std::string>, std::less<>> texts_;
};

}  // namespace telesplat::launcher
