#include "common/options/manual.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace telesplat::options {
namespace {

// Escapes a text for roff, so that none of it is a command.
std::string roff(const std::string& text) {
  std::string out;
  bool begins = true;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    begins = c == '\n';
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c < 0x80) {
      out += char(c);
    } else {
      const int more = c >= 0xf0 ? 3 : c >= 0xe0 ? 2 : 1;
      uint32_t code = c & (0x3fu >> more);
      for (int n = 0; n < more && i + 1 < text.size(); ++n)
        code = code << 6 | (static_cast<unsigned char>(text[++i]) & 0x3fu);
      out += fmt::format("\\[u{:04X}]", code);
    }
  }
  return out;
}

// Name of a page: "telesplat-run".
std::string page_of(std::string name) {
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

bool is_positional(const Row& row) { return !name_of(row).starts_with("-"); }

std::string type_word(const Row& row) {
  if (std::holds_alternative<int*>(row.value) || std::holds_alternative<uint64_t*>(row.value) ||
      std::holds_alternative<std::optional<int>*>(row.value) || std::holds_alternative<double*>(row.value) ||
      std::holds_alternative<std::optional<double>*>(row.value))
    return "number";
  return row.is_file ? "file" : "text";
}

// Help of a row, with its limits and default.
std::string described(const Row& row) {
  std::string text = row.help;
  if (const std::string values = values_text(row); !values.empty()) text += fmt::format(" ({})", values);
  const std::string usual = row.default_text.empty() ? text_of(row) : row.default_text;
  if (takes_value(row) && !usual.empty()) text += fmt::format(". Default: {}", usual);
  if (!row.environment.empty()) text += fmt::format(", or ${}", row.environment);
  return text + '.';
}

std::string entry(const Row& row) {
  std::string head;
  for (const auto& name : names_of(row)) head += fmt::format("{}\\fB{}\\fR", head.empty() ? "" : ", ", roff(name));
  if (!is_positional(row) && takes_value(row)) head += fmt::format(" \\fI{}\\fR", type_word(row));
  return fmt::format(".TP\n{}\n{}\n", head, roff(described(row)));
}

// Makes a line of --help: the typed words, and beside them the text, in several lines if needed.
std::string line(const std::string& typed, const std::string& text) {
  constexpr size_t kIndent = 28, kWidth = 100;
  std::string out = "  " + typed;
  size_t column = out.size() + 2 > kIndent ? kWidth : out.size();
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find_first_of(" \n", at), text.size());
    if (column + 1 + (end - at) > kWidth) out += '\n', column = 0;
    const size_t blanks = column < kIndent ? kIndent - column : 1;
    out += std::string(blanks, ' ') + text.substr(at, end - at);
    column += blanks + (end - at);
    at = end + 1;
  }
  return out + '\n';
}

std::string group_of(const Row& row) {
  return is_positional(row) ? "Arguments" : row.group.empty() ? "Flags" : row.group;
}

std::string line(const Row& row) {
  std::string typed = fmt::format("{}", fmt::join(names_of(row), ", "));
  if (!is_positional(row) && takes_value(row)) typed += ' ' + type_word(row);
  return line(typed, described(row));
}

std::string entries(const Table& table, bool positional) {
  std::string out, group;
  for (const Row& row : table) {
    if (is_positional(row) != positional) continue;
    if (row.group != group) out += fmt::format(".SS {}\n", roff(group = row.group));
    out += entry(row);
  }
  return out;
}

std::string synopsis(const Manual& m) {
  std::string out = fmt::format("\\fB{}\\fR", roff(m.name));
  if (!m.commands.empty()) return out + " \\fIcommand\\fR ...";
  out += " [\\fIoptions\\fR]";
  for (const Row& row : m.table) {
    if (!is_positional(row)) continue;
    const bool several = std::holds_alternative<std::vector<std::string>*>(row.value);
    const std::string name = fmt::format("\\fI{}\\fR{}", roff(name_of(row)), several ? " ..." : "");
    out += row.required ? " " + name : " [" + name + "]";
  }
  return out;
}

std::string paragraphs(const std::string& text) { return text.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", text); }

// Writes the commands of a page, one after the other.
std::string sections(const Manual& m) {
  std::string out;
  for (const Manual& command : m.commands) {
    out += fmt::format(".SH {}\n{}\n.PP\n{}.\n", roff(command.name), synopsis(command), roff(about_text(command)));
    out += entries(command.table, true) + entries(command.table, false);
    out += paragraphs(roff(command.footer)) + sections(command);
  }
  return out;
}

}  // namespace

bool takes_value(const Row& row) { return !std::holds_alternative<bool*>(row.value) || row.on_off; }

std::string values_text(const Row& row) {
  if (row.on_off) return "on or off";
  if (const auto* range = std::get_if<Range>(&row.limits))
    return fmt::format("{} to {}", number_text(range->least), number_text(range->most));
  if (const auto* names = std::get_if<Names>(&row.limits)) return fmt::format("{}", fmt::join(*names, ", "));
  return {};
}

std::string about_text(const Manual& m) {
  const std::string own = m.name + ": ";
  std::string out = m.about.starts_with(own) ? m.about.substr(own.size()) : m.about;
  while (out.ends_with('.')) out.pop_back();
  if (!out.empty()) out[0] = char(std::tolower(static_cast<unsigned char>(out[0])));
  return out;
}

std::string help_text(const Manual& m, bool all) {
  const auto lacks = [&](const Row& row) { return row.seldom && !all; };
  std::string out = fmt::format("{}\n\nUsage: {}", m.about, m.name);
  std::vector<std::string> groups;
  for (const Row& row : m.table)
    if (const std::string group = group_of(row);
        !lacks(row) && std::find(groups.begin(), groups.end(), group) == groups.end())
      groups.push_back(group);
  if (!m.table.empty()) out += " [FLAGS]";
  for (const Row& row : m.table)
    if (is_positional(row)) out += row.required ? " " + name_of(row) : " [" + name_of(row) + "]";
  out += m.commands.empty() ? "\n" : " COMMAND\n\nCommands:\n";
  for (const Manual& c : m.commands) out += line(c.name.substr(c.name.rfind(' ') + 1), c.about);
  for (const std::string& group : groups) {
    out += fmt::format("\n{}:\n", group);
    for (const Row& row : m.table)
      if (group_of(row) == group && !lacks(row)) out += line(row);
  }
  if (const auto hidden = std::count_if(m.table.begin(), m.table.end(), lacks))
    out += fmt::format("\n{} more flags: {} --help all\n", hidden, m.name);
  return m.footer.empty() ? out : fmt::format("{}\n{}\n", out, m.footer);
}

std::string man_page(const Manual& m, const std::string& version, bool separate) {
  std::string title = page_of(m.name);
  std::transform(title.begin(), title.end(), title.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  std::string out = fmt::format(".TH {} 1 \"\" \"telesplat {}\" \"Telesplat\"\n", roff(title), roff(version));
  out += fmt::format(".SH NAME\n{} \\- {}\n", roff(page_of(m.name)), roff(about_text(m)));
  out += fmt::format(".SH SYNOPSIS\n{}\n", synopsis(m));
  if (const std::string rows = entries(m.table, true); !rows.empty()) out += ".SH ARGUMENTS\n" + rows;
  if (const std::string rows = entries(m.table, false); !rows.empty()) out += ".SH OPTIONS\n" + rows;
  if (separate && !m.commands.empty()) {
    out += ".SH COMMANDS\n";
    for (const Manual& c : m.commands)
      out += fmt::format(".TP\n\\fB{}\\fR(1)\n{}.\n", roff(page_of(c.name)), roff(about_text(c)));
  }
  out += paragraphs(roff(m.footer));
  if (!separate) out += sections(m);
  out += ".SH EXIT STATUS\n0: done. 1: failed while running. 2: bad usage or bad input. 130: interrupted.\n";
  if (m.name != "telesplat") out += ".SH SEE ALSO\n\\fBtelesplat\\fR(1)\n";
  return out;
}

}  // namespace telesplat::options
