#include "tools/telesplat/inspect/run_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>

#include "tools/telesplat/record/skip.h"
#include "tools/telesplat/run/run_report.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

struct File {
  std::string name;  // from the run folder on
  uint64_t bytes = 0;
};

// Subfolders after the folder's own files, each by name.
std::vector<File> files_below(const std::string& directory) {
  std::vector<File> out;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_regular_file(error))
      out.push_back({entry->path().lexically_relative(directory).string(), uint64_t(entry->file_size(error))});
  const auto depth = [](const File& f) { return std::count(f.name.begin(), f.name.end(), '/') > 0; };
  std::sort(out.begin(), out.end(),
            [&](const File& a, const File& b) { return depth(a) != depth(b) ? depth(a) < depth(b) : a.name < b.name; });
  return out;
}

void describe_scene(const std::string& directory, data::Description& out) {
  std::error_code error;
  if (!fs::exists(directory + "/session.toml", error)) return;
  const auto scene = recorded_scene(directory);
  if (!scene) {
    out.row("scene", "cannot be told: " + scene.error().text);
    out.json["scene_error"] = scene.error().text;
    return;
  }
  std::istringstream lines((*scene)->describe_record());
  std::string line;
  for (bool first = true; std::getline(lines, line); first = false) out.row(first ? "scene" : "", line);
}

// A row for each of its own files, one for all of a subfolder.
void describe_files(const std::string& directory, data::Description& out) {
  const std::vector<File> files = files_below(directory);
  std::map<std::string, std::pair<size_t, uint64_t>> folders;  // files, bytes
  uint64_t all = 0;
  for (const File& f : files) {
    all += f.bytes;
    out.json["files"].push_back({{"name", f.name}, {"bytes", f.bytes}});
  }
  out.row("files", fmt::format("{}, {}", files.size(), data::bytes_text(all)));
  for (const File& f : files) {
    const size_t slash = f.name.find('/');
    if (slash == f.name.npos) {
      out.row("", fmt::format("{:<18} {:>12} bytes", f.name, f.bytes));
      continue;
    }
    auto& [count, bytes] = folders[f.name.substr(0, slash + 1)];
    ++count, bytes += f.bytes;
  }
  for (const auto& [name, sum] : folders)
    out.row("", fmt::format("{:<18} {:>12} bytes in {} files", name, sum.second, sum.first));
}

}  // namespace

Result<data::Description> inspect_run(const std::string& directory, double skip_s) {
  auto summary = summary_without_beginning(directory, skip_s);
  if (!summary && skip_s > 0) return summary.error();
  if (!summary)
    return Error{
        fmt::format("{}: is a folder that holds neither a finished run, which has a summary.json, nor a volume: DICOM "
                    "slices or a numbered series of volume files ({})",
                    directory, summary.error().text)};
  data::Description out("run", fmt::format("{}: a run", directory));
  out.json["path"] = directory;
  out.json["summary"] = *std::move(summary);
  if (const auto report = read_report(directory, skip_s)) {
    out.row("shown", report->head);
    for (const auto& [what, value] : report->lines) out.row(what, value);
  } else {
    out.row("figures", "cannot be told: " + report.error().text);
  }
  describe_scene(directory, out);
  describe_files(directory, out);
  return out;
}

}  // namespace telesplat::launcher
