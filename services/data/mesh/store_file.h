// The chunk store's file: a header, a table of contents, the chunks. Written once, then mapped.
//
//     offset 0      StoreHeader, padded to 4096
//     4096          StoreEntry[chunks], padded to a multiple of 4096: the leaves, then the levels above (levels.h)
//     then          the chunks (common/geometry/chunk_code.h), each at a multiple of 4096, in the order of making
//     then          the file's arrays as scene::to_text(); then lines: format, up axis, reason for it, array of the
//                                 chunks' values, coordinates, and remarks on the file, without its name
//
// Native byte order: the file is a cache and never travels.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/geometry/mesh_chunk.h"
#include "services/data/base/mapped_file.h"
#include "services/data/mesh/placing/placement.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

inline constexpr size_t kTrianglesPerChunk = 1 << 16;

/// Assigns triangles to chunks: chunk i has the triangles order[begin[i] .. begin[i + 1]).
struct ChunkPlan {
  std::vector<uint32_t> order;  ///< every triangle once
  std::vector<size_t> begin;    ///< one entry more than chunks
  size_t chunks() const { return begin.size() - 1; }
};

/// Splits at medians of triangle centroids across the longest axis (a balanced k-d tree) until no part has more than
/// `most` triangles; parts hold more than most / 2 (except in a smaller mesh). Neighbouring chunks are neighbours in
/// space. Deterministic, parallel (TBB). Precondition: the mesh has triangles; most >= 1.
ChunkPlan plan_chunks(const PlacedMesh& mesh, size_t most = kTrianglesPerChunk);
/// The same with this number of chunks. Precondition: no more than the mesh has triangles, and at least one.
ChunkPlan plan_chunk_count(const PlacedMesh& mesh, size_t chunks);

/// Lays out one chunk (geometry::build_chunk) of these triangles: vertices are renumbered in the order of their first
/// use, and doubled where faces of different colours meet; triangles follow a Morton curve through their centroids, so
/// that neighbours in memory are neighbours in space.
std::vector<std::byte> make_chunk(const PlacedMesh& mesh, std::span<const uint32_t> triangles);

inline constexpr uint64_t kStoreMagic = 0x31455453'48534d54;  // "TMSHSTE1"
/// To be raised whenever readers, placement or layout would make another file from the same mesh.
inline constexpr uint32_t kStoreVersion = 12;

/// Bytes a triangle that a store with its levels takes, about.
inline constexpr uint64_t kBytesATriangle = 22;
/// Checks that the disk of the open file has room for a store of that many triangles. The error starts with `name`.
Status check_room(int descriptor, const std::string& name, uint64_t triangles);

/// Writes a store into an open, empty, writable file: its leaves, then what is made of them. After a failure (disk
/// full) the file's content is useless.
class StoreWriter {
 public:
  /// leaves: at most. Error, starting with `name`: the store would have too many chunks.
  static Result<StoreWriter> begin(int descriptor, const std::string& name, size_t leaves);
  StoreWriter(StoreWriter&&) noexcept;
  ~StoreWriter();

  /// Writes the chunks of `plan` as the leaves from `first` on. Leaves that follow each other are neighbours in space.
  /// Several threads may write different leaves. progress: 0..1, called on this thread.
  void write_leaves(size_t first, const PlacedMesh& mesh, const ChunkPlan& plan, const ReadProgress& progress);
  /// Box of the leaves that were written.
  geometry::Box box_room() const;
  /// Writes levels and the table of contents. `info` describes the mesh, with boxes and counts. Leaves that were not
  /// written are left out. Error, starting with the name: it cannot be written.
  Status finish(const MeshStoreInfo& info, const Progress& progress);

 private:
  StoreWriter(int descriptor, std::string name, size_t leaves);
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Writes the store of a placed mesh. `progress` (stages from kSortingIntoChunks on) is called on this thread.
Status write_store(int descriptor, const std::string& name, const PlacedMesh& mesh, const MeshStoreInfo& info,
                   const Progress& progress);

struct StoreContent {
  std::shared_ptr<const MappedFile> file;
  MeshStoreInfo info;  ///< without source, from_cache and kept_in; notes without the file's name
  std::vector<geometry::ChunkInfo> chunks;
  std::vector<size_t> offsets;      ///< offset of each chunk in the file
  std::vector<uint64_t> checksums;  ///< XXH3 of each chunk
  bool checked = false;             ///< all chunks are
  std::span<const std::byte> chunk(size_t i) const { return file->bytes().subspan(offsets[i], chunks[i].bytes); }
};

/// Maps a store and checks it before any value is used: magic, version, size, the offsets, and the checksums of header,
/// table and, unless they have more than `most_checked` bytes together, chunks.
Result<StoreContent> read_store(int descriptor, const std::string& name, uint64_t most_checked = ~uint64_t{0});

/// False: the chunk is damaged.
bool is_whole(const StoreContent& store, size_t chunk);

}  // namespace telesplat::data
