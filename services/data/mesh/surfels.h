// Makes the surfels of a mesh: means of its surface in the cells of a grid.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/chunk_code.h"
#include "services/data/mesh/store.h"

namespace telesplat::data {

/// Surfels that the chunk store of a large mesh holds, about, and that of the smallest.
inline constexpr size_t kMostStored = 400'000, kLeastStored = 2'000;
/// Surfels that the store of a mesh holds, about: four a triangle, within these limits.
constexpr size_t stored_surfels(uint64_t triangles) {
  return static_cast<size_t>(std::clamp<uint64_t>(4 * triangles, kLeastStored, kMostStored));
}

/// The chunks of a mesh, in their order.
struct SurfelSource {
  geometry::Box box_room;
  uint64_t triangles = 0;
  size_t chunks = 0;
  std::function<geometry::HeldChunk(size_t chunk)> chunk;  ///< called on several threads
};

/// Returns a surfel set (geometry/surfels.h) of about `most` surfels: one for each cell of a grid that the surface
/// meets, and more where it faces several ways, so that both sides of a thin wall keep theirs. Position, normal, colour
/// or scalar are means by area. The same chunks give the same bytes. Empty: `stop` became true.
/// Precondition: 1 <= most <= geometry::kMaxSurfels.
std::vector<std::byte> make_surfels(const SurfelSource& source, size_t most, const std::atomic<bool>& stop);

/// Has the surfels that were asked for last: those of the store, or other ones, which are made in a thread of its own
/// if the mesh is large.
class SurfelMaker {
 public:
  using Bytes = std::optional<geometry::ChunkBytes>;
  SurfelMaker() = default;
  SurfelMaker(const SurfelMaker&) = delete;
  /// Cancels the work, and waits until its thread ends.
  ~SurfelMaker();

  /// Returns the surfels of a store whose chunks hold this array. Nothing: they are not made yet; asking begins it, and
  /// gives up those of another array.
  Bytes get(const std::shared_ptr<const MeshStore>& store, const std::string& array, size_t most);

 private:
  struct Wanted {
    std::string array;
    size_t most = 0;
    bool operator==(const Wanted&) const = default;
  };
  Wanted wanted_;
  Bytes made_;
  std::future<geometry::ChunkBytes> making_;
  std::atomic<bool> stop_{false};
};

}  // namespace telesplat::data
