// A mesh as a data server serves it: samplers ask which chunks there are, and for chunks.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/scene/colouring.h"
#include "services/data/mesh/store.h"
#include "services/data/served.h"

namespace telesplat::data {

/// How a mesh is coloured, and how it comes to other colours while it is served.
struct ServedColours {
  std::optional<scene::Colouring> as_begun;  ///< nothing: the file's own colours
  colour::ColourMap map;                     ///< of arrays that are asked for later
  std::optional<double> iso;                 ///< of an isosurface: its value
  /// Opens the same mesh with this array in its chunks (empty: none), making the store if need be. Called in a thread
  /// of its own; what progress throws ends it.
  std::function<Result<std::shared_ptr<MeshStore>>(const std::string& array, const Progress& progress)> open;
};

/// path: where the mesh is from. The store's array is that of colours.as_begun.
std::unique_ptr<Served> serve_mesh(std::shared_ptr<const MeshStore> store, const std::string& path,
                                   ServedColours colours);

}  // namespace telesplat::data
