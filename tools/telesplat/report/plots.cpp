#include "tools/telesplat/report/plots.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/telesplat/movie/movie_target.h"
#include "tools/telesplat/report/page_files.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

// What plots do not need would only travel.
ordered_json for_plots(const ordered_json& data) {
  ordered_json out{{"runs", ordered_json::array()}};
  for (const auto& run : data.at("runs")) {
    ordered_json one;
    for (const char* key : {"name", "series", "spreads", "stages", "trace"}) one[key] = run.at(key);
    out["runs"].push_back(std::move(one));
  }
  return out;
}

// The system's, which has the system's matplotlib, before another that stands in front of it.
std::vector<std::string> pythons() {
  std::vector<std::string> out;
  for (const std::string& path : {std::string("/usr/bin/python3"), find_program("python3")})
    if (!path.empty() && access(path.c_str(), X_OK) == 0 && (out.empty() || out.front() != path)) out.push_back(path);
  return out;
}

// The paths of what it drew of `text`, a page's data. Python takes modules, and matplotlib its settings, from the
// working folder first, which may be a stranger's run: it works in the root folder.
Result<std::vector<std::string>> draw(const std::string& python, const std::string& text, const std::string& folder,
                                      const ShouldStop& should_stop) {
  auto process =
      PipedProcess::start(python, {"-c", std::string(page_files::plots_py), fs::absolute(folder).string()}, "/");
  if (!process) return process.error();
  process->write(std::as_bytes(std::span(text)), should_stop);
  const int code = process->finish(should_stop);
  if (code < 0) return Error{"interrupted"};
  if (code != 0) {
    const std::string why = process->last_error_line();
    return Error{why.empty() ? fmt::format("{} ended with code {}", python, code) : why};
  }
  std::vector<std::string> out;
  std::istringstream lines(process->output());
  for (std::string line; std::getline(lines, line);) out.push_back((fs::path(folder) / line).string());
  return out;
}

// The run may be a stranger's.
Status refuse_links(const std::string& folder) {
  const auto refuse = [](const fs::path& path) {
    return Error{fmt::format("{}: is a symbolic link, which plots would be written through; remove it", path.string())};
  };
  std::error_code error;
  if (fs::is_symlink(fs::symlink_status(folder, error))) return refuse(folder);
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (fs::is_symlink(entry->symlink_status(error))) return refuse(entry->path());
  return ok_status();
}

}  // namespace

Result<std::vector<std::string>> make_plots(const ordered_json& data, const std::string& folder,
                                            const ShouldStop& should_stop) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: cannot be made a folder: {}", folder, error.message())};
  if (const Status s = refuse_links(folder); !s) return s.error();
  const std::string text = for_plots(data).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  Result<std::vector<std::string>> out = Error{"python3 is not installed"};
  for (const std::string& python : pythons()) {
    out = draw(python, text, folder, should_stop);
    if (out || should_stop()) break;
  }
  if (!out) fs::remove(folder, error);  // if it is empty
  return out;
}

}  // namespace telesplat::launcher
