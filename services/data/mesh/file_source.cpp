#include "services/data/mesh/file_source.h"

#include <fmt/format.h>
#include <xxhash.h>

#include "services/data/base/mapped_file.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {

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
