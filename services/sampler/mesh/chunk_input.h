// Checks a chunk that arrives, before a sampler reads it.
#pragma once

#include "common/core/ids.h"
#include "common/geometry/mesh_chunk.h"

namespace telesplat::sampler {

/// A valid chunk, and the owner that keeps its bytes alive.
struct HeldChunk {
  geometry::MeshChunkView view;
  std::shared_ptr<const void> owner;
};

/// Validates a chunk. Copies bytes that are not aligned to 4 first; uses others in place. Errors name the chunk.
Result<HeldChunk> hold(ChunkId id, geometry::ChunkBytes chunk);

/// Gathers the refusals of a batch into one status: "2 of 9 chunks refused; first: ...".
class Refusals {
 public:
  explicit Refusals(size_t batch) : batch_(batch) {}
  void add(const Error& error) {
    if (count_++ == 0) first_ = error.text;
  }
  Status status() const;

 private:
  size_t batch_, count_ = 0;
  std::string first_;
};

}  // namespace telesplat::sampler
