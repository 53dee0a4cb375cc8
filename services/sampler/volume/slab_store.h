// The voxels a sampler holds of a volume: what it lacks for a slab, who has it, what it lets go when memory runs short.
// No sockets, no clocks.
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

/// The volume, as far as voxels depend on it.
struct SlabScene {
  volume::Grid grid;
  volume::Levels levels;
  bool lit = true;
  int steps = 1;
  std::string content;  ///< what tells one data set from another of the same shape
  bool operator==(const SlabScene&) const = default;
};

/// Slices [begin, end) of a step, with all voxels of some levels.
struct SlabWant {
  int step = 0, begin = 0, end = 0;
  EpochId epoch;                            ///< for which servers are asked
  const volume::LevelSet* shown = nullptr;  ///< the levels that this epoch shows
};

/// What is to be asked for next, and of whom.
struct VoxelAsk {
  std::string endpoint;
  int step = 0, begin = 0, end = 0;
  uint64_t round = 0;
  EpochId epoch;
  volume::LevelSet have;  ///< of all of these slices
};

class SlabStore {
 public:
  /// budget_bytes: of voxels held, those that leases need not counted.
  SlabStore(MakeSlab make, uint64_t budget_bytes) : make_(std::move(make)), budget_bytes_(budget_bytes) {}

  /// Forgets everything if it is another volume.
  void set_scene(const SlabScene& scene);
  const std::optional<SlabScene>& scene() const { return scene_; }
  void clear();

  /// Takes the sheet over. For slices that it does not name, older sheets go on holding. Error: slabs, ranges or
  /// endpoints that make no sense in this scene; nothing has changed then. Precondition: there is a scene.
  Status assign(const wire::SlabAssignment& assignment);
  /// The newest one; partition 0: none.
  const wire::SlabAssignment& assignment() const { return assignment_; }
  /// Whether a sheet that holds names this server.
  bool names(const std::string& endpoint) const;
  /// Leases are of this range from now on. Other slabs than it and the assigned one are not kept for long.
  void use(int begin, int end);

  /// Whether everything for splatting it is here: its slices and one more on both sides.
  bool holds(const SlabWant& want) const;
  /// What lacks first, in the order of the sheet. Nothing: all is here, or no sheet says who has it.
  std::optional<VoxelAsk> next(const SlabWant& want) const;
  /// Takes the answer to `ask`; it comes from outside. shown: the levels that the ask's epoch shows. The slices then
  /// count as having all voxels of those. False: not what was asked for, or too late (other levels are held by now).
  /// Error: the bytes are no voxels of just the slices that the answer's header names; nothing has changed then.
  Result<bool> take(const VoxelAsk& ask, const wire::VoxelData& data, const volume::LevelSet& shown);
  /// The slab, arranged for splatting; null: not all of it is here. It stays valid when the store lets go of it.
  std::shared_ptr<const Slab> slab(const SlabWant& want);
  bool arranged(const SlabWant& want) const { return find(want) != nullptr; }

  /// If more is held than the budget allows, lets go: first slices of neither the assigned range nor the one in use;
  /// then steps, the one farthest after `step` first; then voxels of levels that are not in `shown`. `step` itself
  /// stays.
  void trim(int step, const volume::LevelSet& shown);
  /// How many steps after `step`, in the order in which they play, fit in memory beside it if they are as large.
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
    volume::LevelSet have;  // of all of its slices, when it was arranged
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
  std::vector<wire::SheetEntry> sheet_;  // by round; older sheets' after
  Range used_;
  std::map<Key, Slice> slices_;
  std::vector<Arranged> arranged_;
  std::map<int, uint64_t> slice_bytes_;  // by step
  uint64_t voxels_ = 0;
};

}  // namespace telesplat::sampler
