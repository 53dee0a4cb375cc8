// What `telesplat inspect FILE` says of a mesh file.
#pragma once

#include <string>

#include "services/data/mesh_store.h"

namespace telesplat::data {

struct MeshFileFacts {
  MeshStoreInfo info;
  uint64_t file_bytes = 0;
  size_t chunks = 0;
  uint64_t chunk_bytes = 0;  ///< of all chunks together
};

/// Opens the file's store (making it if need be: a file whose chunks cannot be made is no good file) and sums it up.
Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress);

/// The facts as lines of text, each ended by a line feed: format, counts, box in the file's units and in the room, up, normals, colours, chunks.
std::string describe(const MeshFileFacts& facts);

/// True if the file's content or name is that of a mesh format that open() reads; says nothing on whether it is sound.
bool is_mesh_file(const std::string& path);

}  // namespace telesplat::data
