#include <fmt/format.h>

#include <algorithm>

#include "common/options/manual.h"

namespace telesplat::options {
namespace {

std::string last_word(const std::string& name) { return name.substr(name.rfind(' ') + 1); }

// Collects words that may follow, each with its meaning.
class Offer {
 public:
  Offer(std::string before, std::string typed) : before_(std::move(before)), typed_(std::move(typed)) {}
  void add(const std::string& word, std::string about = {}) {
    if (!word.starts_with(typed_)) return;
    std::replace(about.begin(), about.end(), '\n', ' ');
    text_ += fmt::format("{}{}\t{}\n", before_, word, about);
  }
  void add_values(const Row& row) {
    if (row.on_off) add("on"), add("off");
    if (const auto* names = std::get_if<Names>(&row.limits))
      for (const std::string& name : *names) add(name);
  }
  std::string text() const { return text_; }

 private:
  std::string before_, typed_, text_;
};

constexpr const char* kBash = R"(# bash completion of {0}, printed by `{0} completion bash`
_{0}() {{
  mapfile -t COMPREPLY < <("${{COMP_WORDS[0]}}" completion words -- "${{COMP_WORDS[@]:1:COMP_CWORD}}" 2> /dev/null |
    cut -f1)
}}
complete -o bashdefault -o default -F _{0} {0}
)";
// In a folder of functions, zsh takes the file itself as the function when it is first called.
constexpr const char* kZsh = R"(#compdef {0}
# zsh completion of {0}, printed by `{0} completion zsh`
_{0}() {{
  local -a entries
  entries=("${{(@f)$("$words[1]" completion words -- "${{(@)words[2,CURRENT]}}" 2> /dev/null)}}")
  entries=("${{(@)entries//:/\\:}}")
  entries=("${{(@)entries/$'\t'/:}}")
  [[ -n $entries[1] ]] && _describe {0} entries || _files
}}
if [[ $funcstack[1] == _{0} ]]; then
  _{0} "$@"
else
  compdef _{0} {0}
fi
)";
constexpr const char* kFish = R"(# fish completion of {0}, printed by `{0} completion fish`
function __{0}_words
  set -l words (commandline -opc) (commandline -ct)
  $words[1] completion words -- $words[2..] 2> /dev/null
end
complete -c {0} -a '(__{0}_words)'
)";

}  // namespace

std::string candidates(const Manual& program, std::vector<std::string> words) {
  if (words.empty()) words.emplace_back();
  const Manual* m = &program;
  const Row* awaits = nullptr;  // flag whose value comes next
  for (size_t i = 0; i + 1 < words.size(); ++i) {
    if (words[i] == "=") continue;  // bash splits --flag=value into three words
    const Row* row = find(m->table, words[i]);
    awaits = !awaits && row && takes_value(*row) ? row : nullptr;
    for (const Manual& c : m->commands)
      if (last_word(c.name) == words[i]) {
        m = &c;
        break;
      }
  }
  std::string& typed = words.back();
  std::string before;
  if (typed == "=") typed.clear();
  if (const size_t equals = typed.find('='); !awaits && typed.starts_with("--") && equals != typed.npos) {
    awaits = find(m->table, typed.substr(0, equals));
    before = typed.substr(0, equals + 1);
    typed.erase(0, equals + 1);
  }
  Offer out(before, typed);
  if (awaits) return out.add_values(*awaits), out.text();
  for (const Manual& c : m->commands) out.add(last_word(c.name), about_text(c));
  if (typed.starts_with("-")) out.add("--help", "print help");
  if (typed.starts_with("-") && m == &program) out.add("--version", "print the version");
  for (const Row& row : m->table) {
    if (!name_of(row).starts_with("-")) out.add_values(row);
    if (typed.starts_with("-"))
      for (const std::string& name : names_of(row))
        if (name.starts_with("-")) out.add(name, row.help);
  }
  return out.text();
}

std::string completion(const std::string& program, Shell shell) {
  return fmt::format(fmt::runtime(shell == Shell::kBash ? kBash : shell == Shell::kZsh ? kZsh : kFish), program);
}

}  // namespace telesplat::options
