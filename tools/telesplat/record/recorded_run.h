// A run folder as `telesplat run` left it: the facts that its displayed frames can be made again from.
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
  double shown_s = 0;    ///< when it was displayed, on the clock of t_s
  Sequence sequence;     ///< newest event of the displayed model; for volumes the slice images' frame
  uint32_t replica = 0;  ///< counts packers: a new one numbers events from the beginning
  uint64_t points_drawn = 0;
  geometry::Camera camera;                ///< with two eyes: the head's, of the size of one eye's picture
  geometry::Pose head;                    ///< that it was drawn for; on a screen of a described wall not the camera's
  double screen_m = 0;                    ///< with two eyes: distance from the head to the screen,
  std::array<glm::dvec3, 2> eyes_room{};  ///< and the eyes' places
  double detail = 1;                      ///< SelectionOptions::detail it was drawn with
  viewer::Look look;                      ///< how it was drawn; a person may have changed it in the window
  uint64_t summaries = ~uint64_t{0};      ///< summaries of bricks that its viewer had made; by default all
  EpochId epoch;                          ///< epoch of all its points
  double refined = 0;                     ///< share of its pixels that were drawn with sub-pixels
  int sub_pixels = 1;                     ///< per axis
};

struct RecordedRun {
  std::string directory;         ///< the viewer's record; for a wall's further tiles a folder in the run's
  std::unique_ptr<Scene> scene;  ///< its data may be missing
  int width = 0, height = 0;     ///< pixels of the display
  double fov_deg = 0, near_m = 0;
  std::string sampling_size, renderer, kernel;  ///< as recorded, for captions
  image::ShadingParameters shading;
  bool legend = true;            ///< pictures had a legend of colours, if any
  bool transparent = false;      ///< pictures have alpha: nothing lies behind the data
  viewer::Look look;             ///< as the run began
  float splat_scale = 0;         ///< scale of splat sizes for all kernels; 0: the scale that suits the kernel
  viewer::WallTile wall;         ///< the display's part of a wall
  viewer::StereoOptions stereo;  ///< how two eyes' pictures were shown
  bool keeps_redundant = false;  ///< packed with --packing.redundancy keep
  int octree_depth = 6;
  std::vector<DisplayedFrame> frames;  ///< frames of the run's own viewer, in order

  /// Returns the scale of splat sizes for frames of this kernel.
  float splat_scale_of(splat::Kernel k) const { return splat_scale > 0 ? splat_scale : splat::suitable_scale(k); }
  /// Returns the camera of this head for a display with the run's field of view, or a screen of its wall, of width x
  /// height pixels; with two eyes, the head's camera between them.
  geometry::Camera camera_at(const geometry::Pose& pose, int width_px, int height_px) const;
};

/// Reads session.toml, frames.csv and, of a Julia set, epochs.csv. Errors name file, line, value and limit.
Result<RecordedRun> read_recorded_run(const std::string& directory);
/// Reads each tile of a run on a display wall, in order; for other runs the one display. Error: as read_recorded_run(),
/// or a tile is missing.
Result<std::vector<RecordedRun>> read_recorded_displays(const std::string& directory);

/// Returns the frames of these numbers, in order of display. Without numbers, returns `count` frames evenly spaced over
/// those that show the data set: they drew at least a tenth of the most that a frame drew. Error: no frame has such a
/// number, or no frame shows anything.
Result<std::vector<DisplayedFrame>> choose_frames(const RecordedRun& run, int count,
                                                  const std::vector<uint64_t>& numbers);

}  // namespace telesplat::launcher
