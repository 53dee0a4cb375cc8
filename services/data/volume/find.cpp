// What a path holds: a volume file, a folder of DICOM slices, a folder of numbered volume files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "services/data/base/mapped_file.h"
#include "services/data/base/numbered.h"
#include "services/data/volume/formats/dicom_series.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/stack.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }

std::string format_of(const std::string& path) {
  const auto start = read_start(path);
  return start ? volume_format(*start, path) : "";
}

// A series, whatever it is read from: a step each for its time steps.
Result<VolumeSource> take_dicom(VolumeSource source, const std::string& path) {
  auto series = find_dicom_series(path, source.layout.series);
  if (!series) return series.error();
  source.dicom = std::move(*series);
  source.steps.assign(source.dicom->order.steps.size(), path);
  return source;
}

// A TIFF file that is a volume.
bool is_stack_file(const std::string& path) {
  const auto start = read_start(path);
  if (!start || !is_slice_picture(start->bytes)) return false;
  const auto file = MappedFile::open(path);
  return file && is_stack((*file)->text());
}

// Pictures of a folder that may be slices; none where it holds one alone, or meshes that they may cover.
std::vector<std::string> pictures_among(const std::vector<std::string>& files) {
  std::vector<std::string> out;
  for (const std::string& file : files) {
    const std::string extension = lower(fs::path(file).extension().string());
    for (const char* mesh : {".obj", ".mtl", ".gltf", ".ply"})
      if (extension == mesh) return {};
    const auto start = read_start(file);
    if (start && is_slice_picture(start->bytes)) out.push_back(file);
  }
  return out.size() > 1 ? out : std::vector<std::string>();
}

}  // namespace

bool looks_like_volume(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return !format_of(path).empty() || is_stack_file(path);
  const auto files = files_of_folder(path);
  return files && (std::any_of(files->begin(), files->end(), [](auto& file) { return !format_of(file).empty(); }) ||
                   holds_dicom(path) || !pictures_among(*files).empty());
}

std::vector<std::string> VolumeSource::files() const {
  return dicom ? dicom->files() : slices.empty() ? steps : slices;
}

Result<VolumeSource> find_volume(const std::string& path, const VolumeLayout& layout) {
  const std::string &raw = layout.raw, &series = layout.series;
  std::error_code error;
  VolumeSource source{{}, layout, file_name(fs::path(path).lexically_normal().string())};
  const Error no_folder{fmt::format("--series: {} is no folder of DICOM slices", path)};
  if (source.name.empty()) source.name = file_name(fs::path(path).lexically_normal().parent_path().string());
  if (!fs::exists(path, error)) return Error{path + ": no such file or folder"};
  if (!fs::is_directory(path, error)) {
    if (raw.empty() && format_of(path) == "dicom" && (series.empty() || file_name(path) == "DICOMDIR"))
      return take_dicom(std::move(source), path);
    if (!series.empty()) return no_folder;
    source.steps = {path};
    if (raw.empty() && is_stack_file(path)) {
      source.slices = {path};
      return source;
    }
    // Reading its header says best what is wrong with it.
    const auto header = read_volume_header(path, raw, layout.array);
    if (!header) return header.error();
    return source;
  }
  const auto files = files_of_folder(path);
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
    if (const auto pictures = pictures_among(*files); !pictures.empty()) {
      auto slices = numbered_series(pictures, path);
      if (!slices) return slices.error();
      source.slices = std::move(*slices);
      source.steps = {path};
      return source;
    }
  if (volumes.empty())
    return Error{fmt::format("{}: holds neither volume files nor DICOM slices ({} files)", path, files->size())};
  if (slices > 0)
    return Error{
        fmt::format("{}: holds {} DICOM slices and {} other volumes; give the one or the other a folder of its own",
                    path, slices, volumes.size())};
  if (!series.empty()) return no_folder;
  auto steps = numbered_series(volumes, path);
  if (!steps) return steps.error();
  source.steps = std::move(*steps);
  return source;
}

}  // namespace telesplat::data
