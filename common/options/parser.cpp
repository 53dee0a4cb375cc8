#include "common/options/parser.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <deque>

namespace telesplat::options {

struct Parser::Impl {
  explicit Impl(CLI::App& a) : app(&a) {}
  explicit Impl(const std::string& about) : own(std::make_unique<CLI::App>(about)), app(own.get()) {
    // The command line wins over a scene file, whose flags come first.
    app->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  }
  std::unique_ptr<CLI::App> own;
  CLI::App* app;
  std::deque<Parser> commands;
  std::vector<std::pair<std::string, CLI::Option*>> options;  // by the row's name
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
    return fmt::format("{} in [{} - {}]", type, range->least, range->most);
  return type;
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
  if (auto* const* many = std::get_if<std::vector<std::string>*>(&row.value))
    return app.add_option(row.flag, **many, row.help)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
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
  }
}

Parser& Parser::command(const std::string& name, const std::string& about) {
  impl_->app->require_subcommand(1);
  impl_->commands.push_back(Parser(std::make_unique<Impl>(*impl_->app->add_subcommand(name, about))));
  return impl_->commands.back();
}

void Parser::footer(const std::string& text) { impl_->app->footer(text); }

void Parser::parse_or_exit(const std::string& program, std::vector<std::string> arguments) {
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  auto& app = *impl_->app;
  if (app.get_name().empty()) app.name(program);
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& e) {
    std::exit(app.exit(e) == 0 ? 0 : 2);
  }
}

bool Parser::chosen() const { return impl_->app->parsed(); }

Given Parser::given() const {
  Given out;
  for (const auto& [name, option] : impl_->options)
    if (option->count() > 0) out.push_back(name);
  return out;
}

}  // namespace telesplat::options
