// Serves a mesh from a data server: samplers ask for the list of chunks, and for chunks.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/scene/colouring.h"
#include "services/data/mesh/store.h"
#include "services/data/served.h"

namespace telesplat::data {

/// Opens a store, making it if needed. Called in a thread of its own; an exception from progress ends it.
using OpenStore = std::function<Result<std::shared_ptr<MeshStore>>(const Progress& progress)>;

/// A mesh's colours, and the way to other colours while it is served.
struct ServedColours {
  std::optional<scene::Colouring> as_begun;  ///< nullopt: the file's own colours
  colour::ColourMap map;                     ///< for arrays that are requested later
  std::optional<double> iso;                 ///< an isosurface's value
  /// Opens the same mesh with this array in its chunks (empty: none), as OpenStore does.
  std::function<Result<std::shared_ptr<MeshStore>>(const std::string& array, const Progress& progress)> open;
};

/// path: the mesh's file. The store's array is that of colours.as_begun.
/// whole: if given, `store` is provisional, and this one is opened meanwhile and then takes its place.
std::unique_ptr<Served> serve_mesh(std::shared_ptr<const MeshStore> store, const std::string& path,
                                   ServedColours colours, OpenStore whole = nullptr);

}  // namespace telesplat::data
