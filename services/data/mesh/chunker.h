// Splitting a mesh into chunks that are compact in space.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "services/data/mesh/placing/placement.h"

namespace telesplat::data {

inline constexpr size_t kTrianglesPerChunk = 1 << 16;

/// An assignment of triangles to chunks: chunk i has the triangles order[begin[i] .. begin[i + 1]).
struct ChunkPlan {
  std::vector<uint32_t> order;  ///< every triangle once
  std::vector<size_t> begin;    ///< one more than there are chunks
  size_t chunks() const { return begin.size() - 1; }
};

/// Splits at medians of triangle centroids across the longest axis (a balanced k-d tree) until no part has more than
/// `most` triangles; parts hold more than most / 2 (but for a mesh that is smaller). Neighbouring chunks are neighbours
/// in space. Deterministic, parallel (TBB). Precondition: the mesh has triangles; most >= 1.
ChunkPlan plan_chunks(const PlacedMesh& mesh, size_t most = kTrianglesPerChunk);

/// Lays out one chunk (geometry::build_chunk) of these triangles: vertices are renumbered in the order of their first
/// use, and doubled where faces of other colours meet, triangles follow a Morton curve through their centroids, so that
/// neighbours in memory are neighbours in space.
std::vector<std::byte> make_chunk(const PlacedMesh& mesh, std::span<const uint32_t> triangles);

}  // namespace telesplat::data
