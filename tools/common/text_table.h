// Tables for people: each column is as wide as its widest cell.
#pragma once

#include <string>
#include <vector>

namespace telesplat::tools {

class TextTable {
 public:
  struct Column {
    std::string title;
    bool right = true;  ///< true: numbers, aligned right; false: texts, aligned left
  };
  explicit TextTable(std::vector<Column> columns) : columns_(std::move(columns)) {}

  /// A cell a column; missing ones are empty.
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  bool empty() const { return rows_.empty(); }
  /// Title and rows, each in a line that `indent` begins. Columns in which nothing stands are left out.
  std::string text(const std::string& indent = "") const;

 private:
  std::vector<Column> columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// Returns the number of terminal columns that a UTF-8 text takes: one a character; wide characters count as one too.
size_t width_of(const std::string& text);
/// Returns `text`, or its begin and "..." if it is wider than `most` columns (at least 3).
std::string shortened(const std::string& text, size_t most);

}  // namespace telesplat::tools
