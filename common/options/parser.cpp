#include "common/options/parser.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <span>

#include "common/core/utf8.h"
#include "common/options/manual.h"
#include "common/options/suggest.h"

namespace telesplat::options {

struct Parser::Impl {
  Impl(CLI::App& a, std::string n) : name(std::move(n)), app(&a) {}
  explicit Impl(const std::string& about) : own(std::make_unique<CLI::App>(about)), app(own.get()) {
    // The command line wins over a scene file, whose flags come first.
    app->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }
  std::string name;  // of a command
  std::unique_ptr<CLI::App> own;
  CLI::App* app;
  Table table;
  std::string version;
  std::deque<Parser> commands;
  std::vector<std::pair<std::string, CLI::Option*>> options;  // by the row's name

  Manual manual(const std::string& called) const;
  Status refuse_unknown(const std::string& called, std::span<const std::string> arguments, std::string& command) const;
  Status unknown_flag(const std::string& called, const std::string& flag) const;
  Status unknown_command(const std::string& called, const std::string& name) const;
  Status read(const std::string& called, std::vector<std::string> arguments, std::ostream& told, bool& ends);
};

namespace {

// CLI11 converts nothing: rows read their text, with their own limits.
void throw_if_wrong(const Row& row, const std::string& text) {
  if (const Status s = set(row, text); !s) throw CLI::ValidationError(s.error().text);
}

std::string type_name(const Row& row) {
  if (const auto* names = std::get_if<Names>(&row.limits)) return fmt::format("{{{}}}", fmt::join(*names, ","));
  std::string type = "TEXT";
  if (std::holds_alternative<int*>(row.value) || std::holds_alternative<std::optional<int>*>(row.value)) type = "INT";
  if (std::holds_alternative<uint64_t*>(row.value)) type = "UINT";
  if (std::holds_alternative<double*>(row.value) || std::holds_alternative<std::optional<double>*>(row.value))
    type = "FLOAT";
  if (row.on_off) type = "{on,off}";
  if (const auto* range = std::get_if<Range>(&row.limits))
    return fmt::format("{} in [{} - {}]", type, number_text(range->least), number_text(range->most));
  return type;
}

// A negative number is no flag.
bool is_number(const std::string& word) {
  return word.find_first_not_of("-+.,:0123456789eE%") == word.npos && word.find_first_of("0123456789") != word.npos;
}

std::string shown(const std::string& word) { return word.empty() ? "\"\"" : to_utf8(word.substr(0, 200)); }

std::ostream& discarded() {
  static std::ostream nowhere(nullptr);
  return nowhere;
}

CLI::Option* add_row(CLI::App& app, const Row& row) {
  if (const auto* action = std::get_if<Action>(&row.value))
    return app.add_flag_callback(
        row.flag,
        [act = action->act] {
          act();
          throw CLI::Success();
        },
        row.help);
  if (auto* const* flag = std::get_if<bool*>(&row.value); flag && !row.on_off)
    return app.add_flag_callback(
        name_of(row), [row] { throw_if_wrong(row, "true"); }, row.help);
  if (auto* const* many = std::get_if<std::vector<std::string>*>(&row.value)) {
    auto* option = app.add_option(row.flag, **many, row.help)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    // Of a flag that is given several times each takes one value: what follows is an argument.
    return row.flag.starts_with("-") ? option->allow_extra_args(false) : option;
  }
  auto* option = app.add_option_function<std::string>(
      row.flag, [row](const std::string& text) { throw_if_wrong(row, text); }, row.help);
  option->type_name(type_name(row));
  const std::string usual = row.default_text.empty() ? text_of(row) : row.default_text;
  if (!usual.empty()) option->default_str(usual);
  return option;
}

}  // namespace

Parser::Parser(const std::string& about) : impl_(std::make_unique<Impl>(about)) {}
Parser::Parser(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Parser::~Parser() = default;
Parser::Parser(Parser&&) noexcept = default;

void Parser::add(const Table& table) {
  for (const Row& row : table) {
    auto* option = add_row(*impl_->app, row);
    if (!row.group.empty()) option->group(row.group);
    if (row.required) option->required();
    if (!row.environment.empty()) option->envname(row.environment);
    impl_->options.emplace_back(name_of(row), option);
    impl_->table.push_back(row);
  }
}

Parser& Parser::command(const std::string& name, const std::string& about) {
  impl_->app->require_subcommand(1);
  impl_->commands.push_back(Parser(std::make_unique<Impl>(*impl_->app->add_subcommand(name, about), name)));
  return impl_->commands.back();
}

void Parser::footer(const std::string& text) { impl_->app->footer(text); }

void Parser::version(const std::string& text) { impl_->version = text; }

Manual Parser::Impl::manual(const std::string& called) const {
  Manual out{called, app->get_description(), table, app->get_footer(), {}};
  for (const Parser& p : commands) out.commands.push_back(p.impl_->manual(called + " " + p.impl_->name));
  return out;
}

Status Parser::Impl::unknown_flag(const std::string& called, const std::string& flag) const {
  std::vector<std::string> known{"--help"};
  if (!version.empty()) known.emplace_back("--version");
  for (const Row& row : table)
    for (auto& name : names_of(row))
      if (name.starts_with("-")) known.push_back(std::move(name));
  const std::string meant = did_you_mean(flag, known);
  const char* otherwise = commands.empty() ? "" : "; flags follow the command";
  return Error{fmt::format("{}: no such flag of {}{}", shown(flag), called, meant.empty() ? otherwise : meant)};
}

Status Parser::Impl::unknown_command(const std::string& called, const std::string& word) const {
  std::vector<std::string> known;
  for (const Parser& command : commands) known.push_back(command.impl_->name);
  const std::string all = fmt::format("{}", fmt::join(known, ", "));
  if (word.empty()) return Error{fmt::format("{} needs a command: {}", called, all)};
  const std::string meant = did_you_mean(word, known);
  return Error{fmt::format("{}: no such command of {}{}", shown(word), called,
                           meant.empty() ? fmt::format(", which has {}", all) : meant)};
}

// CLI11 counts a misspelt flag's value among what is wrong, and does not name the flag. command: the one that was
// chosen, with the program's name.
Status Parser::Impl::refuse_unknown(const std::string& called, std::span<const std::string> arguments,
                                    std::string& command) const {
  command = called;
  for (size_t i = 0; i < arguments.size(); ++i) {
    const std::string& word = arguments[i];
    if (word == "--" || word == "-h" || word == "--help" || (word == "--version" && !version.empty()))
      return ok_status();  // CLI11 has the rest
    if (word.starts_with("-") && !is_number(word) && word != "-") {
      const size_t equals = word.find('=');
      const Row* row = find(table, word.substr(0, equals));
      if (!row && word.size() > 2 && word[1] != '-') row = find(table, word.substr(0, 2));  // "-s4"
      if (!row) return unknown_flag(called, word.substr(0, equals));
      if (takes_value(*row) && equals == word.npos) ++i;
    } else if (!commands.empty()) {
      for (const Parser& p : commands)
        if (p.impl_->name == word)
          return p.impl_->refuse_unknown(fmt::format("{} {}", called, word), arguments.subspan(i + 1), command);
      return unknown_command(called, word);
    }
  }
  return commands.empty() ? ok_status() : unknown_command(called, {});
}

// ends: help or the like was asked for, and told.
Status Parser::Impl::read(const std::string& called, std::vector<std::string> arguments, std::ostream& told,
                          bool& ends) {
  std::string command;
  if (const Status s = refuse_unknown(called, arguments, command); !s) return s;
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  try {
    app->parse(std::move(arguments));
  } catch (const CLI::ExtrasError&) {
    return Error{fmt::format("{}: {} takes no more arguments", shown(app->remaining(true).front()), command)};
  } catch (const CLI::RequiredError& e) {
    const std::string_view what = e.what();
    return Error{
        fmt::format("{} needs {}; {} --help tells what that is", command, what.substr(0, what.find(' ')), command)};
  } catch (const CLI::ArgumentMismatch& e) {
    const std::string_view what = e.what();
    return Error{fmt::format("{}: its value is missing", what.substr(0, what.find(':')))};
  } catch (const CLI::ParseError& e) {
    if (app->exit(e, told, discarded()) != 0) return Error{e.what()};
    ends = true;
  }
  return ok_status();
}

void Parser::parse_or_exit(const std::string& program, std::vector<std::string> arguments) {
  auto& app = *impl_->app;
  const std::string name = program.substr(program.rfind('/') + 1);
  const auto refuse = [&](const std::string& why) {
    std::fputs(fmt::format("{}: {}\n", name, why).c_str(), stderr);
    std::exit(2);
  };
  if (app.get_name().empty()) app.name(name);
  if (!impl_->version.empty()) {
    const std::string told = fmt::format("{} {}", name, impl_->version);
    app.set_version_flag("--version", told, "Print which version this is and exit");
  }
  if (!impl_->version.empty() && arguments == std::vector<std::string>{"--man"}) {
    std::fputs(man_page(impl_->manual(name), impl_->version, true).c_str(), stdout);
    std::exit(0);
  }
  bool ends = false;
  if (const Status s = impl_->read(name, std::move(arguments), std::cout, ends); !s) refuse(s.error().text);
  if (ends) std::exit(0);
}

Status Parser::parse(const std::string& called, std::vector<std::string> arguments) {
  for (const Row& row : impl_->table)
    if (std::holds_alternative<Action>(row.value))
      for (const std::string& name : names_of(row))
        if (std::find(arguments.begin(), arguments.end(), name) != arguments.end())
          return Error{fmt::format("{}: tells something and ends {}", name, called)};
  bool ends = false;
  if (const Status s = impl_->read(called, std::move(arguments), discarded(), ends); !s) return s;
  return ends ? Status(Error{fmt::format("--help: is of {} alone", called)}) : ok_status();
}

bool Parser::chosen() const { return impl_->app->parsed(); }

Given Parser::given() const {
  Given out;
  for (const auto& [name, option] : impl_->options)
    if (option->count() > 0) out.push_back(name);
  return out;
}

}  // namespace telesplat::options
