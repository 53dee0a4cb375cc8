#include "common/metrics/tables/viewer_tables.h"

#include "common/metrics/stages.h"

namespace telesplat::metrics {
namespace {

using Names = std::vector<std::string>;

const Names kFrames{"frame",
                    "t_s",
                    "inter_frame_ms",
                    "construction_ms",
                    "select_ms",
                    "render_ms",
                    "project_cpu_ms",
                    "resolve_cpu_ms",
                    "fill_cpu_ms",
                    "smooth_cpu_ms",
                    "antialias_cpu_ms",
                    "points_selected",
                    "points_drawn",
                    "items",
                    "points_cached",
                    "sequence",
                    "update_age_ms",
                    "view_error_m",
                    "view_error_deg",
                    "px",
                    "py",
                    "pz",
                    "qw",
                    "qx",
                    "qy",
                    "qz",
                    "present_ms",
                    "detail",
                    "budget_ms",
                    "epoch",
                    "wait_ms",
                    "request",
                    "buffers_filled",
                    "summaries",
                    "splat",
                    "finish",
                    "lit",
                    "begin_s",
                    "refined",
                    "refine_ms",
                    "sub_pixels",
                    "coupling",
                    "buffers",
                    "head_light",
                    "background",
                    "wall_frame",
                    "swap_wait_ms",
                    "swap_skew_ms",
                    "stereo",
                    "screen_m",
                    "left_x",
                    "left_y",
                    "left_z",
                    "right_x",
                    "right_y",
                    "right_z",
                    "lead_ms",
                    "missed",
                    "motion_to_photon_ms",
                    "predicted_ms",
                    "refresh_ms",
                    "still",
                    "halved"};

const Names kUpdates{"request",        "frame",           "requested_s", "first_s",      "complete_s",  "latency_ms",
                     "start_up_ms",    "tiles",           "samples",     "points",       "bytes",       "eliminated",
                     "sampling_width", "sampling_height", "epoch",       "extra_points", "extra_bytes", "left_out"};

// The stages themselves come between.
const Names kBeforeStages{"request", "frame", "tile", "requested_s", "complete_s"},
    kAfterStages{"latency_ms", "patches", "display_ms"};

Names stage_names() {
  Names out = kBeforeStages;
  for (const auto& stage : kStageColumns) out.push_back(stage.name);
  out.insert(out.end(), kAfterStages.begin(), kAfterStages.end());
  return out;
}

}  // namespace

const Names& viewer_columns(std::string_view table) {
  static const Names none, stages = stage_names();
  if (table == "frames") return kFrames;
  if (table == "updates") return kUpdates;
  return table == "stages" ? stages : none;
}

}  // namespace telesplat::metrics
