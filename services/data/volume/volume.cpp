#include "services/data/volume/volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>
#include <new>
#include <set>
#include <tuple>

#include "services/data/base/mapped_file.h"
#include "services/data/base/numbered.h"
#include "services/data/base/refusal.h"
#include "services/data/import/process.h"
#include "services/data/volume/formats/dicom.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/stack.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

std::string file_name(const std::string& path) { return fs::path(path).filename().string(); }

std::string format_of(const std::string& path) {
  const auto start = read_start(path);
  return start ? volume_format(*start, path) : "";
}

// Takes a DICOM series: each of its time steps becomes a step.
VolumeSource take_dicom(VolumeSource source, const std::string& path) {
  source.dicom = need(find_dicom_series(path, source.layout.series));
  source.steps.assign(source.dicom->order.steps.size(), path);
  return source;
}

// True for a TIFF file that is a volume.
bool is_stack_file(const std::string& path) {
  const auto file = MappedFile::open(path);
  return file && is_stack((*file)->text());
}

// Returns the folder's pictures that may be slices; empty for a single picture, or beside meshes that they may cover.
std::vector<std::string> pictures_among(const std::vector<std::string>& files) {
  std::vector<std::string> out;
  for (const std::string& file : files) {
    const std::string extension = lower(fs::path(file).extension().string());
    for (const char* mesh : {".obj", ".mtl", ".gltf", ".ply"})
      if (extension == mesh) return {};
    const auto picture = MappedFile::open(file);
    if (picture && is_slice_picture((*picture)->text())) out.push_back(file);
  }
  return out.size() > 1 ? out : std::vector<std::string>();
}

VolumeSource find(const std::string& path, const VolumeLayout& layout) {
  const std::string &raw = layout.raw, &series = layout.series;
  std::error_code error;
  VolumeSource source{{}, layout, file_name(fs::path(path).lexically_normal().string())};
  if (source.name.empty()) source.name = file_name(fs::path(path).lexically_normal().parent_path().string());
  if (!fs::exists(path, error)) refuse("{}: no such file or folder", path);
  if (!fs::is_directory(path, error)) {
    if (raw.empty() && format_of(path) == "dicom" && (series.empty() || file_name(path) == "DICOMDIR"))
      return take_dicom(std::move(source), path);
    if (!series.empty()) refuse("--series: {} is no folder of DICOM slices", path);
    source.steps = {path};
    if (raw.empty() && is_stack_file(path)) {
      source.slices = {path};
      return source;
    }
    // The error of reading its header describes the problem best.
    need(read_volume_header(path, raw, layout.array));
    return source;
  }
  const auto files = need(files_of_folder(path));
  std::vector<std::string> volumes;
  size_t slices = 0;
  for (const std::string& file : files) {
    const std::string format = raw.empty() ? format_of(file) : "raw";
    slices += format == "dicom";
    if (!format.empty() && format != "dicom") volumes.push_back(file);
  }
  if (volumes.empty() && raw.empty() && (slices > 0 || holds_dicom(path))) return take_dicom(std::move(source), path);
  if (volumes.empty())
    if (const auto pictures = pictures_among(files); !pictures.empty()) {
      source.slices = need(numbered_series(pictures, path));
      source.steps = {path};
      return source;
    }
  if (volumes.empty()) refuse("{}: holds neither volume files nor DICOM slices ({} files)", path, files.size());
  if (slices > 0)
    refuse("{}: holds {} DICOM slices and {} other volumes; give the one or the other a folder of its own", path,
           slices, volumes.size());
  if (!series.empty()) refuse("--series: {} is no folder of DICOM slices", path);
  source.steps = need(numbered_series(volumes, path));
  return source;
}

// Gives voxels the user's spacing, along their axes. Error: it is not a spacing.
void space_out(const std::string& spacing, glm::dmat4& index_to_data) {
  if (spacing.empty()) return;
  const auto s = spacing_of(spacing);
  if (!s) refuse("--spacing {}: is not three numbers above 0, as in 0.5,0.5,2", in_quotes(spacing));
  for (int a = 0; a < 3; ++a) index_to_data[a] *= (*s)[a] / glm::length(index_to_data[a]);
}

// Checks the header against the size of all its files.
VolumeFileHeader read_stack_header(const std::vector<std::string>& slices) {
  VolumeFileHeader header = need(stack_header(slices));
  uint64_t bytes = 0;
  std::error_code error;
  for (const std::string& slice : slices) bytes += fs::file_size(slice, error);
  if (header.data_at == 0) header.encoding = Encoding::kGzip;  // allows as much as the best compressor
  need(check_header(header, bytes, slices[0]));
  return header;
}

// Returns the checked header of a step, also of a DICOM series; its size is that of the first step.
VolumeFileHeader read_step_header(const VolumeSource& source, size_t step) {
  if (step >= source.steps.size()) refuse("{}: has no step {}, it has {}", source.name, step, source.steps.size());
  if (source.dicom) return source.dicom->header;
  if (!source.slices.empty()) return read_stack_header(source.slices);
  const auto read = [&](const std::string& path) {
    return read_volume_header(path, source.layout.raw, source.layout.array);
  };
  VolumeFileHeader header = need(read(source.steps[step]));
  if (step == 0) return header;
  const auto first = read(source.steps[0]);
  if (first && first->size != header.size)
    refuse("{}: has {} x {} x {} voxels, the first of its series, {}, has {} x {} x {}", source.steps[step],
           header.size[0], header.size[1], header.size[2], source.steps[0], first->size[0], first->size[1],
           first->size[2]);
  return header;
}

Volume read_voxels(const VolumeFileHeader& header, const VolumeSource& source, size_t step,
                   const ReadProgress& progress) {
  const std::string& path = source.steps[step];
  if (source.dicom) return need(read_dicom(*source.dicom, step, path, progress));
  if (!source.slices.empty() && header.data_at == 0) {
    const std::string layout =
        fmt::format("{}x{}x{}:{}", header.size[0], header.size[1], header.size[2], name_of(header.stored));
    auto streamed =
        need(import_volume("GDAL's picture", {"stack", path, layout}, source.slices, header.voxel_bytes(), progress));
    VolumeFileHeader native = header;
    native.big_endian = streamed.header.big_endian;
    return need(make_volume(native, std::move(streamed.bytes), path));
  }
  const bool image = header.format == "vti" || header.format == "vtk";
  auto bytes = need(image ? read_vtk_image(header, path) : read_payload(header, path, progress));
  return need(make_volume(header, std::move(bytes), path));
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
  return or_error([&] { return find(path, layout); });
}

Result<Volume> read_volume(const VolumeSource& source, size_t step, const ReadProgress& progress) {
  return or_error([&] {
    const VolumeFileHeader header = read_step_header(source, step);
    const std::string& path = source.steps[step];
    need(check_memory(header.voxel_bytes(), path));
    if (progress) progress(0.0);
    try {
      Volume volume = read_voxels(header, source, step, progress);
      space_out(source.layout.spacing, volume.index_to_data);
      if (progress) progress(1.0);
      return volume;
    } catch (const std::bad_alloc&) {
      refuse("{}: this machine's memory does not suffice for its {} bytes of voxels", path, header.voxel_bytes());
    }
  });
}

Status check_steps(const VolumeSource& source) {
  return or_error([&] {
    for (size_t step = 0; step < source.steps.size(); ++step) read_step_header(source, step);
  });
}

}  // namespace telesplat::data
