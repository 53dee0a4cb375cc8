#include "tools/telesplat/bench/thesis/report.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/common/text_table.h"
#include "tools/telesplat/sweep/page_parts.h"
#include "tools/telesplat/sweep/plot.h"

namespace telesplat::launcher {
namespace {

// A cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c == '\n' ? ' ' : c);
  return out;
}

std::string row(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const std::string& c : cells) out += " " + cell(c) + " |";
  return out + "\n";
}

std::string paragraphs(const std::vector<std::string>& notes) {
  std::string out;
  for (const std::string& note : notes) out += "<p>" + escaped(note) + "</p>\n";
  return out;
}

bool is_sentence(const std::string& text) { return std::count(text.begin(), text.end(), ' ') > 1; }

std::string html_of(const ThesisTable& table) {
  std::string out = "<section><h2>" + escaped(table.title) + "</h2>\n" + paragraphs(table.notes) +
                    "<div class=\"wide\"><table><thead><tr>";
  for (const std::string& h : table.head) out += "<th>" + escaped(h) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const auto& cells : table.rows) {
    out += "<tr>";
    for (size_t i = 0; i < cells.size(); ++i)
      out += (i == 0                  ? "<td class=\"f\">"
              : is_sentence(cells[i]) ? "<td class=\"f\" style=\"white-space:normal;min-width:14em\">"
                                      : "<td>") +
             escaped(cells[i]) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table></div></section>\n";
}

}  // namespace

std::string to_markdown(const ThesisReport& report) {
  std::string out = "# The thesis's tables and figures, and ours\n\n";
  for (const std::string& line : report.about) out += line + "\n";
  for (const ThesisTable& table : report.tables) {
    out += "\n## " + table.title + "\n\n";
    for (const std::string& note : table.notes) out += note + "\n";
    out += "\n" + row(table.head) + row(std::vector<std::string>(table.head.size(), "---"));
    for (const auto& cells : table.rows) out += row(cells);
  }
  for (const ThesisFigure& figure : report.figures) {
    out += "\n## " + figure.title + "\n\n";
    for (const std::string& note : figure.notes) out += note + "\n";
    if (!figure.svg.empty()) out += fmt::format("\n![{}]({})\n", figure.title, figure.file);
  }
  return out;
}

std::string to_html(const ThesisReport& report) {
  std::string out = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>The thesis's tables and figures, and "
      "ours</title>\n<style>{}</style></head><body>\n<h1>The thesis's tables and figures, and ours</h1>\n{}",
      page_style(), paragraphs(report.about));
  for (const ThesisTable& table : report.tables) out += html_of(table);
  for (const ThesisFigure& figure : report.figures)
    out += "<section><h2>" + escaped(figure.title) + "</h2>\n" + paragraphs(figure.notes) + figure.svg + "</section>\n";
  return out + "</body></html>\n";
}

std::string to_text(const ThesisReport& report) {
  std::string out;
  for (const ThesisTable& table : report.tables) {
    out += "\n" + table.title + "\n";
    for (const std::string& note : table.notes) out += "  " + note + "\n";
    std::vector<tools::TextTable::Column> columns;
    for (size_t i = 0; i < table.head.size(); ++i) columns.push_back({table.head[i], i > 0});
    tools::TextTable text(columns);
    for (const auto& cells : table.rows) text.add(cells);
    out += text.text("  ");
  }
  for (const ThesisFigure& figure : report.figures)
    out += fmt::format("\n{}: {}\n", figure.title, figure.svg.empty() ? "not drawn yet" : figure.file);
  return out;
}

}  // namespace telesplat::launcher
