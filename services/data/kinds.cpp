#include "services/data/kinds.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "services/data/base/mapped_file.h"
#include "services/data/cloud/readers.h"
#include "services/data/julia/served_julia.h"
#include "services/data/mesh/cache.h"
#include "services/data/mesh/out_of_core/preview.h"
#include "services/data/mesh/reader.h"
#include "services/data/mesh/served_mesh.h"
#include "services/data/surface/isosurface.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/served_volume.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& folder, const fs::path& file) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
}

Status check_named(const std::string& path, const std::string& named) {
  std::error_code error;
  const fs::path file = fs::canonical(named, error);
  if (error) return ok_status();  // it is missing
  const fs::path parent = fs::path(path).parent_path();
  const fs::path folder = fs::canonical(parent.empty() ? fs::path(".") : parent, error);
  if (!error && is_below(folder, file)) return ok_status();
  return Error{
      fmt::format("{}: names {}, which lies outside of its folder; --companions anywhere allows that", path, named)};
}

// Checks a volume's files: its voxels lie in the file itself, or in files that its header names.
Status check_volume(const DataOptions& o) {
  const auto source = find_volume(o.scene, o.volume);
  if (!source) return ok_status();
  if (source->dicom) return ok_status();  // slices name no files
  for (const std::string& step : source->steps) {
    const auto header = read_volume_header(step, o.volume.raw);
    if (!header) continue;
    std::vector<std::string> named = header->more_paths;
    if (!header->data_path.empty() && header->data_path != step) named.push_back(header->data_path);
    for (const std::string& file : named)
      if (const Status s = check_named(step, file); !s) return s;
  }
  return ok_status();
}

Status check_mesh(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return ok_status();
  const std::string_view content = (*file)->text();
  for (const std::string& named : companion_files(content, detect_format(content, path).format, path))
    if (const Status s = check_named(path, named); !s) return s;
  return ok_status();
}

using scene::Kind;
using OpenServed = Result<std::unique_ptr<Served>>;

bool is_julia(const DataOptions& o) { return o.scene == julia::kSceneWord; }
bool holds_volume(const DataOptions& o) { return !o.volume.raw.empty() || looks_like_volume(o.scene); }
bool is_volume(const DataOptions& o) { return !o.mesh.iso && holds_volume(o); }
// A file that no other kind claims is a mesh or a raster; its reader finds out which, or why not.
bool is_mesh(const DataOptions& o) { return o.mesh.iso ? holds_volume(o) : find_mesh_file(o.scene).ok(); }

HashMemory hash_memory(const StoreOptions& options) {
  const std::string cache = options.cache_dir.empty() ? default_cache_folder() : options.cache_dir;
  return {options.use_cache ? cache : ""};
}

// Makes the coarse form of a large mesh that has no store yet. Error: there is one, or the mesh must be read whole,
// which also tells what is wrong with it.
Result<std::shared_ptr<MeshStore>> preview_of(const std::string& path, const MeshOptions& options) {
  const auto by = scene::parse_colour_by(options.colouring.by);
  if (!by || options.iso || fs::is_directory(path)) return Error{"it is read whole"};
  HashMemory memory = hash_memory(options);
  memory.never_read = true;
  const auto source = file_source(
      path, options.elevation, by->array, options.texture_detail, [](const char*, double) {}, memory);
  if (!source || !source->random) return Error{"it is read whole"};
  if (source->hash != 0 && MeshStore::is_made(path, *source, options)) return Error{"there is one"};
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const std::string format = detect_format((*file)->text(), path).format;
  if (is_cloud_format(format)) {
    constexpr size_t kLeast_bytes = 64 << 20;
    constexpr uint64_t kMostPoints = 1 << 17;
    if ((format != "las" && format != "e57") || (*file)->bytes().size() < kLeast_bytes || !by->array.empty())
      return Error{"it is read whole"};
    const auto cloud = (format == "las" ? read_las : read_e57)((*file)->text(), path, {}, "", kMostPoints);
    return cloud ? keep_preview(path, (*cloud)->mesh(), options) : cloud.error();
  }
  if (format == "raster") {
    ElevationOptions coarse = options.elevation;
    coarse.most_samples = 1 << 18;
    auto mesh = read_mesh(path, {}, coarse);
    return mesh ? keep_preview(path, *std::move(mesh), options) : mesh.error();
  }
  const auto mesh = source->random([](double) {});
  if (!mesh) return mesh.error();
  if (!*mesh) return Error{"it is read whole"};
  return make_preview(path, **mesh, {.store = options, .array = by->array});
}

OpenServed open_as_mesh(const DataOptions& o, const Progress& progress) {
  const MeshOptions options = o.mesh_options();
  auto map = colour_map_of(options);  // before the mesh is read, which takes longer
  if (!map) return map.error();
  const auto preview = preview_of(o.scene, options);
  auto store = preview ? preview : open_mesh(o.scene, options, progress);
  if (!store) return store.error();
  auto colouring = colouring_of(options, (*store)->info());
  if (!colouring) return colouring.error();
  const auto open_whole = [path = o.scene, options](const Progress& working) {
    return open_mesh(path, options, working);
  };
  const auto open_array = [path = o.scene, options](const std::string& array, const Progress& working) {
    return open_mesh_by(path, options, array, working);
  };
  return serve_mesh(std::move(*store), o.scene,
                    {.as_begun = *std::move(colouring), .map = *std::move(map), .iso = options.iso, .open = open_array},
                    preview ? OpenStore(open_whole) : nullptr);
}
OpenServed open_as_volume(const DataOptions& o, const Progress& progress) {
  auto store = VolumeStore::open(o.scene, o.volume, o.mesh, progress);
  if (!store) return store.error();
  return serve_volume(std::move(*store), o.scene);
}
OpenServed open_as_julia(const DataOptions& o, const Progress& progress) {
  return serve_julia(o.julia, o.mesh.room_size_m, progress);
}

// One row per kind of scene; the first row that claims a data set opens it.
struct Row {
  Kind kind;
  const char* files;  // its kind of data, for help texts
  bool (*claims)(const DataOptions&);
  OpenServed (*open)(const DataOptions&, const Progress&);
};
constexpr Row kRows[] = {
    {Kind::kJulia, "the word julia", is_julia, open_as_julia},
    {Kind::kVolume,
     "volume (NRRD, MetaImage, NIfTI, VTI, raw with --raw, DICOM: a folder, disc or file, slices as TIFF or PNG, or a "
     "folder with a numbered series)",
     is_volume, open_as_volume},
    {Kind::kMesh,
     "mesh file (PLY, OBJ, STL, OFF, VTP, VTU, VTS, VTR, VTM, PVD, VTK, glTF, GLB), point cloud (LAS, LAZ, COPC, EPT, "
     "E57, PLY, PCD, PTX, XYZ, PTS, CSV) or elevation raster (GeoTIFF, HGT, 16-bit PNG, ASCII grid)",
     is_mesh, open_as_mesh},
};
static_assert(std::size(kRows) == std::size(scene::kKinds), "a row a kind");

// Usual names of voxel files without a header.
constexpr const char* kRawNames[] = {".raw", ".vol", ".img", ".bin", ".dat"};

// Refuses a file of no known format, before any process is started.
Status refuse_unknown_format(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const DetectedFormat detected = detect_format((*file)->text(), path);
  if (!detected.format.empty()) return ok_status();
  const std::string extension = lower(std::filesystem::path(path).extension().string());
  if (std::find(std::begin(kRawNames), std::end(kRawNames), extension) == std::end(kRawNames))
    return Error{fmt::format("{}: {}", path, detected.complaint)};
  const uint64_t bytes = (*file)->bytes().size();
  const auto guesses = raw_guesses(path, bytes);
  return Error{fmt::format("{}: raw voxels need --raw SIZExSIZExSIZE:TYPE; {}", path,
                           guesses.empty()
                               ? fmt::format("it has {} bytes", bytes)
                               : fmt::format("its {} bytes could be --raw {}", bytes, fmt::join(guesses, " or ")))};
}

Result<const Row*> row_of(const DataOptions& o) {
  std::error_code error;
  if (!is_julia(o) && !std::filesystem::exists(o.scene, error)) return Error{fmt::format("{}: no such file", o.scene)};
  const bool other_file = !holds_volume(o) && !std::filesystem::is_directory(o.scene, error);
  for (const Row& row : kRows) {
    if (!row.claims(o)) continue;
    if (row.kind == Kind::kMesh && other_file)
      if (const Status s = refuse_unknown_format(o.scene); !s) return s.error();
    return &row;
  }
  if (o.mesh.iso && other_file)
    if (const Status s = refuse_unknown_format(o.scene); !s) return s.error();
  if (o.mesh.iso) return Error{fmt::format("--iso: {} is no volume", o.scene)};
  return Error{fmt::format(
      "{}: is a folder, and not one of DICOM slices or of a numbered series of volume files; a data file is needed, "
      "or the word julia",
      o.scene)};
}

// Returns the error "--tf: terrain.ply is no volume but a mesh".
Error misfit(const options::Row& row, Kind kind, const DataOptions& o) {
  const std::string flag = options::name_of(row);
  if (o.mesh.iso && kind == Kind::kMesh)
    return Error{fmt::format("{}: {} is shown as a surface (--iso), which has no {}", flag, o.scene, flag)};
  for (const Kind owner : scene::kKinds)
    if (row.fits == scene::Kinds{owner})
      return Error{fmt::format("{}: {} is no {} but {}", flag, o.scene, scene::described(owner).substr(2),
                               scene::described(kind))};
  return Error{fmt::format("{}: {} is {}, which has no {}", flag, o.scene, scene::described(kind), flag)};
}

// Refuses options that differ from their default, but do not fit this kind.
Status refuse_misfits(DataOptions o, Kind kind) {
  DataOptions none;
  const auto all = [](DataOptions& of) {
    return joined(options::without(server_table(of), {"scene"}), scene_table(of));
  };
  const options::Table given = all(o), defaults = all(none);
  for (size_t i = 0; i < given.size(); ++i)
    if (!given[i].fits.has(kind) && options::text_of(given[i]) != options::text_of(defaults[i]))
      return misfit(given[i], kind, o);
  return ok_status();
}

}  // namespace

Result<std::shared_ptr<MeshStore>> open_mesh(const std::string& path, const MeshOptions& options,
                                             const Progress& user_progress) {
  auto by = scene::parse_colour_by(options.colouring.by);
  if (!by) return Error{fmt::format("--colour-by {}", by.error().text)};
  auto store = open_mesh_by(path, options, by->array, user_progress);
  if (!options.colouring.by_file || (store && scene::make_colouring((*store)->info().arrays, *by, {}))) return store;
  return open_mesh_by(path, options, "", user_progress);
}

Result<std::shared_ptr<MeshStore>> open_mesh_by(const std::string& path, const MeshOptions& options,
                                                const std::string& array, const Progress& user_progress) {
  const Progress progress = user_progress ? user_progress : [](const char*, double) {};
  if (options.iso && !array.empty())
    return Error{
        fmt::format("--colour-by {}: {} is shown as a surface of a volume (--iso), which has no arrays", array, path)};
  const HashMemory memory = hash_memory(options);
  if (options.iso) {
    const auto surface = surface_source(path, options.volume, *options.iso, progress, memory);
    return surface ? MeshStore::make(path, *surface, options, progress) : surface.error();
  }
  const auto file = find_mesh_file(path);
  if (!file) return file.error();
  auto source = file_source(file->path, options.elevation, array, options.texture_detail, progress, memory);
  if (!source) return source.error();
  if (file->steps > 1) {
    source->variant += "-first";
    source->random = nullptr;
    source->read = [read = source->read, folder = path, file = *file](const ReadProgress& p) {
      auto mesh = read(p);
      if (mesh)
        mesh->notes.push_back(fmt::format("its folder, {}, holds {} time steps; the first one is shown ({})", folder,
                                          file.steps, std::filesystem::path(file.path).filename().string()));
      return mesh;
    };
  }
  return MeshStore::make(file->path, *source, options, progress);
}

Result<colour::ColourMap> colour_map_of(const MeshOptions& options) {
  auto map = colour::resolve_colour_map(options.colouring.map);
  if (!map) return Error{fmt::format("--colour-map: {}", map.error().text)};
  return map;
}

Result<std::optional<scene::Colouring>> colouring_of(const MeshOptions& options, const MeshStoreInfo& mesh) {
  const auto by = scene::parse_colour_by(options.colouring.by);
  if (!by) return Error{fmt::format("--colour-by {}", by.error().text)};
  auto map = colour_map_of(options);
  if (!map) return map.error();
  const bool left_out = options.colouring.by_file && mesh.array != by->array;
  if (by->array.empty() || left_out) return std::optional<scene::Colouring>();
  auto colouring = scene::make_colouring(mesh.arrays, *by, *std::move(map));
  if (!colouring) return Error{fmt::format("{}: {}", mesh.source, colouring.error().text)};
  return std::optional(*std::move(colouring));
}

Status check_companions(const DataOptions& o) {
  if (o.companions == "anywhere") return ok_status();
  const auto kind = kind_of(o);
  if (!kind || *kind == scene::Kind::kJulia) return ok_status();
  return *kind == scene::Kind::kVolume || o.mesh.iso ? check_volume(o) : check_mesh(o.scene);
}

std::string scene_help() {
  std::string out;
  for (auto row = std::rbegin(kRows); row != std::rend(kRows); ++row)
    out += fmt::format("{}{}", out.empty() ? "" : ", ", row->files);
  return out;
}

Result<Kind> kind_of(const DataOptions& o) {
  const auto row = row_of(o);
  if (!row) return row.error();
  if (const Status fits = refuse_misfits(o, (*row)->kind); !fits) return fits.error();
  return (*row)->kind;
}

OpenServed open(const DataOptions& o, const Progress& progress) {
  const auto row = row_of(o);
  if (!row) return row.error();
  if (const Status fits = refuse_misfits(o, (*row)->kind); !fits) return fits.error();
  return (*row)->open(o, progress);
}

}  // namespace telesplat::data
