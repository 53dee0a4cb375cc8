#include "services/sampler/mesh/chunk_input.h"

#include <fmt/format.h>

namespace telesplat::sampler {

Result<geometry::HeldChunk> hold(ChunkId id, std::span<const std::byte> coded) {
  auto chunk = geometry::decode_chunk(coded);
  if (!chunk) return Error{fmt::format("chunk {} refused: {}", id.value, chunk.error().text)};
  return chunk;
}

Status Refusals::status() const {
  if (count_ == 0) return ok_status();
  if (batch_ == 1) return Error{first_};
  return Error{fmt::format("{} of {} chunks refused; first: {}", count_, batch_, first_)};
}

}  // namespace telesplat::sampler
