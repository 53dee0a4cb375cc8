// Tables for people: columns as wide as what stands in them.
#pragma once

#include <string>
#include <vector>

namespace telesplat::tools {

class TextTable {
 public:
  struct Column {
    std::string title;
    bool right = true;  ///< numbers; else texts, which begin at the left
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

/// How many places a text of UTF-8 takes on a terminal: one a character, wide ones aside.
size_t width_of(const std::string& text);
/// `text`, or its begin and "..." where it is wider than `most` places (at least 3).
std::string shortened(const std::string& text, size_t most);

}  // namespace telesplat::tools
