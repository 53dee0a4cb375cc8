// Warnings and errors in the logs of a run: lines "12:25:21.659 master warning what happened".
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/core/utf8.h"
#include "tools/telesplat/report/parts.h"
#include "tools/telesplat/report/reading/run_tables.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr size_t kMostLogs = 64, kMostLines = 8;
constexpr size_t kLongestLine = size_t{64} << 10, kShownOfALine = 400;
constexpr uint64_t kMostBytes = uint64_t{256} << 20;

// Returns word number `place`, from 0; one space separates words.
std::string_view word(std::string_view line, int place) {
  for (int i = 0; i < place; ++i) {
    const size_t space = line.find(' ');
    if (space == line.npos) return {};
    line.remove_prefix(space + 1);
  }
  return line.substr(0, line.find(' '));
}

/// A line of a file that may be anything: no line takes more memory than kLongestLine.
struct Line {
  std::string text;
  uint64_t left_out = 0;  ///< bytes behind the text
};
// False: the file has ended.
bool next_line(std::istream& in, Line& out) {
  out.text.resize(kLongestLine + 1);
  in.getline(out.text.data(), std::streamsize(out.text.size()));
  const auto bytes = size_t(in.gcount());
  const bool longer = in.fail() && bytes > 0;
  out.text.resize(in.good() ? bytes - 1 : bytes);  // without its line end
  out.left_out = 0;
  if (!longer) return bytes > 0;
  in.clear();
  in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  out.left_out = uint64_t(in.gcount()) - (in.eof() ? 0 : 1);
  return true;
}

// Cuts a long line and adds the number of bytes cut off.
std::string shown(const Line& line) {
  const std::string text = to_utf8(line.text.substr(0, kShownOfALine));
  const uint64_t more = line.left_out + line.text.size() - std::min(line.text.size(), kShownOfALine);
  return more == 0 ? text : fmt::format("{} ... ({} bytes more)", text, more);
}

ordered_json log_json(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  Line line;
  uint64_t bytes = 0;
  size_t warnings = 0, errors = 0;
  ordered_json lines = ordered_json::array();
  for (; bytes < kMostBytes && next_line(in, line); bytes += line.text.size() + line.left_out + 1) {
    const auto level = word(line.text, 2);
    const bool warning = level == "warning", error = level == "error" || level == "critical";
    warnings += warning, errors += error;
    if ((warning || error) && lines.size() < kMostLines) lines.push_back(shown(line));
  }
  ordered_json out{
      {"process", to_utf8(path.stem().string())}, {"warnings", warnings}, {"errors", errors}, {"lines", lines}};
  if (bytes >= kMostBytes) out["read_mb"] = kMostBytes >> 20;
  return out;
}

}  // namespace

ordered_json logs_json(const std::string& directory) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (fs::directory_iterator entry(directory + "/logs", error), end; !error && entry != end; entry.increment(error))
    if (std::error_code unknown; entry->path().extension() == ".log" && entry->is_regular_file(unknown) &&
                                 lies_within(directory, "logs/" + entry->path().filename().string()))
      paths.push_back(entry->path());
  std::sort(paths.begin(), paths.end());
  if (paths.size() > kMostLogs) paths.resize(kMostLogs);
  ordered_json out = ordered_json::array();
  for (const auto& path : paths) out.push_back(log_json(path));
  return out;
}

}  // namespace telesplat::launcher
