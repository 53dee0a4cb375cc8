// Mesh files as what a store is made from, and those that are read in the program telesplat-import.
#include <fmt/format.h>
#include <xxhash.h>

#include <filesystem>
#include <optional>

#include "services/data/base/mapped_file.h"
#include "services/data/import/process.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {}  // namespace

Result<Mesh> read_imported_gltf(std::string_view content, const std::string& path, const ReadProgress& progress,
                                uint64_t texture_detail) {
  if (progress) progress(0.0);
  std::vector<std::string> files = companion_files(content, "gltf", path);
  files.insert(files.begin(), path);
  return import("the glTF", {"gltf", path, std::to_string(texture_detail)}, files);
}

std::optional<Result<Mesh>> read_pictured(std::string_view content, const std::string& format, const std::string& path,
                                          const ReadProgress& progress, const std::string& array,
                                          uint64_t texture_detail) {
  if (format != "obj" && format != "ply") return std::nullopt;
  std::vector<std::string> files = companion_files(content, format, path);
  FolderCompanions folder(path);
  const size_t libraries = format == "obj" ? obj_material_libraries(content, folder).size() : 0;
  if (files.size() <= libraries) return std::nullopt;
  if (progress) progress(0.0);
  files.insert(files.begin(), path);
  return import("the " + format, {format, path, std::to_string(texture_detail), array}, files);
}

Result<Mesh> read_with_gdal(std::string_view content, const std::string& path, const ElevationOptions& options,
                            const ReadProgress& progress) {
  if (progress) progress(0.0);
  std::error_code error;
  for (const std::string& name : vrt_sources(content))
    if (!std::filesystem::exists(std::filesystem::path(path).parent_path() / name, error))
      return Error{fmt::format("{}: is made of {}, which is missing", path, name)};
  std::vector<std::string> files = companion_files(content, "raster", path);
  files.insert(files.begin(), path);
  if (!options.texture.empty()) files.push_back(options.texture);
  return import("GDAL's raster", {"raster", path, fmt::format("{}", options.z_scale), options.texture}, files);
}

Result<MeshSource> file_source(const std::string& path, const ElevationOptions& elevation, const std::string& array,
                               uint64_t texture_detail, const Progress& progress) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const DetectedFormat detected = detect_format((*file)->text(), path);
  if (detected.format.empty()) return Error{fmt::format("{}: {}", path, detected.complaint)};
  std::vector<std::string> files{path};
  for (auto& companion : companion_files((*file)->text(), detected.format, path)) files.push_back(std::move(companion));
  const bool raster = detected.format == "raster";
  if (!raster && (elevation.z_scale != 0 || !elevation.texture.empty()))
    return Error{fmt::format("{}: is no elevation raster, but --z-scale or --texture is given", path)};
  if (!elevation.texture.empty()) {
    const auto texture = MappedFile::open(elevation.texture);
    if (!texture) return texture.error();
    files.push_back(elevation.texture);
  }
  if (const Status s = check_array(array, detected.format, path); !s) return s.error();
  std::string variant = raster ? fmt::format("-z{}", elevation.z_scale) : "";
  if (!array.empty()) variant += fmt::format("-by{:016x}", XXH3_64bits(array.data(), array.size()));
  const bool textured = detected.format == "obj" || detected.format == "gltf";
  if (textured && texture_detail != kDefaultTextureDetail) variant += fmt::format("-t{}", texture_detail);
  return MeshSource{hash_files(files, progress), variant,
                    [=](const ReadProgress& p) { return read_mesh(path, p, elevation, array, texture_detail); }, array};
}

}  // namespace telesplat::data
