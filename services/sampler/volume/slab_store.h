// The voxels of a volume that a sampler holds: finds the ones that a slab lacks and the server that has them, and drops
// some when memory runs short. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/volume/grid.h"
#include "common/wire/messages.h"
#include "services/sampler/volume/slab.h"

namespace telesplat::sampler {

/// The properties of a volume on which its voxels depend.
struct SlabScene {
  volume::Grid grid;
  volume::Levels levels;
  bool lit = true;
  int steps = 1;
  std::string content;  ///< identifies the data set among others of the same shape
  bool operator==(const SlabScene&) const = default;
};

/// Slices [begin, end) of a step, with all voxels of some levels.
struct SlabWant {
  int step = 0, begin = 0, end = 0;
  EpochId epoch;                            ///< epoch of the requests to servers
  const volume::LevelSet* shown = nullptr;  ///< the levels that this epoch shows
};

/// The next request: slices of a step, and the server to ask.
struct VoxelAsk {
  std::string endpoint;
  int step = 0, begin = 0, end = 0;
  uint64_t round = 0;
  EpochId epoch;
  volume::LevelSet have;  ///< levels that all of these slices have already
};

class SlabStore {
 public:
  /// budget_bytes: memory for voxels, without those that leases need.
  SlabStore(MakeSlab make, uint64_t budget_bytes) : make_(std::move(make)), budget_bytes_(budget_bytes) {}

  /// Sets the scene; forgets everything if it is another one.
  void set_scene(const SlabScene& scene);
  const std::optional<SlabScene>& scene() const { return scene_; }
  void clear();

  /// Takes over the assignment and its sheet. Older sheets stay valid for slices that it does not name. Error: slab,
  /// ranges or endpoints make no sense in this scene; then nothing changed. Precondition: scene() is set.
  Status assign(const wire::SlabAssignment& assignment);
  /// The newest assignment; partition 0: no assignment came yet.
  const wire::SlabAssignment& assignment() const { return assignment_; }
  /// True if a valid sheet names this server.
  bool names(const std::string& endpoint) const;
  /// Leases are for this range from now on. Slabs other than this one and the assigned one are not kept for long.
  void use(int begin, int end);

  /// True if all that splatting needs is here: the slices and one more on both sides.
  bool holds(const SlabWant& want) const;
  /// Returns the first missing slices, in the sheet's order. nullopt: all are here, or no sheet names their server.
  std::optional<VoxelAsk> next(const SlabWant& want) const;
  /// Takes the answer to `ask`; it is not trusted. shown: the levels that the ask's epoch shows; from then on the
  /// slices count as having all voxels of them. False: it does not answer `ask`, or comes too late (other levels are
  /// held by now). Error: the bytes are not voxels of exactly the slices in the answer's header; nothing changed.
  Result<bool> take(const VoxelAsk& ask, const wire::VoxelData& data, const volume::LevelSet& shown);
  /// Returns the slab, arranged for splatting; null: not all of it is here. It stays valid when the store drops it.
  std::shared_ptr<const Slab> slab(const SlabWant& want);
  bool arranged(const SlabWant& want) const { return find(want) != nullptr; }

  /// If more is held than the budget allows, drops first slices of neither the assigned range nor the one in use; then
  /// steps, the one farthest after `step` first; then voxels of levels that are not in `shown`. `step` itself stays.
  void trim(int step, const volume::LevelSet& shown);
  /// Returns the number of steps after `step`, in playing order, that fit in memory beside it if they are as large.
  int steps_ahead(int step) const;

  uint64_t bytes() const;
  uint64_t voxels() const { return voxels_; }

 private:
  struct Slice {
    volume::Voxels voxels;
    volume::LevelSet have;
  };
  struct Arranged {
    int step, begin, end;
    volume::LevelSet have;  // levels that all of its slices had when it was arranged
    std::shared_ptr<const Slab> slab;
  };
  using Key = std::pair<int, int>;  // step, k
  struct Range {
    int begin = 0, end = 0;
  };

  Range with_neighbours(int begin, int end) const;
  bool complete(int step, int k, const volume::LevelSet& shown) const;
  const Arranged* find(const SlabWant& want) const;
  bool kept(int k) const;
  void erase(std::map<Key, Slice>::iterator slice);
  void put(const Key& key, Slice slice);
  uint64_t bytes_of(int step) const;
  void drop_step(int step);

  MakeSlab make_;
  uint64_t budget_bytes_;
  std::optional<SlabScene> scene_;
  wire::SlabAssignment assignment_;
  std::vector<wire::SheetEntry> sheet_;  // by round; entries of older sheets follow
  Range used_;
  std::map<Key, Slice> slices_;
  std::vector<Arranged> arranged_;
  std::map<int, uint64_t> slice_bytes_;  // by step
  uint64_t voxels_ = 0;
};

}  // namespace telesplat::sampler
