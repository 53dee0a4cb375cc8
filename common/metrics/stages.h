// The stages of a view update, from its request to the display: what each took (docs/metrics.md, stages.csv; the
// latencies of T6.2 broken down).
#pragma once

#include <array>
#include <cstddef>

#include "common/wire/moments.h"

namespace telesplat::metrics {

enum class StageKind { kWork, kNetwork, kQueue };

struct Stage {
  const char* column;  ///< of stages.csv; without "_ms" its name
  StageKind kind;
};

/// In the order in which they happen.
inline constexpr Stage kStages[] = {{"request_network_ms", StageKind::kNetwork}, {"view_queue_ms", StageKind::kQueue},
                                    {"plan_ms", StageKind::kWork},               {"lease_queue_ms", StageKind::kQueue},
                                    {"lease_network_ms", StageKind::kNetwork},   {"sampler_queue_ms", StageKind::kQueue},
                                    {"fetch_ms", StageKind::kWork},              {"sampling_ms", StageKind::kWork},
                                    {"encoding_ms", StageKind::kWork},           {"tile_network_ms", StageKind::kNetwork},
                                    {"packer_queue_ms", StageKind::kQueue},      {"packing_ms", StageKind::kWork},
                                    {"publishing_ms", StageKind::kWork},         {"patch_network_ms", StageKind::kNetwork},
                                    {"viewer_queue_ms", StageKind::kQueue},      {"decoding_ms", StageKind::kWork},
                                    {"insertion_ms", StageKind::kWork}};
inline constexpr size_t kStageCount = std::size(kStages);

/// What the viewer adds to the moments of the part that made an update complete; seconds of the master's clock.
struct UpdateMoments {
  double requested_s = 0;     ///< the update was asked for
  double arrived_s = 0;       ///< the part reached the viewer's machine
  double decode_begin_s = 0;  ///< it was taken from its queue
  double decoded_s = 0;
  double complete_s = 0;      ///< it was in the replica, or in the buffer of the display
};

/// Milliseconds of each stage. Their sum is complete_s - requested_s: each begins when the one before it ends. A stage
/// whose end is 0 was not on the way and took no time.
std::array<double, kStageCount> stages_ms(const wire::Moments& part, const UpdateMoments& update);

}  // namespace telesplat::metrics
