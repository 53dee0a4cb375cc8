// Decodes and checks a chunk that arrives, before a sampler reads it.
#pragma once

#include "common/core/ids.h"
#include "common/geometry/chunk_code.h"

namespace telesplat::sampler {

/// Decodes and validates a coded chunk. Errors name it.
Result<geometry::HeldChunk> hold(ChunkId id, std::span<const std::byte> coded);

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
