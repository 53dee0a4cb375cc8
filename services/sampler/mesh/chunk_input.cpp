#include "services/sampler/mesh/chunk_input.h"

#include <fmt/format.h>

#include <cstring>

namespace telesplat::sampler {

Result<HeldChunk> hold(ChunkId id, geometry::ChunkBytes chunk) {
  if (reinterpret_cast<uintptr_t>(chunk.bytes.data()) % alignof(uint32_t) != 0) {
    const auto copy = std::make_shared<std::vector<uint32_t>>((chunk.bytes.size() + 3) / 4);
    std::memcpy(copy->data(), chunk.bytes.data(), chunk.bytes.size());
    chunk = {{reinterpret_cast<const std::byte*>(copy->data()), chunk.bytes.size()}, copy};
  }
  const auto view = geometry::MeshChunkView::validate(chunk.bytes);
  if (!view) return Error{fmt::format("chunk {} refused: {}", id.value, view.error().text)};
  return HeldChunk{*view, std::move(chunk.owner)};
}

Status Refusals::status() const {
  if (count_ == 0) return ok_status();
  if (batch_ == 1) return Error{first_};
  return Error{fmt::format("{} of {} chunks refused; first: {}", count_, batch_, first_)};
}

}  // namespace telesplat::sampler
