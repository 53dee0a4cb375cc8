// What a path holds: a volume file, a folder of DICOM slices, a folder of numbered volume files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

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

// A name as what lies between its numbers ("run*-phase*.nrrd") and these. A number with a fraction is one.
struct Numbered {
  std::string pattern;
  std::vector<std::string> numbers;
};
Numbered numbered(const std::string& name) {
  Numbered out;
  const auto digit = [&](size_t at) { return at < name.size() && name[at] >= '0' && name[at] <= '9'; };
  for (size_t at = 0; at < name.size();) {
    const size_t begin = at;
    while (digit(at)) ++at;
    if (at > begin && name[at] == '.' && digit(at + 1))
      for (++at; digit(at);) ++at;
    out.pattern += at > begin ? '*' : name[at];
    if (at > begin) out.numbers.push_back(name.substr(begin, at - begin));
    at += at == begin;
  }
  return out;
}

// "007.50" as "7" and "5".
std::pair<std::string, std::string> parts_of(const std::string& number) {
  const size_t dot = std::min(number.find('.'), number.size());
  std::string whole = number.substr(0, dot), fraction = dot < number.size() ? number.substr(dot + 1) : "";
  whole.erase(0, whole.find_first_not_of('0'));
  fraction.erase(fraction.find_last_not_of('0') + 1);
  return {whole, fraction};
}

bool lower_number(const std::string& a, const std::string& b) {
  const auto [whole_a, fraction_a] = parts_of(a);
  const auto [whole_b, fraction_b] = parts_of(b);
  return std::tuple(whole_a.size(), whole_a, fraction_a) < std::tuple(whole_b.size(), whole_b, fraction_b);
}

Error not_one_series(const std::vector<std::string>& paths, const std::string& folder) {
  std::map<std::string, size_t> patterns;
  for (const std::string& path : paths) ++patterns[numbered(file_name(path)).pattern];
  std::string names;
  size_t named = 0;
  for (const auto& [pattern, members] : patterns)
    if (named++ < 3) names += fmt::format("{}{} ({})", named > 1 ? ", " : "", pattern, members);
  return Error{fmt::format("{}: holds {} volumes that are not one numbered series: {}{}; name one of its files", folder,
                           paths.size(), names, named > 3 ? ", ..." : "")};
}

// The one numbered series among files, by the number in which they differ; a lone file is one, too.
Result<std::vector<std::string>> series_of(const std::vector<std::string>& paths, const std::string& folder) {
  std::vector<std::pair<Numbered, std::string>> members;
  for (const std::string& path : paths) members.emplace_back(numbered(file_name(path)), path);
  const Numbered first = members[0].first;
  std::set<size_t> differing;
  for (const auto& [n, path] : members) {
    if (n.pattern != first.pattern) return not_one_series(paths, folder);
    for (size_t i = 0; i < n.numbers.size(); ++i)
      if (lower_number(n.numbers[i], first.numbers[i]) || lower_number(first.numbers[i], n.numbers[i]))
        differing.insert(i);
  }
  if (members.size() > 1 && differing.empty())
    return Error{fmt::format("{}: {} and {} have the same number", folder, file_name(paths[0]), file_name(paths[1]))};
  if (differing.empty()) return paths;
  const size_t counter = *differing.begin();
  std::sort(members.begin(), members.end(),
            [&](auto& a, auto& b) { return lower_number(a.first.numbers[counter], b.first.numbers[counter]); });
  // Numbers that grow with the counter (a step and its time) are well.
  for (size_t i = 1; i < members.size(); ++i) {
    const auto &a = members[i - 1].first.numbers, &b = members[i].first.numbers;
    for (const size_t n : differing)
      if (!lower_number(a[n], b[n])) {
        if (differing.size() > 1) return not_one_series(paths, folder);
        return Error{fmt::format("{}: {} and {} have the same number", folder, file_name(members[i - 1].second),
                                 file_name(members[i].second))};
      }
  }
  std::vector<std::string> steps;
  for (auto& [n, path] : members) steps.push_back(std::move(path));
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
