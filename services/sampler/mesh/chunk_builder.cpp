#include "services/sampler/mesh/chunk_builder.h"

#include <chrono>

#include "common/core/clock.h"
#include "common/geometry/chunk_code.h"

namespace telesplat::sampler {

void ChunkBuilder::take(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) {
  for (auto& [id, chunk] : chunks) {
    const uint64_t bytes = geometry::decoded_bytes(chunk.bytes);
    if (auto prepare = sampler_->preparing(id, chunk)) {
      waiting_.push_back({id, bytes, std::move(prepare)});
    } else {
      const double begin_s = monotonic_s();
      Status status = sampler_->add_chunk(id, std::move(chunk));
      added_.push_back({id, bytes, std::move(status), begin_s, monotonic_s()});
    }
  }
  begin();
}

void ChunkBuilder::begin() {
  if (busy() || waiting_.empty()) return;
  preparing_ = std::async(std::launch::async, [batch = std::exchange(waiting_, {})] {
    std::vector<Prepared> out;
    for (const Waiting& chunk : batch) {
      const double begin_s = monotonic_s();
      auto add = chunk.prepare();
      out.push_back({chunk.id, chunk.bytes, std::move(add), begin_s, monotonic_s()});
    }
    return out;
  });
}

std::vector<ChunkBuilder::Added> ChunkBuilder::add() {
  if (busy() && preparing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    for (Prepared& chunk : preparing_.get()) {
      if (chunk.add) (*chunk.add)();
      Status status = chunk.add ? ok_status() : Status(chunk.add.error());
      added_.push_back({chunk.id, chunk.bytes, std::move(status), chunk.begin_s, chunk.end_s});
    }
    begin();
  }
  return std::exchange(added_, {});
}

void ChunkBuilder::drop() {
  waiting_.clear();
  if (busy()) preparing_.wait(), preparing_ = {};
  added_.clear();
}

}  // namespace telesplat::sampler
