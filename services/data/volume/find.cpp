// What a path holds: a volume file, a folder of DICOM slices, a folder of numbered volume files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "services/data/volume/formats/dicom_series.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostFiles = 100'000;  // in a folder

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }

std::string format_of(const std::string& path) {
  const auto start = read_start(path);
  return start ? volume_format(*start, path) : "";
}

// Regular files that are not hidden, by name.
Result<std::vector<std::string>> files_in(const std::string& folder) {
  std::vector<std::string> paths;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string path = entry->path().string();
    if (entry->is_regular_file(error) && !file_name(path).starts_with('.')) paths.push_back(path);
    if (paths.size() > kMostFiles) return Error{fmt::format("{}: holds more than {} files", folder, kMostFiles)};
  }
  if (error) return Error{fmt::format("{}: cannot be read: {}", folder, error.message())};
  std::sort(paths.begin(), paths.end());
  return paths;
}

// A name around its last number: phase08.nrrd is "phase*.nrrd" and "8".
struct Numbered {
  std::string pattern, number;  // number: without leading zeros; pattern without a star: no number
};
Numbered numbered(const std::string& name) {
  const size_t dot = std::min(name.find('.', 1), name.size());
  constexpr const char* kDigits = "0123456789";
  size_t last = name.substr(0, dot).find_last_of(kDigits);
  if (last == name.npos) last = name.substr(0, fs::path(name).stem().string().size()).find_last_of(kDigits);
  if (last == name.npos) return {name, ""};
  const size_t before = name.find_last_not_of(kDigits, last), first = before == name.npos ? 0 : before + 1;
  const size_t value = std::min(name.find_first_not_of('0', first), last);
  return {name.substr(0, first) + "*" + name.substr(last + 1), name.substr(value, last + 1 - value)};
}

bool lower_number(const std::string& a, const std::string& b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

// The one numbered series among files; a lone file is one, too.
Result<std::vector<std::string>> series_of(const std::vector<std::string>& paths, const std::string& folder) {
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> series;  // pattern: number, path
  for (const std::string& path : paths) {
    const Numbered n = numbered(file_name(path));
    series[n.pattern].emplace_back(n.number, path);
  }
  if (series.size() > 1) {
    std::string names;
    size_t named = 0;
    for (const auto& [pattern, members] : series)
      if (named++ < 3) names += fmt::format("{}{} ({})", named > 1 ? ", " : "", pattern, members.size());
    return Error{fmt::format("{}: holds {} volumes that are not one numbered series: {}{}; name one of its files",
                             folder, paths.size(), names, named > 3 ? ", ..." : "")};
  }
  auto members = series.begin()->second;
  std::sort(members.begin(), members.end(), [](auto& a, auto& b) { return lower_number(a.first, b.first); });
  std::vector<std::string> steps;
  for (size_t i = 0; i < members.size(); ++i) {
    if (i > 0 && members[i].first == members[i - 1].first)
      return Error{fmt::format("{}: {} and {} have the same number", folder, file_name(members[i - 1].second),
                               file_name(members[i].second))};
    steps.push_back(members[i].second);
  }
  return steps;
}

// A series, whatever it is read from: a step each for its time steps.
Result<VolumeSource> take_dicom(VolumeSource source, const std::string& path) {
  auto series = find_dicom_series(path, source.series);
  if (!series) return series.error();
  source.dicom = std::move(*series);
  source.steps.assign(source.dicom->order.steps.size(), path);
  return source;
}

}  // namespace

bool looks_like_volume(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return !format_of(path).empty();
  const auto files = files_in(path);
  return files && (std::any_of(files->begin(), files->end(), [](auto& file) { return !format_of(file).empty(); }) ||
                   holds_dicom(path));
}

std::vector<std::string> VolumeSource::files() const { return dicom ? dicom->files() : steps; }

Result<VolumeSource> find_volume(const std::string& path, const std::string& raw, const std::string& series) {
  std::error_code error;
  VolumeSource source{{}, raw, file_name(fs::path(path).lexically_normal().string()), series, nullptr};
  const Error no_folder{fmt::format("--series: {} is no folder of DICOM slices", path)};
  if (source.name.empty()) source.name = file_name(fs::path(path).lexically_normal().parent_path().string());
  if (!fs::exists(path, error)) return Error{path + ": no such file or folder"};
  if (!fs::is_directory(path, error)) {
    if (raw.empty() && format_of(path) == "dicom" && (series.empty() || file_name(path) == "DICOMDIR"))
      return take_dicom(std::move(source), path);
    if (!series.empty()) return no_folder;
    // Reading its header says best what is wrong with it.
    const auto header = read_volume_header(path, raw);
    if (!header) return header.error();
    source.steps = {path};
    return source;
  }
  const auto files = files_in(path);
  if (!files) return files.error();
  std::vector<std::string> volumes;
  size_t slices = 0;
  for (const std::string& file : *files) {
    const std::string format = raw.empty() ? format_of(file) : "raw";
    slices += format == "dicom";
    if (!format.empty() && format != "dicom") volumes.push_back(file);
  }
  if (volumes.empty() && raw.empty() && (slices > 0 || holds_dicom(path))) return take_dicom(std::move(source), path);
  if (volumes.empty())
    return Error{fmt::format("{}: holds neither volume files nor DICOM slices ({} files)", path, files->size())};
  if (slices > 0)
    return Error{
        fmt::format("{}: holds {} DICOM slices and {} other volumes; give the one or the other a folder of its own",
                    path, slices, volumes.size())};
  if (!series.empty()) return no_folder;
  auto steps = series_of(volumes, path);
  if (!steps) return steps.error();
  source.steps = std::move(*steps);
  return source;
}

}  // namespace telesplat::data
