#include "client/viewer/recent_files.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "common/core/whole_file.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;
constexpr size_t kLongestPath = 4096;

}  // namespace

std::string recent_files_path() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value ? value : "");
  };
  if (const std::string config = variable("XDG_CONFIG_HOME"); !config.empty()) return config + "/telesplat/recent";
  const std::string home = variable("HOME");
  return home.empty() ? "" : home + "/.config/telesplat/recent";
}

std::vector<std::string> read_recent(const std::string& list) {
  std::vector<std::string> out;
  const auto text = read_whole(list, kMostDescriptionBytes);
  std::istringstream in(text ? *text : std::string());
  for (std::string line; out.size() < kMostRecent && std::getline(in, line);)
    if (!line.empty() && line.size() <= kLongestPath && std::find(out.begin(), out.end(), line) == out.end())
      out.push_back(line);
  return out;
}

Status add_recent(const std::string& list, const std::string& data_set) {
  std::error_code error;
  const bool is_file = fs::exists(data_set, error);
  const std::string entry = is_file ? fs::absolute(data_set, error).lexically_normal().string() : data_set;
  if (list.empty() || entry.empty() || entry.size() > kLongestPath || entry.find('\n') != entry.npos)
    return Error{list + ": \"" + entry.substr(0, 80) + "\" cannot be kept in a list of lines"};
  auto all = read_recent(list);
  std::erase(all, entry);
  all.insert(all.begin(), entry);
  if (all.size() > kMostRecent) all.resize(kMostRecent);
  fs::create_directories(fs::path(list).parent_path(), error);
  std::string text;
  for (const auto& line : all) text += line + '\n';
  return write_whole(list, text);
}

}  // namespace telesplat::viewer
