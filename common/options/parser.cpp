#include "common/options/parser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <span>

#include "common/core/utf8.h"
#include "common/options/manual.h"
#include "common/options/suggest.h"

namespace telesplat::options {
namespace {

using Words = std::span<const std::string>;

// True for a negative number, which is not a flag.
bool is_number(const std::string& word) {
  return word.find_first_not_of("-+.,:0123456789eE%") == word.npos && word.find_first_of("0123456789") != word.npos;
}
bool is_flag(const std::string& word) { return word.size() > 1 && word.starts_with("-") && !is_number(word); }

std::string shown(const std::string& word) { return word.empty() ? "\"\"" : to_utf8(word.substr(0, 200)); }

bool takes_several(const Row& row) { return std::holds_alternative<std::vector<std::string>*>(row.value); }

}  // namespace

struct Parser::Impl {
  std::string name, about, end, version;
  Table table;
  std::deque<Parser> commands;
  bool chosen = false;
  Given given;

  // Text to print, instead of running the program.
  struct Told {
    std::string text;
  };
  struct Value {
    const Row* row;
    std::string text;
  };

  Manual manual(const std::string& called) const;
  Status unknown_flag(const std::string& called, const std::string& flag) const;
  Status unknown_command(const std::string& called, const std::string& word) const;
  Status take(const std::string& called, const std::string& word, size_t places, std::vector<Value>& values) const;
  Status take_flag(const std::string& called, Words words, size_t& at, std::vector<Value>& values) const;
  Status set_all(const std::string& called, std::vector<Value> values);
  Status read(const std::string& called, Words words, Told& told);
};

Parser::Parser(const std::string& about) : impl_(std::make_unique<Impl>()) { impl_->about = about; }
Parser::~Parser() = default;
Parser::Parser(Parser&&) noexcept = default;

void Parser::add(const Table& table) { impl_->table = joined(std::move(impl_->table), table); }

Parser& Parser::command(const std::string& name, const std::string& about) {
  impl_->commands.emplace_back(about).impl_->name = name;
  return impl_->commands.back();
}

void Parser::footer(const std::string& text) { impl_->end = text; }

void Parser::version(const std::string& text) { impl_->version = text; }

Manual Parser::Impl::manual(const std::string& called) const {
  Manual out{called, about, table, end, {}};
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

// Takes an argument by its position; `places` arguments came before it.
Status Parser::Impl::take(const std::string& called, const std::string& word, size_t places,
                          std::vector<Value>& values) const {
  for (const Row& row : table) {
    if (name_of(row).starts_with("-")) continue;
    if (places > 0 && !takes_several(row) && places--) continue;
    values.push_back({&row, word});
    return ok_status();
  }
  return Error{fmt::format("{}: {} takes no more arguments", shown(word), called)};
}

// at: index of the flag; becomes the index of the last word that belongs to it.
Status Parser::Impl::take_flag(const std::string& called, Words words, size_t& at, std::vector<Value>& values) const {
  const std::string& word = words[at];
  size_t end = word.find('=');
  std::string name = word.substr(0, end);
  const Row* row = find(table, name);
  if (!row && word[1] != '-') row = find(table, name = word.substr(0, end = 2));  // "-s4"
  if (!row) return unknown_flag(called, word.substr(0, word.find('=')));
  const bool attached = end < word.size();
  if (!takes_value(*row)) {
    values.push_back({row, "true"});
    return attached ? Status(Error{fmt::format("{}: takes no value", name)}) : ok_status();
  }
  if (!attached && at + 1 == words.size()) return Error{fmt::format("{}: its value is missing", name)};
  values.push_back({row, attached ? word.substr(end + (word[end] == '=' ? 1 : 0)) : words[++at]});
  return ok_status();
}

// The last value of each flag counts: flags of a scene file come before those of the command line.
Status Parser::Impl::set_all(const std::string& called, std::vector<Value> values) {
  for (const Row& row : table) {
    const auto is_its = [&](const Value& v) { return v.row == &row; };
    const char* const usual = row.environment.empty() ? nullptr : std::getenv(row.environment.c_str());
    if (std::none_of(values.begin(), values.end(), is_its)) {
      if (row.required) return Error{fmt::format("{0} needs {1}; {0} --help tells what that is", called, name_of(row))};
      if (!usual || !*usual) continue;
      values.push_back({&row, usual});
    }
    given.push_back(name_of(row));
    for (size_t i = 0; i < values.size(); ++i) {
      if (!is_its(values[i])) continue;
      if (!takes_several(row) && std::any_of(values.begin() + ptrdiff_t(i) + 1, values.end(), is_its)) continue;
      if (const Status s = set(row, values[i].text); !s) return s;
    }
  }
  return ok_status();
}

Status Parser::Impl::read(const std::string& called, Words words, Told& told) {
  chosen = true;
  std::vector<Value> values;
  size_t places = 0;
  bool flags = true;
  Status extra = ok_status();  // reported if there is no other error
  for (size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (flags && (word == "-h" || word == "--help")) {
      told.text = help_text(manual(called), i + 1 < words.size() && words[i + 1] == "all");
      return ok_status();
    }
    if (flags && word == "--version" && !version.empty()) {
      told.text = fmt::format("{} {}\n", called, version);
      return ok_status();
    }
    if (flags && word == "--") {
      flags = false;
    } else if (flags && is_flag(word)) {
      if (const Status s = take_flag(called, words, i, values); !s) return s;
    } else if (commands.empty()) {
      if (Status s = take(called, word, places++, values); extra && !s) extra = std::move(s);
    } else {
      for (Parser& p : commands)
        if (p.impl_->name == word) {
          if (const Status s = set_all(called, std::move(values)); !s) return s;
          return p.impl_->read(fmt::format("{} {}", called, word), words.subspan(i + 1), told);
        }
      return unknown_command(called, word);
    }
  }
  if (!commands.empty()) return unknown_command(called, {});
  const Status all = set_all(called, std::move(values));
  return all ? extra : all;
}

void Parser::parse_or_exit(const std::string& program, std::vector<std::string> arguments) {
  const std::string name = program.substr(program.rfind('/') + 1);
  Impl::Told told;
  if (!impl_->version.empty() && arguments == std::vector<std::string>{"--man"})
    told.text = man_page(impl_->manual(name), impl_->version, true);
  else if (const Status s = impl_->read(name, arguments, told); !s) {
    std::fputs(fmt::format("{}: {}\n", name, s.error().text).c_str(), stderr);
    std::exit(2);
  }
  if (told.text.empty()) return;
  std::fputs(told.text.c_str(), stdout);
  std::exit(0);
}

Status Parser::parse(const std::string& called, std::vector<std::string> arguments) {
  Impl::Told told;
  if (const Status s = impl_->read(called, arguments, told); !s) return s;
  return told.text.empty() ? ok_status() : Status(Error{fmt::format("--help: is of {} alone", called)});
}

bool Parser::chosen() const { return impl_->chosen; }

Given Parser::given() const { return impl_->given; }

}  // namespace telesplat::options
