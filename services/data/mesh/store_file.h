// The chunk store's file: a header, a table of contents, the chunks. Written once, mapped afterwards.
//
//   offset 0      StoreHeader, padded to 4096
//   4096          StoreEntry[chunks], padded to a multiple of 4096
//   then          the chunks (common/geometry/mesh_chunk.h), each at a multiple of 4096, in the order they were made
//   then          what the file's arrays are: scene::to_text(); remarks on the file, lines without its name
//
// Native byte order: the file is a cache and never travels.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "services/data/base/mapped_file.h"
#include "services/data/mesh/chunker.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

inline constexpr uint64_t kStoreMagic = 0x31455453'48534d54;  // "TMSHSTE1"
/// Goes up whenever readers, placement or layout would make another file of the same mesh.
inline constexpr uint32_t kStoreVersion = 7;

/// Makes the store of a placed mesh in an open, empty, writable file. `info` describes it; boxes and counts are taken
/// from there. On failure (disk full) the file's content is worthless. Errors start with `name`. `progress` (stages
/// kSortingIntoChunks and kWritingTheStore) is called on this thread.
Status write_store(int descriptor, const std::string& name, const PlacedMesh& mesh, const MeshStoreInfo& info,
                   const Progress& progress);

struct StoreContent {
  std::shared_ptr<const MappedFile> file;
  MeshStoreInfo info;  ///< without source and from_cache; notes without the file's name
  std::vector<geometry::ChunkInfo> chunks;
  std::vector<size_t> offsets;  ///< of each chunk in the file
};

/// Maps a store and checks all of it before anything is believed: magic, version, size, the checksum over header and
/// table of contents, the offsets, and the checksum of every chunk (which also brings the pages into memory that
/// samplers are about to ask for).
Result<StoreContent> read_store(int descriptor, const std::string& name);

}  // namespace telesplat::data
