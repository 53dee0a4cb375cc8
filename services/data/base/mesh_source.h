// What a store of chunks is made from: a mesh that can be read, and what tells it from every other mesh.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "services/data/base/mesh.h"
#include "services/data/base/progress.h"

namespace telesplat::data {

struct MeshSource {
  uint64_t hash = 0;    ///< of the content of all files that it is read from
  std::string variant;  ///< what else decides what the mesh is, as part of a file name; often empty
  /// Reads it; what comes passed validate_mesh.
  std::function<Result<Mesh>(const ReadProgress&)> read;
  std::string array;  ///< what colours it, as scene::choose_array() takes it; part of the variant; empty: nothing
};

/// The hash of the files' contents, in this order. Files that cannot be read are left out: reading them says why. Calls
/// progress with stage kIdentifying.
uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress);

}  // namespace telesplat::data
