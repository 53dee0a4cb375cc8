// Formats that are read in the program telesplat-import.
#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "services/data/import/process.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {

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

}  // namespace telesplat::data
