// The stages of a view update, from its request to the display, and the time of each (docs/metrics.md, stages.csv; the
// latencies of T6.2 broken down).
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "common/metrics/columns.h"
#include "common/wire/moments.h"

namespace telesplat::metrics {

inline constexpr size_t kStageCount = 17;
/// Milliseconds of each stage, in order.
using StagesMs = std::array<double, kStageCount>;

/// Names that end in "network_ms" are time on the network, in "queue_ms" waiting for a busy process; the rest is work.
inline constexpr Column<StagesMs> kStageColumns[] = {
    {"request_network_ms", [](const StagesMs& s) { return s[0]; }},
    {"view_queue_ms", [](const StagesMs& s) { return s[1]; }},
    {"plan_ms", [](const StagesMs& s) { return s[2]; }},
    {"lease_queue_ms", [](const StagesMs& s) { return s[3]; }},
    {"lease_network_ms", [](const StagesMs& s) { return s[4]; }},
    {"sampler_queue_ms", [](const StagesMs& s) { return s[5]; }},
    {"fetch_ms", [](const StagesMs& s) { return s[6]; }},
    {"sampling_ms", [](const StagesMs& s) { return s[7]; }},
    {"encoding_ms", [](const StagesMs& s) { return s[8]; }},
    {"tile_network_ms", [](const StagesMs& s) { return s[9]; }},
    {"packer_queue_ms", [](const StagesMs& s) { return s[10]; }},
    {"packing_ms", [](const StagesMs& s) { return s[11]; }},
    {"publishing_ms", [](const StagesMs& s) { return s[12]; }},
    {"patch_network_ms", [](const StagesMs& s) { return s[13]; }},
    {"viewer_queue_ms", [](const StagesMs& s) { return s[14]; }},
    {"decoding_ms", [](const StagesMs& s) { return s[15]; }},
    {"insertion_ms", [](const StagesMs& s) { return s[16]; }},
};
static_assert(std::size(kStageColumns) == kStageCount);

/// The viewer's moments, beside those of the part that completed an update; seconds of the master's clock.
struct UpdateMoments {
  double requested_s = 0;     ///< the viewer asked for the update
  double arrived_s = 0;       ///< the part reached the viewer's machine
  double decode_begin_s = 0;  ///< it was taken from the viewer's queue
  double decoded_s = 0;
  double complete_s = 0;  ///< it was in the replica, or in the buffer of the display
};

/// Each stage begins when the one before ends, so their sum is complete_s - requested_s. A stage whose end is 0 was not
/// on the way and took no time.
StagesMs stages_ms(const wire::Moments& part, const UpdateMoments& update);

/// Sum of the stages whose names have this ending: "queue_ms", "network_ms".
double sum_ms(const StagesMs& stages, std::string_view ending);

}  // namespace telesplat::metrics
