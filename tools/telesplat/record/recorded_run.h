// A run folder as `telesplat run` left it: what is needed to make its displayed frames again.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/viewer/display/eyes/eye_rig.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/display/wall.h"
#include "client/viewer/input/look.h"
#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/image/shading.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// A row of frames.csv.
struct DisplayedFrame {
  uint64_t number = 0;
  double t_s = 0;
  double shown_s = 0;    ///< when it was finished and displayed, on the clock of t_s
  Sequence sequence;     ///< newest event of the model that was displayed; of volumes its slice images' frame
  uint32_t replica = 0;  ///< how many times numbers had begun again by then (another packer)
  uint64_t points_drawn = 0;
  geometry::Camera camera;                ///< with two eyes: the head's, of the size of one eye's picture
  geometry::Pose head;                    ///< that it was drawn for; of a screen of a described wall not the camera's
  double screen_m = 0;                    ///< with two eyes: how far the screen was before the head,
  std::array<glm::dvec3, 2> eyes_room{};  ///< and where they were
  double detail = 1;                      ///< SelectionOptions::detail it was drawn with
  viewer::Look look;                      ///< how it was drawn; a person may have changed it in the window
  uint64_t summaries = ~uint64_t{0};      ///< of bricks, that its viewer had made by then; else all that there are
  EpochId epoch;                          ///< of all points in it
  double refined = 0;                     ///< share of its pixels that were drawn with sub-pixels,
  int sub_pixels = 1;                     ///< so many on each axis
};

struct RecordedRun {
  std::string directory;         ///< where its viewer recorded; of a wall's further tiles a folder in the run's
  std::unique_ptr<Scene> scene;  ///< its data need not be there
  int width = 0, height = 0;     ///< of the display
  double fov_deg = 0, near_m = 0;
  std::string sampling_size, renderer, kernel;  ///< as they were, for captions
  image::ShadingParameters shading;
  bool legend = true;            ///< pictures told what colours mean, where there was something to tell
  bool transparent = false;      ///< pictures have alpha: nothing lies behind the data
  viewer::Look look;             ///< as the run began
  float splat_scale = 0;         ///< of splat sizes, whatever the kernel; 0: what suits it
  viewer::WallTile wall;         ///< which part of a wall the display was
  viewer::StereoOptions stereo;  ///< how two eyes' pictures were shown
  bool keeps_redundant = false;  ///< packed with --packing.redundancy keep
  int octree_depth = 6;
  std::vector<DisplayedFrame> frames;  ///< of the run's own viewer, in order

  /// Scale factor of splat sizes that frames of this kernel were drawn with.
  float splat_scale_of(splat::Kernel k) const { return splat_scale > 0 ? splat_scale : splat::suitable_scale(k); }
  /// What a display of the run's field of view, or a screen of its wall, and width x height pixels showed this head;
  /// with two eyes, what the head's camera between them would.
  geometry::Camera camera_at(const geometry::Pose& pose, int width_px, int height_px) const;
};

/// Reads session.toml, frames.csv and, of a Julia set, epochs.csv. Errors name file, line, value and limit.
Result<RecordedRun> read_recorded_run(const std::string& directory);
/// The same of a run on a display wall, of each tile in its order; of other runs of the one display. Error: a tile is
/// missing too.
Result<std::vector<RecordedRun>> read_recorded_displays(const std::string& directory);

/// The frames of these numbers, in order of display; or, if there are none, `count` of them evenly spaced over the
/// frames that show the data set: those that drew at least a tenth of what any frame drew. Error: a number is no
/// frame's, or no frame shows anything.
Result<std::vector<DisplayedFrame>> choose_frames(const RecordedRun& run, int count,
                                                  const std::vector<uint64_t>& numbers);

}  // namespace telesplat::launcher
