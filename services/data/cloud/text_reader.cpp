// Reads clouds as lines of numbers.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <utility>

#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"
#include "services/data/cloud/point_rows.h"
#include "services/data/cloud/readers.h"

namespace telesplat::data {
namespace {

bool is_separator(char c) { return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r'; }

// Walks over the lines of a text, without those that are empty or comments.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// Finds the next line. names: a comment that may hold names of columns is taken for a line, too.
  bool next(bool names = false) {
    while (end_ < text_.size()) {
      begin_ = end_ == 0 && text_.starts_with("\xef\xbb\xbf") ? 3 : end_;
      const size_t stop = std::min(text_.find('\n', begin_), text_.size());
      end_ = std::min(stop + 1, text_.size());
      line_ = text_.substr(begin_, stop - begin_);
      while (!line_.empty() && is_separator(line_.front())) line_.remove_prefix(1);
      while (!line_.empty() && is_separator(line_.back())) line_.remove_suffix(1);
      if (line_.empty()) continue;
      if (names || !(line_.front() == '#' || line_.starts_with("//"))) return true;
    }
    return false;
  }
  std::string_view line() const { return line_; }
  size_t begin() const { return begin_; }
  size_t end() const { return end_; }
  size_t number() const { return 1 + size_t(std::count(text_.begin(), text_.begin() + std::ptrdiff_t(begin_), '\n')); }

  /// Reads the line's numbers, at most `most`; returns false if something else stands among them.
  bool numbers(size_t most, std::vector<double>& out) const {
    out.clear();
    TextScanner scan(line_);
    for (std::string_view rest = line_; !rest.empty() && out.size() < most;) {
      double value;
      const size_t before = scan.offset();
      if (!scan.number(value)) return false;
      rest = line_.substr(scan.offset());
      if (scan.offset() == before || (!rest.empty() && !is_separator(rest.front()))) return false;
      out.push_back(value);
      size_t gap = 0;
      while (gap < rest.size() && is_separator(rest[gap])) ++gap;
      scan.skip(gap), rest.remove_prefix(gap);
    }
    return true;
  }
  /// The line's words without quotes and the sign of a comment.
  std::vector<std::string> words() const {
    std::vector<std::string> out(1);
    for (const char c : line_) {
      if (c == '"' || c == '\'' || (out.size() == 1 && out[0].empty() && (c == '/' || c == '#'))) continue;
      if (!is_separator(c)) out.back() += c;
      if (is_separator(c) && !out.back().empty()) out.emplace_back();
    }
    if (out.back().empty()) out.pop_back();
    return out;
  }

 private:
  std::string_view text_, line_;
  size_t begin_ = 0, end_ = 0;
};

// Columns of a text, and where its first line of numbers begins.
struct Layout {
  std::vector<std::string> columns;
  size_t begin = 0;
  bool counted = false;  // a count comes first
  float least_colour = 1;
};

bool has_places(const std::vector<std::string>& names) {
  const auto has = [&](Column c) {
    return std::any_of(names.begin(), names.end(), [&](const std::string& n) { return column_named(n) == c; });
  };
  return has(Column::kX) && has(Column::kY) && has(Column::kZ);
}

// Names columns without a line of names, by the first rows.
std::vector<std::string> guessed_columns(const std::vector<std::vector<double>>& rows) {
  std::vector<std::string> out{"x", "y", "z"};
  const size_t more = rows[0].size() - 3;
  const auto all = [&](auto&& is) { return std::all_of(rows.begin(), rows.end(), is); };
  const auto colours_at = [&](size_t at) {
    return all([&](const std::vector<double>& r) {
      return std::all_of(r.begin() + std::ptrdiff_t(at), r.begin() + std::ptrdiff_t(at + 3),
                         [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); });
    });
  };
  const auto normal_at = [&](size_t at) {
    return all([&](const std::vector<double>& r) {
      return std::abs(glm::length(glm::dvec3(r[at], r[at + 1], r[at + 2])) - 1) < 0.02;
    });
  };
  if (more == 1 || (more >= 4 && colours_at(4) && !colours_at(3))) out.push_back("intensity");
  while (out.size() + 3 <= rows[0].size()) {
    const bool first = std::find(out.begin(), out.end(), "red") == out.end();
    if (normal_at(out.size()))
      out.insert(out.end(), {"nx", "ny", "nz"});
    else if (first && colours_at(out.size()))
      out.insert(out.end(), {"red", "green", "blue"});
    else
      break;
  }
  while (out.size() < rows[0].size()) out.push_back(fmt::format("column {}", out.size() + 1));
  return out;
}

// nullopt: the text does not begin with rows of numbers.
// strict: a line among the first 100 that does not fit means that it is no such text.
std::optional<Layout> layout_of(std::string_view content, bool strict) {
  constexpr size_t kLookedAt = 100, kMostLine = 1 << 16;
  Layout out;
  Lines lines(content.substr(0, 1 << 20));
  std::vector<std::vector<double>> rows;
  std::vector<double> row;
  while (rows.size() < kLookedAt && lines.next(rows.empty() && out.columns.empty())) {
    if (lines.line().size() > kMostLine) return std::nullopt;
    const bool numbers = lines.numbers(kMaxColumns, row);
    const bool cut = lines.end() == (1 << 20);  // the line may go on
    if (numbers && row.size() == 1 && rows.empty() && !out.counted) {
      out.counted = true;
    } else if (numbers && row.size() >= 3) {
      if (rows.empty()) out.begin = lines.begin();
      if (rows.empty() || row.size() == rows[0].size()) rows.push_back(row);
      if (row.size() == rows[0].size()) continue;
      if (strict && !cut) return std::nullopt;
      break;
    } else if (rows.empty() && out.columns.empty()) {
      if (auto names = lines.words(); has_places(names) && names.size() <= kMaxColumns)
        out.columns = std::move(names);
      else if (lines.line().front() != '#' && !lines.line().starts_with("//"))
        return std::nullopt;
    } else if (!(numbers && row.size() == 1 && out.counted)) {
      if (strict && !cut) return std::nullopt;
      break;
    }
  }
  if (rows.empty()) return std::nullopt;
  if (out.columns.size() != rows[0].size()) out.columns = guessed_columns(rows);
  const size_t red = size_t(std::find_if(out.columns.begin(), out.columns.end(),
                                         [](const auto& c) { return column_named(c) == Column::kRed; }) -
                            out.columns.begin());
  if (red < out.columns.size() &&
      std::all_of(rows.begin(), rows.end(), [&](const auto& r) { return r[red] == std::floor(r[red]); }))
    out.least_colour = 255;
  return out;
}

std::shared_ptr<const SquareCloud> read_rows(std::string_view content, const std::string& name,
                                             const ReadProgress& progress, const std::string& array) {
  const auto layout = layout_of(content, false);
  if (!layout)
    refuse("{}: does not begin with lines of three numbers or more, or a line of names with x, y and z", name);
  PointRows rows(name, layout->columns, array);
  Lines lines(content.substr(layout->begin));
  std::vector<double> row;
  const size_t columns = layout->columns.size();
  for (size_t n = 0; lines.next(); ++n) {
    if ((n & 0xffff) == 0 && progress) progress(double(lines.begin()) / double(content.size()));
    const bool numbers = lines.numbers(columns, row);
    if (numbers && row.size() == 1 && layout->counted) continue;  // the next scan's count
    if (!numbers || row.size() < columns)
      refuse("{}: point {} is damaged: {} numbers, {} are needed: '{}'", name, rows.size(), row.size(), columns,
             lines.line().substr(0, 40));
    rows.add(row);
  }
  return rows.finish("text points", layout->least_colour);
}

// Reads the head of a scan: columns, rows, the scanner's place and axes, the matrix that rows of numbers are
// multiplied by. Returns false at the text's end.
struct PtxHead {
  uint64_t points = 0;
  glm::dmat4 pose{1.0};
};
bool read_ptx_head(Lines& lines, std::vector<double>& row, PtxHead& out) {
  constexpr size_t kNumbers[] = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
  double size[2] = {};
  for (int i = 0; i < 10; ++i) {
    if (!lines.next() || !lines.numbers(8, row) || row.size() != kNumbers[i]) return false;
    if (i < 2) size[i] = row[0];
    for (int k = 0; k < 4 && i >= 6; ++k) out.pose[i - 6][k] = row[size_t(k)];
  }
  out.points = size[0] >= 0 && size[1] >= 0 && size[0] * size[1] < 1e15 ? uint64_t(size[0] * size[1]) : 0;
  return size[0] >= 1 && size[1] >= 1;
}

std::shared_ptr<const SquareCloud> read_scans(std::string_view content, const std::string& name,
                                              const ReadProgress& progress, const std::string& array) {
  Lines lines(content);
  std::vector<double> row;
  std::optional<PointRows> rows;
  size_t columns = 0, scans = 0, none = 0;
  for (Lines ahead = lines; ahead.next(); ahead = lines, ++scans) {
    PtxHead head;
    if (!read_ptx_head(lines, row, head)) refuse("{}:{}: is not the head of a scan", name, lines.number());
    const glm::dvec4 scanner = head.pose * glm::dvec4(0, 0, 0, 1);
    if (rows) rows->begin_scan(glm::dvec3(scanner));
    for (uint64_t i = 0; i < head.points; ++i) {
      if (!lines.next()) refuse("{}: is truncated: point {} of {} is missing", name, i, head.points);
      if ((i & 0xffff) == 0 && progress) progress(double(lines.begin()) / double(content.size()));
      const bool numbers = lines.numbers(7, row);
      if (!rows && numbers && (row.size() == 4 || row.size() == 7)) {
        columns = row.size();
        std::vector<std::string> names{"x", "y", "z", "intensity"};
        if (columns == 7) names.insert(names.end(), {"red", "green", "blue"});
        rows.emplace(name, names, array);
        rows->begin_scan(glm::dvec3(scanner));
      }
      if (!numbers || row.size() != columns)
        refuse("{}:{}: a point is 4 or 7 numbers, as many as the first one's", name, lines.number());
      if (row[0] == 0 && row[1] == 0 && row[2] == 0) {
        ++none;
        continue;
      }
      const glm::dvec4 at = head.pose * glm::dvec4(row[0], row[1], row[2], 1);
      for (int k = 0; k < 3; ++k) row[size_t(k)] = at[k];
      rows->add(row);
    }
  }
  if (!rows) refuse("{}: holds no points", name);
  if (none > 0) rows->add_note(fmt::format("{} points are left out: the scanner measured none there", none));
  return rows->finish(fmt::format("PTX points ({} scan{})", scans, scans == 1 ? "" : "s"), 255, std::nullopt, true);
}

}  // namespace

bool is_ptx(std::string_view content) {
  Lines lines(content.substr(0, 1 << 14));
  std::vector<double> row;
  PtxHead head;
  return read_ptx_head(lines, row, head);
}

bool is_xyz(std::string_view content, bool* regular_grid) {
  const auto layout = layout_of(content, true);
  if (!layout || !regular_grid) return layout.has_value();
  std::vector<double> row;
  std::vector<glm::dvec2> places, steps;
  for (Lines lines(content.substr(layout->begin)); places.size() < 100 && lines.next() && lines.numbers(3, row);)
    if (row.size() == 3) places.emplace_back(row[0], row[1]);
  for (size_t i = 1; i < places.size(); ++i) {
    const glm::dvec2 step = places[i] - places[i - 1];
    const auto same = [&](const glm::dvec2& s) { return glm::length(s - step) <= 1e-3 * glm::length(s); };
    if (std::none_of(steps.begin(), steps.end(), same)) steps.push_back(step);
  }
  *regular_grid =
      layout->columns.size() == 3 && places.size() >= 4 && steps.size() <= 2 && (steps[0].x == 0) != (steps[0].y == 0);
  return true;
}

ReadCloud read_xyz(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array) {
  return or_error([&] { return read_rows(content, name, progress, array); });
}

ReadCloud read_ptx(std::string_view content, const std::string& name, const ReadProgress& progress,
                   const std::string& array) {
  return or_error([&] { return read_scans(content, name, progress, array); });
}

}  // namespace telesplat::data
