#include "services/sampler/mesh/chunk_cache.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace telesplat::sampler {

void ChunkCache::reset(std::vector<geometry::ChunkInfo> chunks) {
  std::sort(chunks.begin(), chunks.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  chunks_ = std::move(chunks);
  held_.clear();
  refused_.clear();
  waiting_.clear();
  bytes_ = 0;
  holes_ = 0;
}

std::vector<ChunkId> ChunkCache::missing(const geometry::Camera& camera) {
  const geometry::Frustum frustum(camera);
  ++use_;
  std::vector<std::pair<float, ChunkId>> order;
  for (const auto& c : chunks_) {
    if (!frustum.may_contain(c.box_room)) continue;
    if (const auto it = held_.find(c.id); it != held_.end())
      it->second.use = use_;
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

uint64_t ChunkCache::bytes_of(ChunkId id) const {
  const auto it =
      std::lower_bound(chunks_.begin(), chunks_.end(), id, [](const auto& info, ChunkId v) { return info.id < v; });
  return it != chunks_.end() && it->id == id ? it->bytes : 0;
}

uint64_t ChunkCache::waiting_bytes() const {
  uint64_t out = 0;
  for (const ChunkId id : waiting_) out += bytes_of(id);
  return out;
}

std::vector<ChunkId> ChunkCache::insert(ChunkId id, uint64_t bytes) {
  waiting_.erase(id);
  refused_.erase(id);
  if (held_.try_emplace(id, Held{use_, bytes}).second) bytes_ += bytes;
  std::vector<ChunkId> removed;
  while (bytes_ > budget_bytes_) {
    const auto oldest = std::min_element(held_.begin(), held_.end(),
                                         [](const auto& a, const auto& b) { return a.second.use < b.second.use; });
    if (oldest->second.use == use_) break;
    removed.push_back(oldest->first);
    bytes_ -= oldest->second.bytes;
    held_.erase(oldest);
  }
  return removed;
}

bool ChunkCache::refuse(ChunkId id) {
  waiting_.erase(id);
  if (++refused_[id] < kTries) return false;
  refused_.erase(id);
  holes_ += held_.try_emplace(id, Held{use_, 0}).second;
  return true;
}

}  // namespace telesplat::sampler
