#include "services/data/base/numbered.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostFiles = 100'000;  // per folder

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }

// A file name, split into its numbers and the text between them ("run*-phase*.nrrd"). A decimal fraction is one number.
struct Numbered {
  std::string pattern;
  std::vector<std::string> numbers;
};
Numbered numbered(const std::string& name) {
  Numbered out;
  const auto digit = [&](size_t at) { return at < name.size() && name[at] >= '0' && name[at] <= '9'; };
  for (size_t at = 0; at < name.size();) {
    const size_t begin = at;
    while (digit(at)) ++at;
    if (at > begin && name[at] == '.' && digit(at + 1))
      for (++at; digit(at);) ++at;
    out.pattern += at > begin ? '*' : name[at];
    if (at > begin) out.numbers.push_back(name.substr(begin, at - begin));
    at += at == begin;
  }
  return out;
}

// Splits a number into its whole and fractional digits: "007.50" into "7" and "5".
std::pair<std::string, std::string> parts_of(const std::string& number) {
  const size_t dot = std::min(number.find('.'), number.size());
  std::string whole = number.substr(0, dot), fraction = dot < number.size() ? number.substr(dot + 1) : "";
  whole.erase(0, whole.find_first_not_of('0'));
  fraction.erase(fraction.find_last_not_of('0') + 1);
  return {whole, fraction};
}

bool lower_number(const std::string& a, const std::string& b) {
  const auto [whole_a, fraction_a] = parts_of(a);
  const auto [whole_b, fraction_b] = parts_of(b);
  return std::tuple(whole_a.size(), whole_a, fraction_a) < std::tuple(whole_b.size(), whole_b, fraction_b);
}

Error not_one_series(const std::vector<std::string>& paths, const std::string& folder) {
  std::map<std::string, size_t> patterns;
  for (const std::string& path : paths) ++patterns[numbered(file_name(path)).pattern];
  std::string names;
  size_t named = 0;
  for (const auto& [pattern, members] : patterns)
    if (named++ < 3) names += fmt::format("{}{} ({})", named > 1 ? ", " : "", pattern, members);
  return Error{fmt::format("{}: holds {} volumes that are not one numbered series: {}{}; name one of its files", folder,
                           paths.size(), names, named > 3 ? ", ..." : "")};
}

}  // namespace

Result<std::vector<std::string>> files_of_folder(const std::string& folder, int levels) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    std::error_code unreadable;
    if (entry->is_directory(unreadable) && entry.depth() + 1 >= levels) entry.disable_recursion_pending();
    const std::string path = entry->path().string();
    if (entry->is_regular_file(unreadable) && !file_name(path).starts_with('.')) paths.push_back(path);
    if (paths.size() > kMostFiles) return Error{fmt::format("{}: holds more than {} files", folder, kMostFiles)};
  }
  if (error) return Error{fmt::format("{}: cannot be read: {}", folder, error.message())};
  std::sort(paths.begin(), paths.end());
  return paths;
}

Result<std::vector<std::string>> numbered_series(const std::vector<std::string>& paths, const std::string& folder) {
  std::vector<std::pair<Numbered, std::string>> members;
  for (const std::string& path : paths) members.emplace_back(numbered(file_name(path)), path);
  const Numbered first = members[0].first;
  std::set<size_t> differing;
  for (const auto& [n, path] : members) {
    if (n.pattern != first.pattern) return not_one_series(paths, folder);
    for (size_t i = 0; i < n.numbers.size(); ++i)
      if (lower_number(n.numbers[i], first.numbers[i]) || lower_number(first.numbers[i], n.numbers[i]))
        differing.insert(i);
  }
  if (members.size() > 1 && differing.empty())
    return Error{fmt::format("{}: {} and {} have the same number", folder, file_name(paths[0]), file_name(paths[1]))};
  if (differing.empty()) return paths;
  const size_t counter = *differing.begin();
  std::sort(members.begin(), members.end(),
            [&](auto& a, auto& b) { return lower_number(a.first.numbers[counter], b.first.numbers[counter]); });
  // Other numbers may differ, too, if they grow with the counter (a step and its time).
  for (size_t i = 1; i < members.size(); ++i) {
    const auto &a = members[i - 1].first.numbers, &b = members[i].first.numbers;
    for (const size_t n : differing)
      if (!lower_number(a[n], b[n])) {
        if (differing.size() > 1) return not_one_series(paths, folder);
        return Error{fmt::format("{}: {} and {} have the same number", folder, file_name(members[i - 1].second),
                                 file_name(members[i].second))};
      }
  }
  std::vector<std::string> steps;
  for (auto& [n, path] : members) steps.push_back(std::move(path));
  return steps;
}

}  // namespace telesplat::data
