// Costs, from what short runs have measured.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/telesplat/tune/model.h"

namespace telesplat::launcher {

/// The line through pairs of values, by least squares of the medians of at most 12 groups of about as many pairs, so
/// that single slow ones count for nothing. Neither part is negative: where one would be, and where all x are the same,
/// the line goes through 0; a constant where all x are 0. No values: all 0. Precondition: as many xs as ys.
Line fit_line(const std::vector<double>& xs, const std::vector<double>& ys);

/// What a run tells of its costs, in its tables (docs/metrics.md). Parallel lists have a value a row.
struct CostSamples {
  int samplers = 1, octree_depth = 5, tile_px = 256;
  double others = 0;  ///< 0..1: share of the cores that others used
  struct {
    std::vector<double> work, samples, kept, bytes_sampled, bytes_sent, sampling_s, encoding_s, packing_s;
  } tiles;  ///< of full resolution; work: rays, of volumes voxels; samples: of volumes pixels
  struct {
    std::vector<double> pixels, seconds, cast, checked, tiles;
  } plans;  ///< of views of which a part was cast; checked: rays that only check what is known
  struct {
    std::vector<double> lease_network_s, patch_network_s, patch_bytes, decode_s, patch_points;
  } stages;
  struct {
    std::vector<double> select_s, draw_s, construction_s, points;
  } frames;
  std::vector<double> scales;                      ///< sampled pixels a displayed pixel on each axis, an update
  std::vector<double> update_work, update_pixels;  ///< of volumes: voxels and pixels, an update
  double updates_per_s = 0;
};

/// Reads a run folder. kind: a volume or not; columns that are missing leave lists empty. Error: there are no tiles, or
/// the summary is not there.
Result<CostSamples> read_costs(const std::string& directory, bool slices);

/// `base` has what is known beforehand: kind, machine, display, link (where `stated`, they count and what was measured
/// of them does not), settings that are not tuned. The first run is that of the defaults. Precondition: there is one.
TuneCosts fit_costs(TuneCosts base, bool stated, const std::vector<CostSamples>& runs);
/// What --sampling-size auto came to; 1: not known.
double adaptive_scale(const CostSamples& run);

/// "cost of a ray: 0.41 us sampling, 0.08 us encoding": a line each, for people.
std::vector<std::string> describe(const TuneCosts& costs);

}  // namespace telesplat::launcher
