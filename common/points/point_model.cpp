#include "common/points/point_model.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "common/points/allocation.h"
#include "common/points/compaction.h"

namespace telesplat::points {
namespace {

// Bytes of a node of the map (link, key, pointer) and of its cluster, without mosaics.
constexpr uint64_t kClusterBytes = allocated_bytes(3 * sizeof(void*)) + allocated_bytes(sizeof(Cluster));

// Grows by a quarter instead of doubling: most clusters hold many small mosaics.
void reserve_one_more(auto& list) {
  if (list.size() == list.capacity()) list.reserve(list.size() + 1 + list.size() / 4);
}

// Bytes of a brick, likewise, without its list of clusters.
constexpr uint64_t kBrickBytes = allocated_bytes(3 * sizeof(void*)) + allocated_bytes(sizeof(Brick));

uint64_t list_bytes(const Brick& brick) { return allocated_bytes(brick.clusters.capacity() * sizeof(void*)); }

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

Brick& PointModel::brick_of(ClusterKey key) {
  auto& brick = bricks_[brick_key(key)];
  if (!brick) {
    cluster_bytes_ += kBrickBytes;
    const ClusterKey side = std::min(3, (1 << config_.depth) - 1), first = brick_key(key);
    brick = std::make_unique<Brick>(
        Brick{{leaf_box(config_, first).lo, leaf_box(config_, first + side * (1u | 1u << 10 | 1u << 20)).hi},
              {},
              0,
              removals_});
  }
  ++brick->changes;
  return *brick;
}

Insertion PointModel::plan(PreparedPatch patch) const {
  Insertion out{patch.sequence, {}};
  out.changes.reserve(patch.mosaics.size());
  for (auto& [key, mosaic] : patch.mosaics) {
    Insertion::Change& change = out.changes.emplace_back(Insertion::Change{key, {}, {}, {}});
    const Cluster* cluster = config_.compact ? find(key) : nullptr;
    if (!cluster) {
      change.added.push_back(std::move(mosaic));
      continue;
    }
    Merge merge = plan_merge(cluster->mosaics, std::move(mosaic));
    change.replaced = std::move(merge.replaced);
    change.added = std::move(merge.added);
  }
  return out;
}

std::vector<Mosaic> PointModel::commit(Insertion insertion) {
  std::vector<Mosaic> replaced;
  for (auto& change : insertion.changes) {
    auto& cluster = clusters_[change.key];
    if (!cluster) {
      cluster = std::make_unique<Cluster>(Cluster{change.key, leaf_box(config_, change.key), {}});
      cluster_bytes_ += kClusterBytes;
      Brick& brick = brick_of(change.key);
      cluster_bytes_ -= list_bytes(brick);
      reserve_one_more(brick.clusters);
      brick.clusters.push_back(cluster.get());
      cluster_bytes_ += list_bytes(brick);
    } else {
      brick_of(change.key);
    }
    std::vector<Mosaic>& mosaics = cluster->mosaics;
    cluster_bytes_ -= header_bytes(mosaics);
    for (auto& [at, mosaic] : change.renewed) {
      cluster_bytes_ += mosaic.bytes() - mosaics[at].bytes();
      std::swap(mosaics[at], mosaic);
      replaced.push_back(std::move(mosaic));
    }
    if (!change.replaced.empty()) {
      // Moves the mosaics that stay together.
      auto next = change.replaced.begin();
      size_t end = *next;
      for (size_t i = end; i < mosaics.size(); ++i) {
        if (next == change.replaced.end() || *next != i) {
          mosaics[end++] = std::move(mosaics[i]);
          continue;
        }
        ++next;
        points_ -= mosaics[i].count(0);
        cluster_bytes_ -= mosaics[i].bytes() - sizeof(Mosaic);
        replaced.push_back(std::move(mosaics[i]));
      }
      mosaics.erase(mosaics.begin() + static_cast<ptrdiff_t>(end), mosaics.end());
    }
    for (Mosaic& mosaic : change.added) {
      points_ += mosaic.count(0);
      cluster_bytes_ += mosaic.bytes() - sizeof(Mosaic);
      reserve_one_more(mosaics);
      mosaics.push_back(std::move(mosaic));
    }
    cluster_bytes_ += header_bytes(mosaics);
  }
  return replaced;
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
    Brick& brick = brick_of(key);
    brick.removals = ++removals_;
    auto& in_brick = brick.clusters;
    in_brick.erase(std::find(in_brick.begin(), in_brick.end(), found->second.get()));
    if (in_brick.empty()) {
      cluster_bytes_ -= kBrickBytes + list_bytes(brick);
      bricks_.erase(brick_key(key));
    }
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
    // Moves the mosaics that stay together, in order of sequence.
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
    brick_of(cluster.key).removals = ++removals_;
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
  bricks_.clear();
  clusters_.clear();
  points_ = cluster_bytes_ = 0;
}

const Cluster* PointModel::find(ClusterKey key) const {
  const auto found = clusters_.find(key);
  return found == clusters_.end() ? nullptr : found->second.get();
}

uint64_t PointModel::bytes() const {
  return sizeof(PointModel) + cluster_bytes_ + allocated_bytes(clusters_.bucket_count() * sizeof(void*)) +
         allocated_bytes(bricks_.bucket_count() * sizeof(void*));
}

uint64_t PointModel::points_in(ClusterKey key) const {
  const Cluster* cluster = find(key);
  uint64_t n = 0;
  if (cluster)
    for (const Mosaic& mosaic : cluster->mosaics) n += mosaic.count(0);
  return n;
}

uint64_t PointModel::digest() const {
  uint64_t sum = 0x7e1e5;  // not 0, which means "no digest", even for an empty model
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
