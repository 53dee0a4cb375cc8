#include "services/data/open_mesh.h"

#include <fmt/format.h>

#include <filesystem>

#include "services/data/mesh/file_source.h"
#include "services/data/mesh/reader.h"
#include "services/data/surface/isosurface.h"

namespace telesplat::data {

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
  if (const Status s = validate(options); !s) return s.error();
  if (options.iso && !array.empty())
    return Error{
        fmt::format("--colour-by {}: {} is shown as a surface of a volume (--iso), which has no arrays", array, path)};
  if (options.iso) {
    const auto surface = surface_source(path, options.volume, *options.iso, progress);
    return surface ? MeshStore::make(path, *surface, options, progress) : surface.error();
  }
  const auto file = find_mesh_file(path);
  if (!file) return file.error();
  auto source = file_source(file->path, options.elevation, array, options.texture_detail, progress);
  if (!source) return source.error();
  if (file->steps > 1) {
    source->variant += "-first";
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

}  // namespace telesplat::data
