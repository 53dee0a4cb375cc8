#include "tools/common/text_table.h"

#include <algorithm>

namespace telesplat::tools {
namespace {

bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }

}  // namespace

size_t width_of(const std::string& text) { return size_t(std::count_if(text.begin(), text.end(), begins_character)); }

std::string shortened(const std::string& text, size_t most) {
  if (width_of(text) <= most) return text;
  size_t end = 0, places = 0;
  while (end < text.size()) {
    if (begins_character(text[end]) && places++ == most - 3) break;
    ++end;
  }
  return text.substr(0, end) + "...";
}

std::string TextTable::text(const std::string& indent) const {
  const auto cell = [&](size_t row, size_t column) {
    return column < rows_[row].size() ? rows_[row][column] : std::string();
  };
  std::vector<size_t> widths(columns_.size(), 0);
  for (size_t c = 0; c < columns_.size(); ++c) {
    for (size_t r = 0; r < rows_.size(); ++r) widths[c] = std::max(widths[c], width_of(cell(r, c)));
    if (widths[c] > 0) widths[c] = std::max(widths[c], width_of(columns_[c].title));
  }
  const auto line = [&](auto&& at) {
    std::string out = indent;
    for (size_t c = 0; c < columns_.size(); ++c) {
      if (widths[c] == 0) continue;
      const std::string text = at(c);
      const std::string blanks(widths[c] - width_of(text), ' ');
      out += (out.size() > indent.size() ? "  " : "") + (columns_[c].right ? blanks + text : text + blanks);
    }
    return out.erase(out.find_last_not_of(' ') + 1) + "\n";
  };
  std::string out = line([&](size_t c) { return columns_[c].title; });
  for (size_t r = 0; r < rows_.size(); ++r) out += line([&](size_t c) { return cell(r, c); });
  return out;
}

}  // namespace telesplat::tools
