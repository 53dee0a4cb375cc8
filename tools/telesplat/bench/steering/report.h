// What `telesplat bench steering` found, as a table for people and as CSV for plots.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"

namespace telesplat::launcher {

/// What one view cost, with the extra frames that followed it.
struct ViewCost {
  double t_s = 0;  ///< of the walk: when its work began
  double requested_s = 0, complete_s = 0;
  FrameId frame;
  bool still = false;  ///< the head stands still
  bool full = false;   ///< nothing was planned: all pixels were sampled
  uint64_t rays_full = 0, rays = 0, extra_rays = 0, extra_frames = 0;
  uint64_t tiles = 0;
  uint64_t bytes = 0;                              ///< encoded depth images, sampler to packer
  uint64_t mask_bytes = 0;                         ///< masks, packer to samplers
  uint64_t samples = 0, kept = 0, sent_bytes = 0;  ///< hits, and what went on to viewers
  double plan_ms = 0;                              ///< of the view itself, wall-clock
  double extra_plan_ms = 0;                        ///< of its extra frames
  double extra_sample_cpu_ms = 0;                  ///< of its extra frames, with encoding
  double sample_cpu_ms = 0, encode_cpu_ms = 0, pack_cpu_ms = 0, insert_cpu_ms = 0;
  double settle_cpu_ms = 0;  ///< of the packer, when the view is complete: what it learns of empty space
  uint64_t points = 0;       ///< of the model, afterwards
  uint64_t needed = 0, missed = 0,
           vain = 0;                      ///< of --audit: pixels that lack a point; those not cast; cast for nothing
  std::map<std::string, double> figures;  ///< sums over the view's plan and those of its extra frames
  void add_extra(const ViewCost& extra);
};

/// How good one displayed view is.
struct ViewQuality {
  double t_s = 0;                                     ///< of the walk
  double still_s = -1;                                ///< since the head stands still; below 0: it moves
  double psnr1_db = 0, holes1 = 0;                    ///< against one ray a pixel
  double psnr_db = 0, holes = 0, ssim = 0, flip = 0;  ///< against SteeringBenchOptions::reference_samples
};

struct ModeReport {
  std::string scene, mode;
  std::vector<ViewCost> views;
  std::vector<ViewQuality> quality;
};

/// A table of the moving part and one of the still part. Shares are of the scene's first mode.
std::string to_markdown(const std::vector<ModeReport>& reports);
/// steering-views.csv, steering-quality.csv (docs/steering.md) and the tables as steering-table.txt in `directory`.
Status write_report(const std::vector<ModeReport>& reports, const std::string& directory);

}  // namespace telesplat::launcher
