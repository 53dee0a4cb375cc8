// Keeps points in GPU memory: a few large buffers, each with a free list, and a table of the points' places.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

/// Place of a level's points: 32-bit words from `word` on in buffer `arena`, laid out as
///   uint16 x[n], y[n], z[n], normal[n]; uint32 colour[n]      (3 n words)
struct PointRange {
  uint32_t arena = 0, word = 0;
};

/// All functions need a current GL context.
class PointArenas {
 public:
  PointArenas();
  ~PointArenas();
  PointArenas(const PointArenas&) = delete;
  PointArenas& operator=(const PointArenas&) = delete;

  /// Returns the place of item.arrays(), uploaded now if it is not there. An uploaded copy is reused only if replica
  /// (DrawList::replica), cluster, sequence, count and address are equal: a freed mosaic's address may come back with
  /// other points, and so may its sequence from another packer. Items without a sequence are uploaded every frame.
  PointRange place(const splat::DrawItem& item, uint64_t replica);
  /// Frees points that were not placed during the last kKeptFrames frames (items without a sequence at once).
  void end_frame();

  uint32_t count() const { return static_cast<uint32_t>(arenas_.size()); }
  uint32_t buffer(uint32_t arena) const { return arenas_[arena].buffer; }
  size_t entries() const { return entries_.size(); }

  static constexpr uint64_t kKeptFrames = 240;

 private:
  struct Key {
    points::ClusterKey cluster;
    uint32_t count;
    Sequence sequence;
    uint64_t replica;
    const void *x, *colour;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    size_t operator()(const Key& k) const;
  };
  struct Entry {
    PointRange range;
    uint32_t words = 0;
    uint64_t last_frame = 0;
  };
  struct Arena {
    uint32_t buffer = 0;
    std::map<uint32_t, uint32_t> free;  // word -> words
  };

  PointRange allocate(uint32_t words);
  void release(const PointRange& range, uint32_t words);
  void upload(const points::Mosaic::Level& level, const PointRange& range);

  uint32_t arena_words_;
  uint64_t frame_ = 0;
  std::vector<Arena> arenas_;
  std::unordered_map<Key, Entry, KeyHash> entries_;
  std::vector<Entry> transient_;
  std::vector<uint32_t> staging_;
};

}  // namespace telesplat::viewer
