#include "services/data/volume/formats/header_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace telesplat::data {
namespace {

std::vector<std::string> files_of_pattern(std::string_view text, const std::string& path) {
  const size_t blank = std::min(text.find_first_of(" \t"), text.size()), percent = text.find('%');
  const std::string_view name = text.substr(0, blank);
  const auto range = numbers(text.substr(blank));
  const auto bad = [&] { refuse("{}: {} is no pattern of files: NAME%03d FIRST LAST STEP", path, in_quotes(text)); };
  const size_t end = percent < blank ? name.find_first_not_of("0123456789", percent + 1) : name.npos;
  if (end == name.npos || name[end] != 'd' || !range || range->size() < 2 || name.find('%', end) != name.npos) bad();
  const bool padded = name[percent + 1] == '0';
  const auto width = size_t(number(name.substr(percent + 1, end - percent - 1)).value_or(0));
  const double first = (*range)[0], last = (*range)[1], step = range->size() > 2 ? (*range)[2] : 1;
  if (!(std::abs(first) < 1e9) || !(std::abs(last) < 1e9) || !(std::abs(step) >= 1) || width > 20 ||
      (last - first) / step < 0 || (last - first) / step >= double(kMostFiles))
    bad();
  std::vector<std::string> out;
  for (double n = first; step > 0 ? n <= last : n >= last; n += step)
    out.push_back(
        fmt::format("{}{}{}", name.substr(0, percent),
                    padded ? fmt::format("{:0{}}", int64_t(n), width) : fmt::format("{:{}}", int64_t(n), width),
                    name.substr(end + 1)));
  return out;
}

}  // namespace

std::optional<std::vector<double>> numbers(std::string_view text, bool loose) {
  std::string plain(text.substr(0, 4096));  // no header has more numbers in a line
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

glm::dmat4 placement(const glm::dvec3& s) { return placement({s.x, 0, 0}, {0, s.y, 0}, {0, 0, s.z}, glm::dvec3(0)); }

std::optional<glm::dvec3> spacing_of(std::string_view text) {
  const auto s = numbers(text, true);
  if (!s || s->size() != 3 || !((*s)[0] > 0 && (*s)[1] > 0 && (*s)[2] > 0)) return std::nullopt;
  return glm::dvec3((*s)[0], (*s)[1], (*s)[2]);
}

std::string_view field(const Fields& fields, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const auto found = fields.find(name); found != fields.end()) return found->second;
  return {};
}

bool take_files(std::string_view data, std::vector<std::string> listed, const std::string& path, VolumeFileHeader& h) {
  if (!data.starts_with("LIST")) {
    if (data.find('%') == data.npos) return false;
    listed = files_of_pattern(data, path);
  }
  if (listed.empty() || listed.size() > h.voxels() || h.voxels() % listed.size() != 0)
    refuse("{}: its {} voxels lie in {} files, not as many in each", path, h.voxels(), listed.size());
  h.data_path = beside(path, listed[0]);
  for (size_t i = 1; i < listed.size(); ++i) h.more_paths.push_back(beside(path, listed[i]));
  return true;
}

}  // namespace telesplat::data
