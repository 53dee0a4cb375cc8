#include <fmt/format.h>

#include <algorithm>

#include "common/options/manual.h"

namespace telesplat::options {
namespace {

using Texts = std::vector<std::string>;

bool is_positional(const Row& row) { return !name_of(row).starts_with("-"); }

// The words a value may be; empty: any.
Texts values_of(const Row& row) {
  if (row.on_off) return {"on", "off"};
  const auto* names = std::get_if<Names>(&row.limits);
  return names ? *names : Texts{};
}

Texts flags_of(const Row& row) {
  Texts out;
  for (auto& name : names_of(row))
    if (name.starts_with("-")) out.push_back(std::move(name));
  return out;
}

// The program, its commands, theirs.
void collect(const Manual& m, std::vector<const Manual*>& out) {
  out.push_back(&m);
  for (const Manual& command : m.commands) collect(command, out);
}
std::vector<const Manual*> all_of(const Manual& program) {
  std::vector<const Manual*> out;
  collect(program, out);
  return out;
}

std::string last_word(const std::string& name) { return name.substr(name.rfind(' ') + 1); }

Texts commands_of(const Manual& m) {
  Texts out;
  for (const Manual& command : m.commands) out.push_back(last_word(command.name));
  return out;
}

// What an argument by its place may be, besides a file.
Texts words_of(const Manual& m) {
  Texts out = commands_of(m);
  for (const Row& row : m.table)
    if (is_positional(row))
      for (auto& value : values_of(row)) out.push_back(std::move(value));
  return out;
}

bool takes_files(const Manual& m) {
  return std::any_of(m.table.begin(), m.table.end(),
                     [](const Row& row) { return is_positional(row) && values_of(row).empty(); });
}

// A pattern of shells' `case` for every flag of every command that is followed by a value.
template <class Each>
void each_value(const Manual& program, Each each) {
  for (const Manual* m : all_of(program))
    for (const Row& row : m->table) {
      if (!takes_value(row)) continue;
      Texts patterns;
      for (const auto& flag : flags_of(row)) patterns.push_back(fmt::format("'{} {}'", m->name, flag));
      if (!patterns.empty()) each(fmt::format("{}", fmt::join(patterns, " | ")), row);
    }
}

Texts all_flags(const Manual& m, bool is_program) {
  Texts out{"--help"};
  if (is_program) out.emplace_back("--version");
  for (const Row& row : m.table)
    for (auto& flag : flags_of(row)) out.push_back(std::move(flag));
  return out;
}

// `case` patterns of the commands: what is typed so far becomes `command`.
std::string command_patterns(const Manual& program) {
  Texts out;
  for (const Manual* m : all_of(program))
    if (m != &program) out.push_back(fmt::format("'{}'", m->name));
  return fmt::format("{}", fmt::join(out, " | "));
}

std::string bash(const Manual& program) {
  std::string out = fmt::format(
      "# bash completion of {0}, printed by `{0} completion bash`\n"
      "_{0}() {{\n"
      "  local cur=\"${{COMP_WORDS[COMP_CWORD]}}\" flag=\"${{COMP_WORDS[COMP_CWORD - 1]}}\" command={0} i\n"
      "  COMPREPLY=()\n"
      "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
      "    case \"$command ${{COMP_WORDS[i]}}\" in\n"
      "      {1}) command=\"$command ${{COMP_WORDS[i]}}\" ;;\n"
      "    esac\n"
      "  done\n"
      "  # bash makes three words of --flag=value\n"
      "  if [[ $cur == = ]]; then\n"
      "    cur=\n"
      "  elif [[ $flag == = ]]; then\n"
      "    flag=\"${{COMP_WORDS[COMP_CWORD - 2]}}\"\n"
      "  fi\n"
      "  case \"$command $flag\" in\n",
      program.name, command_patterns(program));
  each_value(program, [&](const std::string& pattern, const Row& row) {
    const Texts values = values_of(row);
    const std::string from = values.empty() ? "-f" : fmt::format("-W '{}'", fmt::join(values, " "));
    out += fmt::format("    {})\n      {}mapfile -t COMPREPLY < <(compgen {} -- \"$cur\")\n      return\n      ;;\n",
                       pattern, values.empty() ? "compopt -o filenames 2> /dev/null\n      " : "", from);
  });
  out += "  esac\n  if [[ $cur == -* ]]; then\n    case \"$command\" in\n";
  for (const Manual* m : all_of(program))
    out += fmt::format("      '{}') mapfile -t COMPREPLY < <(compgen -W '{}' -- \"$cur\") ;;\n", m->name,
                       fmt::join(all_flags(*m, m == &program), " "));
  out += "    esac\n    return\n  fi\n  case \"$command\" in\n";
  for (const Manual* m : all_of(program))
    out += fmt::format("    '{}') {}mapfile -t COMPREPLY < <(compgen -W '{}'{} -- \"$cur\") ;;\n", m->name,
                       takes_files(*m) ? "compopt -o filenames 2> /dev/null; " : "", fmt::join(words_of(*m), " "),
                       takes_files(*m) ? " -f" : "");
  return out + fmt::format("  esac\n}}\ncomplete -F _{0} {0}\n", program.name);
}

// In single quotes, beside a colon that ends the word.
std::string zsh_entry(const std::string& word, const std::string& about) {
  std::string out = "'" + word + ":";
  for (const char c : about) out += c == '\'' ? "'\\''" : c == ':' ? "\\:" : std::string(1, c == '\n' ? ' ' : c);
  return out + "'";
}

std::string zsh(const Manual& program) {
  std::string out = fmt::format(
      "#compdef {0}\n# zsh completion of {0}, printed by `{0} completion zsh`\n"
      "_{0}() {{\n"
      "  local cur=$words[CURRENT] flag=$words[CURRENT-1] command={0} i\n"
      "  local -a entries\n"
      "  for ((i = 2; i < CURRENT; i++)); do\n"
      "    case \"$command $words[i]\" in\n"
      "      {1}) command=\"$command $words[i]\" ;;\n"
      "    esac\n"
      "  done\n"
      "  if [[ $cur == --*=* ]]; then\n"
      "    flag=${{cur%%=*}}\n"
      "    compset -P '*='\n"
      "  fi\n"
      "  case \"$command $flag\" in\n",
      program.name, command_patterns(program));
  each_value(program, [&](const std::string& pattern, const Row& row) {
    const Texts values = values_of(row);
    out += fmt::format("    {}) {}; return ;;\n", pattern,
                       values.empty() ? "_files" : fmt::format("compadd -- {}", fmt::join(values, " ")));
  });
  out += "  esac\n  case \"$command\" in\n";
  for (const Manual* m : all_of(program)) {
    out += fmt::format("    '{}')\n      if [[ $cur == -* ]]; then\n        entries=('--help:print help'\n", m->name);
    for (const Row& row : m->table)
      for (const auto& flag : flags_of(row)) out += fmt::format("          {}\n", zsh_entry(flag, row.help));
    out += "        )\n        _describe -o option entries\n      else\n";
    if (!m->commands.empty()) {
      out += "        entries=(\n";
      for (const Manual& c : m->commands)
        out += fmt::format("          {}\n", zsh_entry(last_word(c.name), about_text(c)));
      out += "        )\n        _describe command entries\n";
    } else if (const Texts words = words_of(*m); !words.empty()) {
      out += fmt::format("        compadd -- {}\n", fmt::join(words, " "));
    }
    out += fmt::format("        {}\n      fi\n      ;;\n", takes_files(*m) ? "_files" : ":");
  }
  // Of a folder of functions the file itself is the function, when it is first called.
  return out +
         fmt::format("  esac\n}}\nif [[ $funcstack[1] == _{0} ]]; then\n  _{0} \"$@\"\nelse\n  compdef _{0} {0}\nfi\n",
                     program.name);
}

std::string fish_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c == '\n' ? ' ' : c);
  return out + "'";
}

// When a command's words are offered: all of its name was typed, and none of its commands.
std::string fish_condition(const Manual& m) {
  std::string out;
  for (size_t at = m.name.find(' '); at != m.name.npos;) {
    const size_t next = m.name.find(' ', at + 1);
    out += fmt::format("{}__fish_seen_subcommand_from {}", out.empty() ? "" : "; and ",
                       m.name.substr(at + 1, next == m.name.npos ? next : next - at - 1));
    at = next;
  }
  if (!m.commands.empty())
    out += fmt::format("{}not __fish_seen_subcommand_from {}", out.empty() ? "" : "; and ",
                       fmt::join(commands_of(m), " "));
  return out;
}

std::string fish(const Manual& program) {
  std::string out = fmt::format("# fish completion of {0}, printed by `{0} completion fish`\n", program.name);
  for (const Manual* m : all_of(program)) {
    const std::string condition = fish_condition(*m);
    const std::string line = fmt::format("complete -c {}{}", program.name,
                                         condition.empty() ? "" : fmt::format(" -n {}", fish_quoted(condition)));
    for (const Manual& c : m->commands)
      out += fmt::format("{} -f -a {} -d {}\n", line, last_word(c.name), fish_quoted(about_text(c)));
    if (m->commands.empty() && !takes_files(*m))
      out += fmt::format("{} -f -a {}\n", line, fish_quoted(fmt::format("{}", fmt::join(words_of(*m), " "))));
    out += fmt::format("{} -l help -d 'print help'\n", line);
    for (const Row& row : m->table)
      for (const auto& flag : flags_of(row)) {
        out += fmt::format("{} {} {}", line, flag.starts_with("--") ? "-l" : "-s",
                           flag.substr(flag.find_first_not_of('-')));
        if (const Texts values = values_of(row); takes_value(row) && !values.empty())
          out += fmt::format(" -x -a {}", fish_quoted(fmt::format("{}", fmt::join(values, " "))));
        else if (takes_value(row))
          out += " -r";
        out += fmt::format(" -d {}\n", fish_quoted(row.help));
      }
  }
  return out;
}

}  // namespace

std::string completion(const Manual& program, Shell shell) {
  return shell == Shell::kBash ? bash(program) : shell == Shell::kZsh ? zsh(program) : fish(program);
}

}  // namespace telesplat::options
