// The mesh in Embree: one bounding volume hierarchy for each chunk, instanced into one small hierarchy over all chunks.
//
// Chunks are built when they arrive, in parallel and independently, so that adding or replacing one never rebuilds
// another; Embree reads positions and indices of decoded chunks where they lie. Measured with 5.76M triangles in 98
// chunks on two cores (1280x800):
//                                    all chunks to first ray    replacing one    frame
//   instanced chunk scenes                            0.99 s            0.01 s    55 ms
//   one flat scene                                    1.89 s            1.8  s    51 ms
//   one RTC_SCENE_FLAG_DYNAMIC scene                  1.35 s            2.1  s    57 ms
#pragma once

#include <embree3/rtcore.h>
#include <tbb/task_arena.h>

#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "common/geometry/clip.h"
#include "services/sampler/mesh/chunk_input.h"

namespace telesplat::sampler {

class RayScene {
 public:
  /// threads: number of oneTBB threads that build and trace, 0 = all cores.
  explicit RayScene(int threads);

  /// As Sampler::add_chunks.
  Status add(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks);
  /// Decodes a chunk and builds its hierarchy. Threads may call it at once, and while scene() is traced. The returned
  /// function adds it.
  Result<std::function<void()>> prepare(ChunkId id, std::span<const std::byte> coded);
  void remove(ChunkId id);
  /// As Sampler::show.
  void show(const std::vector<ChunkId>& chunks);

  /// Brings the hierarchy over the chunks up to date. To be called before scene() is traced: until then it may refer to
  /// chunks that are gone.
  void commit();

  RTCScene scene() const { return top_.get(); }
  /// Sets the clip to which rays are cut.
  void set_clip(const geometry::Clip& clip) { clip_ = clip; }
  const geometry::Clip& clip() const { return clip_; }
  /// Returns the chunk of a hit's instID.
  const geometry::MeshChunkView& chunk(unsigned slot) const { return slots_[slot].held.view; }
  /// All parallel work runs in here.
  tbb::task_arena& arena() { return arena_; }

 private:
  struct Release {
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  using Device = std::unique_ptr<RTCDeviceTy, Release>;
  using Scene = std::unique_ptr<RTCSceneTy, Release>;

  struct Slot {
    geometry::HeldChunk held;
    Scene scene;
    bool shown = true;
  };

  Result<Slot> build(ChunkId id, std::span<const std::byte> coded) const;
  void install(ChunkId id, Slot slot);

  tbb::task_arena arena_;
  Device device_;
  std::vector<Slot> slots_;  // index = geometry id in the top scene = a hit's instID
  std::vector<unsigned> free_;
  std::unordered_map<ChunkId, unsigned> slot_of_;
  geometry::Clip clip_;
  Scene top_;  // after the slots, so that it is destroyed first
  bool changed_ = true;
};

}  // namespace telesplat::sampler
