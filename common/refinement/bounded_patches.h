// Keeps patches with bounded errors until their refinements follow, for packer and viewers.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/points/refinement.h"

namespace telesplat::refinement {

/// The newest bounded patches, which may still be refined. The packer refines only patches in its book; a viewer's book
/// holds all of them, because it has seen no newer ones. T: data kept for a patch.
template <class T>
class RefinableBook {
 public:
  /// A patch is not refined after this many bytes of later patches, or this many of them.
  static constexpr uint64_t kMostBytes = 64u << 20;
  static constexpr uint64_t kMostPatches = 8192;

  /// bytes: size of its coded image. Sequences rise.
  void add(Sequence sequence, uint64_t bytes, T what) {
    bytes_ += bytes;
    ++patches_;
    entries_.push_back({sequence, bytes_, patches_, std::move(what)});
    while (bytes_ - entries_.front().bytes > kMostBytes || patches_ - entries_.front().patches >= kMostPatches)
      entries_.pop_front();
  }
  /// Removes and returns the newest entry for which wanted() is true. Nothing: no such entry.
  std::optional<std::pair<Sequence, T>> take_newest(const auto& wanted) {
    for (auto e = entries_.end(); e != entries_.begin();) {
      --e;
      if (!wanted(e->sequence, e->what)) continue;
      std::pair<Sequence, T> out{e->sequence, std::move(e->what)};
      entries_.erase(e);
      return out;
    }
    return std::nullopt;
  }
  /// Removes and returns the entry with that sequence. Nothing: it is not here.
  std::optional<T> take(Sequence sequence) {
    const auto found = std::lower_bound(entries_.begin(), entries_.end(), sequence,
                                        [](const Entry& e, Sequence s) { return e.sequence < s; });
    if (found == entries_.end() || found->sequence != sequence) return std::nullopt;
    T out = std::move(found->what);
    entries_.erase(found);
    return out;
  }
  void clear() { entries_.clear(); }
  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    Sequence sequence;
    uint64_t bytes, patches;  // totals up to this entry
    T what;
  };
  std::deque<Entry> entries_;  // oldest first
  uint64_t bytes_ = 0, patches_ = 0;
};

/// A bounded patch, as it was published.
struct BoundedPatch {
  geometry::Camera camera;  ///< camera of the whole frame
  geometry::Rect rect;      ///< the patch in it
  std::vector<uint8_t> stream;
  FrameId tag;  ///< points::tagged()
};

/// The book of a process that follows the packer.
class BoundedPatches {
 public:
  /// Precondition: the stream was decoded, so it is valid.
  void add(Sequence sequence, const geometry::Camera& camera, const geometry::Rect& rect,
           std::span<const uint8_t> stream, FrameId tag = {}) {
    book_.add(sequence, stream.size(), {camera, rect, {stream.begin(), stream.end()}, tag});
  }
  /// Reads the stream of event `sequence`, which refines patch `of`. Nothing: that patch is not here, because all of
  /// its points were forgotten. Error: the stream does not fit it.
  Result<std::optional<points::PreparedRefinement>> refine(const points::ModelConfig& config, Sequence sequence,
                                                           Sequence of, std::span<const uint8_t> stream);
  void clear() { book_.clear(); }

 private:
  RefinableBook<BoundedPatch> book_;
};

}  // namespace telesplat::refinement
