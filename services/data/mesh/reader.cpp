#include "services/data/mesh/reader.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <filesystem>
#include <new>

#include "services/data/base/mapped_file.h"
#include "services/data/base/numbered.h"
#include "services/data/base/text_scanner.h"
#include "services/data/cloud/readers.h"
#include "services/data/gltf/container.h"
#include "services/data/import/process.h"
#include "services/data/mesh/formats/obj_materials.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

// Files from these sizes on are read here and there if they allow that: about five million triangles; a million points.
constexpr size_t kLargePly_bytes = 100 << 20, kLargeRaster_bytes = 5 << 20, kLargeCloud_bytes = 24 << 20,
                 kLargePackedCloud_bytes = 5 << 20;

constexpr const char* kSupported =
    "supported are meshes (PLY, OBJ, STL, OFF, glTF, VTK), clouds (LAS, LAZ, EPT, E57, PLY, PCD, PTX, XYZ), elevation "
    "rasters (GeoTIFF, HGT, 16-bit PNG, ASCII, XYZ, VRT), volumes (NRRD, MetaImage, NIfTI, DICOM, VTI, --raw)";

std::string extension_of(const std::string& path) { return lower(std::filesystem::path(path).extension().string()); }

bool is_one_of(const std::string& word, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* w) { return word == w; });
}

// Describes formats that are not read, by their first bytes, else by their name.
std::string unread_kind(std::string_view content, const std::string& extension) {
  using namespace std::string_view_literals;
  const bool zip = content.starts_with("PK\3\4"sv), gzip = content.starts_with("\x1f\x8b"sv);
  if (content.starts_with("NGSP") || is_one_of(extension, {".spz", ".sog", ".splat", ".ksplat"}))
    return fmt::format("holds Gaussian splats, not a mesh; splats of other programs are not read; {}", kSupported);
  if (zip && (extension == ".3mf" || content.find("3D/3dmodel") != content.npos))
    return fmt::format("is a 3MF file, which is not read: save the model as STL, OBJ or PLY; {}", kSupported);
  constexpr std::pair<const char*, const char*> kModels[] = {
      {".fbx", "FBX"},   {".dae", "COLLADA"}, {".blend", "Blender"}, {".3ds", "3D Studio"},
      {".x3d", "X3D"},   {".wrl", "VRML"},    {".step", "STEP"},     {".stp", "STEP"},
      {".iges", "IGES"}, {".igs", "IGES"},    {".usdz", "USD"}};
  for (const auto& [ending, program] : kModels)
    if (extension == ending)
      return fmt::format("is a {} file, which is not read: save the model as glTF, OBJ or PLY; {}", program,
                         kSupported);
  if (zip || gzip ||
      content.starts_with("\xfd"
                          "7zXZ"sv) ||
      content.starts_with("7z\xbc\xaf"sv) || content.starts_with("BZh"sv) || content.starts_with("\x28\xb5\x2f\xfd"sv))
    return fmt::format("is a compressed file (unpack it first); {}", kSupported);
  return "";
}

// Describes files that users may take for meshes: their kind, and what to do with them.
std::string other_kind(std::string_view content, const std::string& extension) {
  using namespace std::string_view_literals;
  constexpr std::string_view kPicture =
      "is {}: a picture, not elevation, which is one band of 16 bits or more (PNG, GeoTIFF); --texture FILE drapes "
      "pictures over elevation rasters";
  if (content.starts_with("\xff\xd8\xff"sv)) return fmt::format(kPicture, "a JPEG image");
  if (content.starts_with("\x89PNG"sv)) {
    // A PNG's header chunk comes first: bit depth in byte 24, colour type (0: grey) in byte 25.
    const bool known = content.size() > 26;
    return fmt::format(kPicture, !known ? std::string("a PNG image")
                                        : fmt::format("a PNG image of {}-bit {}", int(content[24]),
                                                      content[25] == 0 || content[25] == 4 ? "grey" : "colours"));
  }
  if (extension == ".toml") return "is a scene file, not data: telesplat run and view take it";
  if (content.starts_with("NRRD") || content.starts_with("ObjectType = Image") ||
      is_one_of(extension, {".nii", ".nrrd", ".nhdr", ".mha", ".mhd", ".raw", ".dcm", ".vti"}) ||
      (content.size() > 132 && content.substr(128, 4) == "DICM"))
    return fmt::format("is a volume, not a mesh; {}", kSupported);
  return unread_kind(content, extension);
}

// True for elevation rasters, by content or name: TIFF, PNG with 16-bit grey, and formats without a signature.
bool looks_like_raster(std::string_view content, const std::string& extension) {
  using namespace std::string_view_literals;
  if (content.starts_with("II*\0"sv) || content.starts_with("MM\0*"sv) || content.starts_with("II+\0"sv)) return true;
  // Bytes as in other_kind().
  if (content.starts_with("\x89PNG"sv)) return content.size() > 26 && content[24] == 16 && content[25] == 0;
  if (content.substr(0, 1000).find("<VRTDataset") != content.npos) return true;
  return is_one_of(extension, {".hgt", ".dem", ".asc", ".dt0", ".dt1", ".dt2", ".xyz", ".vrt"});
}

// The format of a cloud, by content, or by name where a text's content is not conclusive; empty: another format.
std::string cloud_format(std::string_view content, const std::string& extension) {
  if (content.starts_with("LASF") || extension == ".laz") return "las";
  if (content.starts_with("ASTM-E57") || extension == ".e57") return "e57";
  if (extension == ".json" && content.find("\"hierarchyType\"") != content.npos) return "ept";
  if (content.starts_with("# .PCD")) return "pcd";
  if (is_ptx(content)) return "ptx";
  if (is_one_of(extension, {".las", ".pcd", ".ptx"})) return extension.substr(1);
  bool grid = false;
  if (is_one_of(extension, {".xyz", ".csv", ".txt", ".asc", ".pts"}) && is_xyz(content, &grid))
    return grid && extension == ".xyz" ? "" : "xyz";
  return extension == ".pts" ? "xyz" : "";
}

ReadCloud read_cloud(std::string_view content, const std::string& format, const std::string& path,
                     const ReadProgress& progress, const std::string& array) {
  return format == "las"   ? read_las(content, path, progress, array)
         : format == "ept" ? read_ept(content, path, progress, array)
         : format == "e57" ? read_e57(content, path, progress, array)
         : format == "pcd" ? read_pcd(content, path, progress, array)
         : format == "ptx" ? read_ptx(content, path, progress, array)
                           : read_xyz(content, path, progress, array);
}

Result<Mesh> read_cloud_mesh(std::string_view content, const std::string& format, const std::string& path,
                             const ReadProgress& progress, const std::string& array) {
  const auto cloud = read_cloud(content, format, path, progress, array);
  if (!cloud) return cloud.error();
  return (*cloud)->mesh();
}

// True for OFF after prefixes that its reader accepts or names.
bool looks_like_off(std::string_view content) {
  const size_t at = content.substr(0, 9).find("OFF");
  return at != content.npos && content.substr(0, at).find_first_not_of("STCN4n") == content.npos;
}

// OBJ has no signature: its first line that is neither empty nor a comment starts with an OBJ keyword.
bool looks_like_obj(std::string_view content) {
  size_t at = 0;
  while (at < content.size()) {
    const size_t end = std::min(content.find('\n', at), content.size());
    std::string_view line = content.substr(at, end - at);
    while (!line.empty() && static_cast<unsigned char>(line.front()) <= ' ') line.remove_prefix(1);
    if (!line.empty() && line.front() != '#') {
      const std::string word(line.substr(0, std::min(line.find_first_of(" \t\r"), size_t{12})));
      return is_one_of(word, {"v", "vn", "vt", "o", "g", "s", "mtllib", "usemtl", "f"});
    }
    at = end + 1;
  }
  return false;
}

// Error: an array is named, but files of this format have no arrays.
Status check_array(const std::string& array, const std::string& format, const std::string& path) {
  if (array.empty() || has_arrays(format)) return ok_status();
  if (format == "raster")
    return Error{
        fmt::format("--colour-by {}: {} is an elevation raster, which is coloured by its heights", array, path)};
  return Error{fmt::format(
      "--colour-by {}: {} is a file of format {}, which has no arrays; PLY, VTP, VTU, VTK and point clouds have", array,
      path, format)};
}

// Reads a VTK file; files that it names are read from its folder.
Result<Mesh> read_vtk(std::string_view content, const std::string& path, const ReadProgress& progress,
                      const std::string& array) {
  if (progress) progress(0.0);
  FolderCompanions companions(path);
  return vtk::read_mesh(content, path, companions, array);
}

// As read_gltf() (gltf/reader.h), but in the program telesplat-import: a hostile file cannot crash this process.
Result<Mesh> read_imported_gltf(std::string_view content, const std::string& path, const ReadProgress& progress,
                                uint64_t texture_detail) {
  if (progress) progress(0.0);
  std::vector<std::string> files = companion_files(content, "gltf", path);
  files.insert(files.begin(), path);
  return import("the glTF", {"gltf", path, std::to_string(texture_detail)}, files);
}

// Reads an OBJ or PLY with pictures in telesplat-import: decoders of pictures are foreign, too. nullopt: it has another
// format, or names no picture.
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

// Reads the heights of a raster through GDAL, in telesplat-import.
Result<ElevationRaster> read_heights(std::string_view content, const std::string& path, const ElevationOptions& options,
                                     const ReadProgress& progress) {
  if (progress) progress(0.0);
  std::error_code error;
  for (const std::string& name : vrt_sources(content))
    if (!std::filesystem::exists(std::filesystem::path(path).parent_path() / name, error))
      return Error{fmt::format("{}: is made of {}, which is missing", path, name)};
  std::vector<std::string> files = companion_files(content, "raster", path);
  files.insert(files.begin(), path);
  if (!options.texture.empty()) files.push_back(options.texture);
  return import_heights({"raster", path, options.texture, std::to_string(options.most_samples)}, files);
}

// Colours and triangulates them (elevation.h).
Result<Mesh> read_raster(std::string_view content, const std::string& path, const ElevationOptions& options,
                         const ReadProgress& progress) {
  auto heights = read_heights(content, path, options, progress);
  if (!heights) return heights.error();
  return elevation_mesh(*std::move(heights), options, path);
}

// Returns MeshSource::random of a file: null unless it is large, and a PLY, raster or cloud. Error: the file cannot be
// opened.
Result<OpenRandom> large_mesh(const std::string& path, const ElevationOptions& elevation, const std::string& array) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const size_t bytes = (*file)->bytes().size();
  const std::string format = detect_format((*file)->text(), path).format;
  if (format == "raster" && bytes >= kLargeRaster_bytes)
    return OpenRandom([=](const ReadProgress& progress) -> Result<std::shared_ptr<const RandomMesh>> {
      auto heights = read_heights((*file)->text(), path, elevation, progress);
      if (!heights) return heights.error();
      auto grid = ElevationGrid::make(*std::move(heights), elevation, path);
      if (!grid) return grid.error();
      return std::shared_ptr<const RandomMesh>(*std::move(grid));
    });
  const bool packed = format == "e57" || is_packed_las((*file)->text());
  if (is_cloud_format(format) && (format == "ept" || bytes >= (packed ? kLargePackedCloud_bytes : kLargeCloud_bytes)))
    return OpenRandom([=](const ReadProgress& progress) -> Result<std::shared_ptr<const RandomMesh>> {
      auto cloud = read_cloud((*file)->text(), format, path, progress, array);
      (*file)->drop_pages();
      if (!cloud) return cloud.error();
      return std::shared_ptr<const RandomMesh>(*std::move(cloud));
    });
  if (format != "ply" || bytes < kLargePly_bytes) return OpenRandom();
  return OpenRandom([=](const ReadProgress&) { return random_ply(*file, path, array); });
}

}  // namespace

DetectedFormat detect_format(std::string_view content, const std::string& path) {
  const std::string extension = extension_of(path);
  if (content.starts_with("ply\n") || content.starts_with("ply\r")) return {"ply", ""};
  if (looks_like_gltf(content)) return {"gltf", ""};
  if (const std::string kind = vtk::kind_of(content); !kind.empty()) {
    if (vtk::is_image(content)) return {"", fmt::format("is a volume, not a mesh; {}", kSupported)};
    return {kind, ""};
  }
  if (std::string cloud = cloud_format(content, extension); !cloud.empty()) return {std::move(cloud), ""};
  if (looks_like_raster(content, extension)) return {"raster", ""};
  if (std::string complaint = other_kind(content, extension); !complaint.empty()) return {"", std::move(complaint)};
  if (is_binary_stl(content)) return {"stl", ""};
  if (looks_like_off(content)) return {"off", ""};
  if (is_text_stl(content)) return {"stl", ""};
  // By name, if the content is not conclusive (or is damaged; the reader then says how).
  if (is_one_of(extension, {".ply", ".off", ".stl", ".obj"}) || vtk::is_mesh_kind(extension.substr(!extension.empty())))
    return {extension.substr(1), ""};
  if (is_one_of(extension, {".gltf", ".glb"})) return {"gltf", ""};
  if (looks_like_obj(content)) return {"obj", ""};
  return {"", fmt::format("is of no known format; {}", kSupported)};
}

bool is_cloud_format(std::string_view format) {
  return format == "las" || format == "ept" || format == "e57" || format == "pcd" || format == "ptx" || format == "xyz";
}

bool has_arrays(std::string_view format) {
  return format == "ply" || is_cloud_format(format) || vtk::is_mesh_kind(format);
}

Result<MeshFile> find_mesh_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return MeshFile{path};
  if (const std::string ept = (std::filesystem::path(path) / "ept.json").string(); std::filesystem::exists(ept, error))
    return MeshFile{ept};
  const auto files = files_of_folder(path);
  if (!files) return files.error();
  std::vector<std::string> meshes;
  for (const std::string& name : *files)
    if (const auto file = MappedFile::open(name); file && !detect_format((*file)->text(), name).format.empty())
      meshes.push_back(name);
  if (meshes.empty()) return Error{fmt::format("{}: is a folder without mesh files", path)};
  auto steps = numbered_series(meshes, path);
  if (!steps) return steps.error();
  return MeshFile{steps->front(), steps->size()};
}

Result<Mesh> read_mesh(const std::string& path, const ReadProgress& report, const ElevationOptions& elevation,
                       const std::string& array, uint64_t texture_detail) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const std::string_view content = (*file)->text();
  const ReadProgress progress = [&, dropped = 0.0](double fraction) mutable {
    if ((fraction - dropped) * double(content.size()) > double(kMostResident))
      (*file)->drop_pages(), dropped = fraction;
    if (report) report(fraction);
  };
  const DetectedFormat detected = detect_format(content, path);
  if (detected.format.empty()) return Error{fmt::format("{}: {}", path, detected.complaint)};
  if (const Status s = check_array(array, detected.format, path); !s) return s.error();
  try {
    FolderCompanions folder(path);
    auto pictured = read_pictured(content, detected.format, path, progress, array, texture_detail);
    auto mesh = pictured                           ? *std::move(pictured)
                : detected.format == "ply"         ? read_ply(content, path, progress, folder, array, texture_detail)
                : detected.format == "off"         ? read_off(content, path, progress)
                : detected.format == "stl"         ? read_stl(content, path, progress)
                : detected.format == "obj"         ? read_obj(content, path, progress, folder, texture_detail)
                : detected.format == "raster"      ? read_raster(content, path, elevation, progress)
                : detected.format == "gltf"        ? read_imported_gltf(content, path, progress, texture_detail)
                : is_cloud_format(detected.format) ? read_cloud_mesh(content, detected.format, path, progress, array)
                                                   : read_vtk(content, path, progress, array);
    if (!mesh) return mesh;
    auto status = validate_mesh(*mesh, path);
    if (!status && drop_not_finite(*mesh, path)) status = validate_mesh(*mesh, path);
    if (!status) return status.error();
    return mesh;
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("{}: this machine's memory does not suffice to read its {} bytes", path, content.size())};
  }
}

Result<MeshSource> file_source(const std::string& path, const ElevationOptions& elevation, const std::string& array,
                               uint64_t texture_detail, const Progress& progress, const HashMemory& memory) {
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
  auto random = large_mesh(path, elevation, array);
  if (!random) return random.error();
  return MeshSource{hash_known_files(files, memory, progress), variant,
                    [=](const ReadProgress& p) { return read_mesh(path, p, elevation, array, texture_detail); }, array,
                    *std::move(random)};
}

}  // namespace telesplat::data
