// The stages of a view update, in their order: columns of stages.csv.
#pragma once

#include <string_view>

namespace telesplat::launcher {

struct UpdateStage {
  const char* column;  ///< in stages.csv
  const char* label;   ///< for people
};

inline constexpr UpdateStage kUpdateStages[] = {
    {"request_network_ms", "request travels"},
    {"view_queue_ms", "request waits at the master"},
    {"plan_ms", "plan"},
    {"lease_queue_ms", "waits for a sampler"},
    {"lease_network_ms", "lease travels"},
    {"sampler_queue_ms", "waits in the sampler"},
    {"fetch_ms", "sampler fetches data"},
    {"sampling_ms", "sampling"},
    {"encoding_ms", "encoding"},
    {"tile_network_ms", "tile travels"},
    {"packer_queue_ms", "waits at the packer"},
    {"packing_ms", "packing"},
    {"publishing_ms", "publishing"},
    {"patch_network_ms", "patch travels"},
    {"viewer_queue_ms", "waits in the viewer"},
    {"decoding_ms", "decoding"},
    {"insertion_ms", "insertion"},
};

/// "network", "queue" or "work", as the column's name ends.
constexpr const char* stage_group(std::string_view column) {
  return column.ends_with("_network_ms") ? "network" : column.ends_with("_queue_ms") ? "queue" : "work";
}

}  // namespace telesplat::launcher
