#include "tools/telesplat/report/plots.h"

#include <fmt/format.h>

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

}  // namespace

Result<std::vector<std::string>> make_plots(const ordered_json& data, const std::string& folder,
                                            const ShouldStop& should_stop) {
  const std::string python = find_program("python3");
  if (python.empty()) return Error{"python3 is not installed"};
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return Error{fmt::format("{}: cannot be made a folder: {}", folder, error.message())};
  auto process = PipedProcess::start(python, {"-c", std::string(page_files::plots_py), folder});
  if (!process) return process.error();
  const std::string text = for_plots(data).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  process->write(std::as_bytes(std::span(text)), should_stop);
  const int code = process->finish(should_stop);
  std::vector<std::string> out;
  std::istringstream lines(process->output());
  for (std::string line; std::getline(lines, line);) out.push_back((fs::path(folder) / line).string());
  if (code == 0) return out;
  fs::remove(folder, error);  // if it is empty
  if (code < 0) return Error{"interrupted"};
  const std::string why = process->last_error_line();
  return Error{why.empty() ? fmt::format("python3 ended with code {}", code) : why};
}

}  // namespace telesplat::launcher
