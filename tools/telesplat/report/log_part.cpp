// Warnings and errors in the logs of a run: lines "12:25:21.659 master warning what happened".
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/core/utf8.h"
#include "tools/telesplat/report/about_part.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr size_t kMostLogs = 64, kMostLines = 8, kLongestLine = 400;
constexpr size_t kMostBytes = size_t{256} << 20;

// The word at this place, from 0, of words with one space between them.
std::string_view word(std::string_view line, int place) {
  for (int i = 0; i < place; ++i) {
    const size_t space = line.find(' ');
    if (space == line.npos) return {};
    line.remove_prefix(space + 1);
  }
  return line.substr(0, line.find(' '));
}

ordered_json log_json(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  size_t warnings = 0, errors = 0, bytes = 0;
  ordered_json lines = ordered_json::array();
  for (std::string line; bytes < kMostBytes && std::getline(in, line); bytes += line.size()) {
    const auto level = word(line, 2);
    const bool warning = level == "warning", error = level == "error" || level == "critical";
    warnings += warning, errors += error;
    if ((warning || error) && lines.size() < kMostLines)
      lines.push_back(to_utf8(std::string_view(line).substr(0, kLongestLine)));
  }
  return {{"process", to_utf8(path.stem().string())}, {"warnings", warnings}, {"errors", errors}, {"lines", lines}};
}

}  // namespace

ordered_json logs_json(const std::string& directory) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(directory + "/logs", error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".log") paths.push_back(entry->path());
  std::sort(paths.begin(), paths.end());
  if (paths.size() > kMostLogs) paths.resize(kMostLogs);
  ordered_json out = ordered_json::array();
  for (const auto& path : paths) out.push_back(log_json(path));
  return out;
}

}  // namespace telesplat::launcher
