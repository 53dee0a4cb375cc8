#include "common/options/suggest.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/core/nearest.h"

namespace telesplat::options {
namespace {

// Shorter words resemble too many others.
constexpr size_t kLeastLetters = 3;

size_t letters(std::string_view word) { return word.size() - std::min(word.find_first_not_of('-'), word.size()); }

std::optional<std::string_view> only_one_that_begins(std::string_view word,
                                                     const std::vector<std::string>& candidates) {
  std::optional<std::string_view> out;
  for (const auto& candidate : candidates) {
    if (!candidate.starts_with(word)) continue;
    if (out) return std::nullopt;
    out = candidate;
  }
  return out;
}

}  // namespace

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  if (letters(word) < kLeastLetters) return {};
  const std::vector<std::string_view> views(candidates.begin(), candidates.end());
  auto meant = only_one_that_begins(word, candidates);
  if (!meant) meant = nearest_word(word, views);
  return meant ? fmt::format("; did you mean {}?", *meant) : std::string();
}

}  // namespace telesplat::options
