// Meshes of the formats that VTK reads: claims are checked here, the rest is read in the program telesplat-import.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "services/data/import/process.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

// The number behind `key` (and a quote or blank); 0 if there is none.
uint64_t number_after(std::string_view content, std::string_view key, size_t& at) {
  at = content.find(key, at);
  if (at == content.npos) return 0;
  at += key.size();
  while (at < content.size() && (content[at] == ' ' || content[at] == '"')) ++at;
  uint64_t value = 0;
  const auto parsed = std::from_chars(content.data() + at, content.data() + content.size(), value);
  return parsed.ec == std::errc::result_out_of_range ? ~uint64_t{0} : value;
}

// Counts in a header that no file of this size can hold. `expansion`: the most that a byte of the file can become.
Status check_counts(std::string_view content, const std::string& name, std::initializer_list<const char*> keys,
                    uint64_t expansion) {
  for (const char* key : keys)
    for (size_t at = 0; at != content.npos;) {
      const uint64_t claimed = number_after(content, key, at);
      if (claimed > content.size() * expansion)
        return Error{fmt::format("{}: claims {} {} in a file of {} bytes", name, claimed,
                                 key[0] == '\n' ? key + 1 : key, content.size())};
    }
  return ok_status();
}

Status check_before(std::string_view content, const std::string& format, const std::string& path) {
  if (format == "vtp" || format == "vtu") {
    // zlib packs at most 1032 to 1.
    return check_counts(content, path,
                        {"NumberOfPoints=", "NumberOfCells=", "NumberOfPolys=", "NumberOfStrips=", "NumberOfVerts=",
                         "NumberOfLines=", "NumberOfTuples="},
                        1032);
  }
  const size_t dataset = content.substr(0, 4096).find("DATASET");
  if (dataset == content.npos || !content.starts_with("# vtk DataFile"))
    return Error{path + ": is no legacy VTK file: no DATASET near its start"};
  std::string_view kind = content.substr(dataset + 7, 40);
  while (!kind.empty() && kind.front() == ' ') kind.remove_prefix(1);
  kind = kind.substr(0, kind.find_first_of(" \r\n"));
  if (kind != "POLYDATA" && kind != "polydata" && kind != "UNSTRUCTURED_GRID" && kind != "unstructured_grid")
    return Error{fmt::format("{}: is a VTK file of {} (a volume or grid): only POLYDATA and UNSTRUCTURED_GRID are read",
                             path, kind)};
  return check_counts(content, path,
                      {"\nPOINTS ", "\nPOLYGONS ", "\nCELLS ", "\nTRIANGLE_STRIPS ", "\nPOINT_DATA ", "\nCELL_DATA "},
                      1);
}

}  // namespace

Result<Mesh> read_with_vtk(std::string_view content, const std::string& format, const std::string& path,
                           const ReadProgress& progress, const std::string& array) {
  if (auto status = check_before(content, format, path); !status) return status.error();
  if (progress) progress(0.0);
  return import("VTK's " + format, {format, path, array}, {path});
}

Result<Mesh> read_imported_gltf(std::string_view content, const std::string& path, const ReadProgress& progress,
                                uint64_t texture_detail) {
  if (progress) progress(0.0);
  std::vector<std::string> files = companion_files(content, "gltf", path);
  files.insert(files.begin(), path);
  return import("the glTF", {"gltf", path, std::to_string(texture_detail)}, files);
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
