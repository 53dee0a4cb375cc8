// What was drawn since the last access report: the packer forgets what nobody draws (T4.3.3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/points/point_model.h"

namespace telesplat::viewer {

/// Distinct clusters, or, where packing keeps redundant patches, distinct patches of clusters.
class AccessLog {
 public:
  /// Entries of one report: well below the size of a message.
  static constexpr size_t kMaxInReport = 1u << 16;

  /// What a frame drew; `frames` is empty (whole clusters) or as long as `clusters` (frame tags of patches). Whoever
  /// changes from one to the other begins anew. Cheap: for the display thread.
  void add(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames);

  /// The fields of wire::AccessReport.
  struct Report {
    std::vector<uint32_t> clusters, frames;
  };
  /// Everything added since the last call, once each, in ascending order of cluster and frame tag; empty if nothing
  /// was.
  std::vector<Report> reports();

 private:
  std::vector<uint64_t> seen_;  // cluster << 32 | frame tag, as it came
  bool with_frames_ = false;
};

}  // namespace telesplat::viewer
