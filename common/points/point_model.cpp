#include "common/points/point_model.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "common/points/allocation.h"

namespace telesplat::points {
namespace {

// A node of the map (link, key, pointer) and the cluster it points to, without its mosaics.
constexpr uint64_t kClusterBytes = allocated_bytes(3 * sizeof(void*)) + allocated_bytes(sizeof(Cluster));

// Makes room for one more, by a quarter instead of doubling: most clusters hold many small mosaics.
void reserve_one_more(std::vector<Mosaic>& mosaics) {
  if (mosaics.size() == mosaics.capacity()) mosaics.reserve(mosaics.size() + 1 + mosaics.size() / 4);
}

uint64_t header_bytes(const std::vector<Mosaic>& mosaics) {
  return allocated_bytes(mosaics.capacity() * sizeof(Mosaic));
}

}  // namespace

Status validate(const ModelConfig& config) {
  const geometry::Box& b = config.box_room;
  for (const float v : {b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z})
    if (!(std::abs(v) <= 1e6f))
      return Error{fmt::format("the model's box has a coordinate {} m outside [-1e6, 1e6]", v)};
  if (b.empty()) return Error{"the model's box is empty: its lower corner lies above its upper one"};
  if (config.depth < 0 || config.depth > kMaxOctreeDepth)
    return Error{fmt::format("octree depth {} is outside 0..{}", config.depth, kMaxOctreeDepth)};
  return ok_status();
}

OctreeGrid octree_grid(const ModelConfig& config) {
  CHECK(config.depth >= 0 && config.depth <= kMaxOctreeDepth && !config.box_room.empty());
  const glm::dvec3 lo(config.box_room.lo), hi(config.box_room.hi), extent = hi - lo;
  // A box that is a single point still gets leaves with a size.
  const double side = std::max(1.001 * std::max(extent.x, std::max(extent.y, extent.z)), 1e-6);
  return {(lo + hi) * 0.5 - glm::dvec3(side * 0.5), side / (1 << config.depth), config.depth};
}

geometry::Box octree_cube(const ModelConfig& config) {
  const OctreeGrid grid = octree_grid(config);
  return {glm::vec3(grid.lo), glm::vec3(grid.lo + grid.leaf_size * (1 << grid.depth))};
}

geometry::Box leaf_box(const ModelConfig& config, ClusterKey key) {
  const OctreeGrid grid = octree_grid(config);
  const glm::dvec3 cell(key & 1023, key >> 10 & 1023, key >> 20 & 1023);
  return {glm::vec3(grid.lo + cell * grid.leaf_size), glm::vec3(grid.lo + (cell + 1.0) * grid.leaf_size)};
}

PointModel::PointModel(const ModelConfig& config) : config_(config) { CHECK(validate(config).ok()); }

void PointModel::insert(PreparedPatch patch) {
  for (auto& [key, mosaic] : patch.mosaics) {
    auto& cluster = clusters_[key];
    if (!cluster) {
      cluster = std::make_unique<Cluster>(Cluster{key, leaf_box(config_, key), {}});
      cluster_bytes_ += kClusterBytes;
    }
    points_ += mosaic.count(0);
    cluster_bytes_ += mosaic.bytes() - sizeof(Mosaic);
    cluster_bytes_ -= header_bytes(cluster->mosaics);
    reserve_one_more(cluster->mosaics);
    cluster->mosaics.push_back(std::move(mosaic));
    cluster_bytes_ += header_bytes(cluster->mosaics);
  }
}

std::vector<std::unique_ptr<Cluster>> PointModel::take_out(std::span<const ClusterKey> keys) {
  std::vector<std::unique_ptr<Cluster>> dropped;
  dropped.reserve(keys.size());
  for (const ClusterKey key : keys) {
    const auto found = clusters_.find(key);
    if (found == clusters_.end()) continue;
    for (const Mosaic& mosaic : found->second->mosaics) {
      points_ -= mosaic.count(0);
      cluster_bytes_ -= mosaic.bytes() - sizeof(Mosaic);
    }
    cluster_bytes_ -= kClusterBytes + header_bytes(found->second->mosaics);
    dropped.push_back(std::move(found->second));
    clusters_.erase(found);
  }
  return dropped;
}

std::vector<Cluster> PointModel::forget(std::span<const ClusterKey> keys) {
  std::vector<Cluster> dropped;
  for (const auto& cluster : take_out(keys)) dropped.push_back(std::move(*cluster));
  return dropped;
}

std::vector<std::unique_ptr<Cluster>> PointModel::take_out(std::span<const ClusterKey> keys,
                                                           std::span<const uint32_t> frames) {
  CHECK(keys.size() == frames.size());
  std::vector<std::unique_ptr<Cluster>> dropped;
  std::vector<Mosaic> mosaics;
  for (size_t i = 0; i < keys.size(); ++i) {
    const auto found = clusters_.find(keys[i]);
    if (found == clusters_.end()) continue;
    Cluster& cluster = *found->second;
    const auto is_of_patch = [&](const Mosaic& m) { return m.frame_tag() == frames[i]; };
    const auto first = std::find_if(cluster.mosaics.begin(), cluster.mosaics.end(), is_of_patch);
    if (first == cluster.mosaics.end()) continue;
    if (std::all_of(first, cluster.mosaics.end(), is_of_patch) && first == cluster.mosaics.begin()) {
      auto whole = take_out(keys.subspan(i, 1));
      dropped.push_back(std::move(whole.front()));
      continue;
    }
    // What stays closes up, in order of sequence.
    mosaics.clear();
    auto end = first;
    for (auto m = first; m != cluster.mosaics.end(); ++m) {
      if (!is_of_patch(*m)) {
        *end++ = std::move(*m);
        continue;
      }
      points_ -= m->count(0);
      cluster_bytes_ -= m->bytes() - sizeof(Mosaic);
      mosaics.push_back(std::move(*m));
    }
    cluster.mosaics.erase(end, cluster.mosaics.end());
    dropped.push_back(std::make_unique<Cluster>(Cluster{cluster.key, cluster.leaf_room, std::move(mosaics)}));
  }
  return dropped;
}

std::vector<Cluster> PointModel::forget(std::span<const ClusterKey> keys, std::span<const uint32_t> frames) {
  std::vector<Cluster> dropped;
  for (const auto& cluster : take_out(keys, frames)) dropped.push_back(std::move(*cluster));
  return dropped;
}

void PointModel::clear() {
  clusters_.clear();
  points_ = cluster_bytes_ = 0;
}

const Cluster* PointModel::find(ClusterKey key) const {
  const auto found = clusters_.find(key);
  return found == clusters_.end() ? nullptr : found->second.get();
}

uint64_t PointModel::bytes() const {
  return sizeof(PointModel) + cluster_bytes_ + allocated_bytes(clusters_.bucket_count() * sizeof(void*));
}

uint64_t PointModel::points_in(ClusterKey key) const {
  const Cluster* cluster = find(key);
  uint64_t n = 0;
  if (cluster)
    for (const Mosaic& mosaic : cluster->mosaics) n += mosaic.count(0);
  return n;
}

uint64_t PointModel::digest() const {
  uint64_t sum = 0;
  for (const auto& [key, cluster] : clusters_) {
    uint64_t hash = key;
    for (const Mosaic& mosaic : cluster->mosaics) {
      const uint64_t pair[2] = {hash, mosaic.digest()};
      hash = XXH3_64bits(pair, sizeof pair);
    }
    sum += hash;
  }
  return sum;
}

}  // namespace telesplat::points
