// A run folder as `telesplat run` left it: what is needed to make its displayed frames again.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/image/shading.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// A row of frames.csv.
struct DisplayedFrame {
  uint64_t number = 0;
  double t_s = 0;
  Sequence sequence;     ///< newest event of the model that was displayed
  uint32_t replica = 0;  ///< how many times numbers had begun again by then (another packer)
  uint64_t points_drawn = 0;
  geometry::Camera camera;
  double detail = 1;  ///< SelectionOptions::detail it was drawn with
  EpochId epoch;      ///< of all points in it
};

struct RecordedRun {
  std::string directory;
  std::unique_ptr<Scene> scene;  ///< its data need not be there
  int width = 0, height = 0;     ///< of the display
  double fov_deg = 0, near_m = 0;
  std::string sampling_size, renderer, kernel;  ///< as they were, for captions
  image::ShadingParameters shading;
  bool keeps_redundant = false;  ///< packed with --packing.redundancy keep
  int octree_depth = 6;
  std::vector<DisplayedFrame> frames;  ///< of the run's own viewer, in order
};

/// Reads session.toml, frames.csv and, of a Julia set, epochs.csv. Errors name file, line, value and limit.
Result<RecordedRun> read_recorded_run(const std::string& directory);

/// The frames of these numbers, in order of display; or, if there are none, `count` of them evenly spaced over the
/// frames that show the data set: those that drew at least a tenth of what any frame drew. Error: a number is no
/// frame's, or no frame shows anything.
Result<std::vector<DisplayedFrame>> choose_frames(const RecordedRun& run, int count,
                                                  const std::vector<uint64_t>& numbers);

}  // namespace telesplat::launcher
