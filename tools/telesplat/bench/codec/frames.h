// The depth images that `telesplat bench codec` measures: recorded ones, and such as it samples itself.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "services/data/data_options.h"

namespace telesplat::launcher {

struct DepthFrame {
  image::DepthImage image;
  double focal_px = 0;  ///< of its camera
  std::optional<geometry::Camera> camera{};  ///< nothing: it is not known where it looked
};

/// Images that are measured as one. Those of files are named alike but for a number: colorado-01.depth,
/// colorado-02.depth; frame-*.depth are called after their run.
struct FrameSet {
  std::string name;
  std::vector<std::string> files;
};

/// What an argument stands for.
struct CodecSubject {
  std::vector<FrameSet> sets;  ///< of recorded images; empty: a scene
  std::string scene;           ///< mesh, Julia set or volume to sample
};

/// argument: a .depth file, a folder with such files in it or in its folder depth, or a scene. Error: a folder without
/// any.
Result<CodecSubject> codec_subject(const std::string& argument);
/// Subjects whose sets have one name become one.
std::vector<FrameSet> joined_sets(const std::vector<CodecSubject>& subjects);

/// fov_deg: of images beside which there is no cameras.csv. Error: names the file, and what is wrong with it.
Result<DepthFrame> read_frame(const std::string& path, double fov_deg);

struct ViewOptions {
  std::string trajectory = "orbit";
  int views = 8;
  std::string size = "1280x800";
  double fov_deg = 90;
  int threads = 0;
};

using ShowProgress = std::function<void(const std::string&)>;

/// Samples views evenly spaced over the trajectory. data.scene: a mesh or a Julia set.
Result<std::vector<DepthFrame>> sample_frames(const data::DataOptions& data, const ViewOptions& options,
                                              const ShowProgress& progress);

/// The tiles of an image as a session cuts it, 256 x 256 pixels or what is left at the right and at the bottom, with 64
/// covered pixels or more.
std::vector<DepthFrame> tiles_of(const DepthFrame& frame);

}  // namespace telesplat::launcher
