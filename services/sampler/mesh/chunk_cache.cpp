#include "services/sampler/mesh/chunk_cache.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace telesplat::sampler {

void ChunkCache::reset(std::vector<geometry::ChunkInfo> chunks) {
  std::sort(chunks.begin(), chunks.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  chunks_ = std::move(chunks);
  held_.clear();
  waiting_.clear();
  bytes_ = 0;
}

std::vector<ChunkId> ChunkCache::missing(const geometry::Camera& camera) {
  const geometry::Frustum frustum(camera);
  ++use_;
  std::vector<std::pair<float, ChunkId>> order;
  for (const auto& c : chunks_) {
    if (!frustum.may_contain(c.box_room)) continue;
    if (const auto it = held_.find(c.id); it != held_.end())
      it->second = use_;
    else
      order.emplace_back(glm::distance(c.box_room.centre(), glm::vec3(camera.pose.position_room)), c.id);
  }
  std::sort(order.begin(), order.end());
  std::vector<ChunkId> out;
  for (const auto& [distance, id] : order) out.push_back(id);
  return out;
}

std::vector<ChunkId> ChunkCache::prefetch() const {
  std::vector<ChunkId> out;
  uint64_t bytes = bytes_;
  for (const auto& c : chunks_) {
    if (held_.contains(c.id)) continue;
    bytes += c.bytes;
    if (bytes > budget_bytes_) break;
    out.push_back(c.id);
  }
  return out;
}

std::vector<ChunkId> ChunkCache::insert(ChunkId id) {
  waiting_.erase(id);
  const auto size_of = [&](ChunkId c) {
    const auto it =
        std::lower_bound(chunks_.begin(), chunks_.end(), c, [](const auto& info, ChunkId v) { return info.id < v; });
    return it != chunks_.end() && it->id == c ? it->bytes : 0;
  };
  if (held_.emplace(id, use_).second) bytes_ += size_of(id);
  std::vector<ChunkId> removed;
  while (bytes_ > budget_bytes_) {
    const auto oldest =
        std::min_element(held_.begin(), held_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (oldest->second == use_) break;
    removed.push_back(oldest->first);
    bytes_ -= size_of(oldest->first);
    held_.erase(oldest);
  }
  return removed;
}

}  // namespace telesplat::sampler
