#include "services/data/volume/formats/header_text.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "services/data/base/text_scanner.h"

namespace telesplat::data {

std::string_view trim(std::string_view text) {
  while (!text.empty() && static_cast<unsigned char>(text.front()) <= ' ') text.remove_prefix(1);
  while (!text.empty() && static_cast<unsigned char>(text.back()) <= ' ') text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return out;
}

std::optional<std::vector<double>> numbers(std::string_view text, bool loose) {
  std::string plain(text.substr(0, 4096));  // no header has that many numbers in a line
  if (loose)
    std::replace_if(
        plain.begin(), plain.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  TextScanner scanner(plain);
  std::vector<double> out;
  while (scanner.skip_space()) {
    double value = 0;
    if (!scanner.number(value)) return std::nullopt;
    out.push_back(value);
  }
  return out;
}

std::optional<double> number(std::string_view text) {
  const auto all = numbers(text);
  return all && all->size() == 1 ? std::optional(all->front()) : std::nullopt;
}

std::optional<std::vector<int64_t>> whole_numbers(std::string_view text) {
  const auto all = numbers(text);
  if (!all) return std::nullopt;
  std::vector<int64_t> out;
  for (const double v : *all) {
    if (!(v >= 0 && v <= 9007199254740992.0) || v != std::floor(v)) return std::nullopt;
    out.push_back(static_cast<int64_t>(v));
  }
  return out;
}

std::string beside(const std::string& path, std::string_view name) {
  return (std::filesystem::path(path).parent_path() / std::filesystem::path(name)).string();
}

std::string in_quotes(std::string_view text) {
  std::string out = "\"" + std::string(text.substr(0, 60)) + (text.size() > 60 ? "...\"" : "\"");
  std::replace_if(
      out.begin(), out.end(), [](char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }, '?');
  return out;
}

glm::dmat4 placement(const glm::dvec3& i, const glm::dvec3& j, const glm::dvec3& k, const glm::dvec3& origin) {
  return {glm::dvec4(i, 0), glm::dvec4(j, 0), glm::dvec4(k, 0), glm::dvec4(origin, 1)};
}

}  // namespace telesplat::data
