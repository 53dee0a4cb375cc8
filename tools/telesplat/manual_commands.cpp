// `telesplat completion SHELL` and `telesplat man`: texts for shells and man(1), made from the tables of --help.
#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>

#include "common/core/version.h"
#include "common/options/complain.h"
#include "common/options/manual.h"
#include "common/options/suggest.h"
#include "tools/telesplat/command.h"
#include "tools/telesplat/run/process_group.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr std::array kServices{"master", "data", "sampler", "packer", "viewer", "health", "wan-relay"};

struct CompletionOptions {
  std::string shell;
  std::vector<std::string> words;
};
struct ManOptions {
  std::vector<std::string> words;
  std::string out;
};

options::Table completion_table(CompletionOptions& o) {
  return {{.flag = "shell",
           .value = &o.shell,
           .help = "prints a script for this shell; of bash: source <(telesplat completion bash)",
           .limits = options::Names{"bash", "zsh", "fish", "words"},
           .required = true},
          {.flag = "typed", .value = &o.words, .help = "what the scripts ask: words behind words --"}};
}

options::Table man_table(ManOptions& o) {
  return {{.flag = "command",
           .value = &o.words,
           .help = "a command of telesplat, or a service: master, data, sampler, packer, viewer, health, wan-relay; "
                   "default: telesplat itself"},
          {.flag = "--out", .value = &o.out, .help = "folder to write all pages to instead: telesplat.1, ..."}};
}

options::Manual manual_of(const std::string& name, const Command& command) {
  options::Manual out{name, command.help, command.table, command.footer, {}};
  for (const Command& c : command.commands) out.commands.push_back(manual_of(name + " " + c.name, c));
  return out;
}

// Writes the page of telesplat, of one of its commands, or of a service.
Result<std::string> page_of(const options::Manual& all, const std::string& word) {
  if (word.empty() || word == "telesplat") return options::man_page(all, version(), true);
  std::vector<std::string> known;
  for (const auto& m : all.commands) {
    known.push_back(m.name.substr(m.name.rfind(' ') + 1));
    if (known.back() == word) return options::man_page(m, version(), false);
  }
  const std::string service = word.starts_with("telesplat-") ? word.substr(10) : word;
  for (const char* name : kServices) {
    known.emplace_back(name);
    if (service != name) continue;
    std::string page = output_of("telesplat-" + service, "--man");
    if (page.empty()) return Error{fmt::format("telesplat-{} is not beside telesplat", service)};
    return page;
  }
  return Error{
      fmt::format("man {}: no such command or service{}", word.substr(0, 80), options::did_you_mean(word, known))};
}

Status write_pages(const options::Manual& all, const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  std::vector<std::pair<std::string, std::string>> pages{{"telesplat", ""}};
  for (const auto& m : all.commands) {
    const std::string word = m.name.substr(m.name.rfind(' ') + 1);
    pages.emplace_back("telesplat-" + word, word);
  }
  for (const char* name : kServices) pages.emplace_back(fmt::format("telesplat-{}", name), name);
  for (const auto& [file, word] : pages) {
    const auto text = page_of(all, word);
    if (!text) return text.error();
    const std::string path = fs::path(folder) / (file + ".1");
    if (!(std::ofstream(path) << *text).flush()) return Error{fmt::format("{}: cannot be written", path)};
  }
  return ok_status();
}

// Shows the page with man(1), if stdout is a terminal and man is installed.
void show(const std::string& page) {
  if (isatty(STDOUT_FILENO))
    if (const std::unique_ptr<FILE, int (*)(FILE*)> reader(
            popen("command -v man > /dev/null && exec man -l - || exec cat", "w"), pclose);
        reader) {
      std::fputs(page.c_str(), reader.get());
      return;
    }
  std::fputs(page.c_str(), stdout);
}

int man(const options::Manual& all, const ManOptions& o) {
  if (!o.out.empty()) {
    const Status s = write_pages(all, o.out);
    return s ? 0 : complain(s.error());
  }
  if (o.words.size() > 1) return complain({fmt::format("man: one command, not {} and {}", o.words[0], o.words[1])});
  const auto page = page_of(all, o.words.empty() ? "" : o.words.front());
  if (!page) return complain(page.error());
  show(*page);
  return 0;
}

int complete(const options::Manual& all, const CompletionOptions& o) {
  using options::Shell;
  const Shell of = o.shell == "bash" ? Shell::kBash : o.shell == "zsh" ? Shell::kZsh : Shell::kFish;
  std::fputs((o.shell == "words" ? options::candidates(all, o.words) : options::completion(all.name, of)).c_str(),
             stdout);
  return 0;
}

}  // namespace

std::vector<Command> with_manuals(const std::string& about, std::vector<Command> commands) {
  const auto completion_options = std::make_shared<CompletionOptions>();
  const auto man_options = std::make_shared<ManOptions>();
  commands.push_back({.name = "completion",
                      .help = "print a script that completes telesplat's commands and flags in a shell",
                      .table = completion_table(*completion_options),
                      .run = {}});
  commands.push_back(
      {.name = "man", .help = "show or write manual pages", .table = man_table(*man_options), .run = {}});
  options::Manual all{"telesplat", about, {}, {}, {}};
  for (const Command& c : commands) all.commands.push_back(manual_of("telesplat " + c.name, c));
  // The tables point into `commands`: keep a copy as long as these functions.
  const auto owned = std::make_shared<std::vector<Command>>(commands);
  commands[commands.size() - 2].run = [all, owned, o = completion_options](const options::Given&) {
    return complete(all, *o);
  };
  commands.back().run = [all, owned, o = man_options](const options::Given&) { return man(all, *o); };
  return commands;
}

}  // namespace telesplat::launcher
