// Records whole sampled depth images, composed from their tiles, as codec streams that `telesplat inspect` reads.
#pragma once

#include <map>
#include <string>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"

namespace telesplat::packer {

class DepthRecorder {
 public:
  /// Writes frame-NNNNNN.depth files into `directory` (created if missing), at most `max_frames`, and the camera of
  /// each frame into its cameras.csv: without the near plane, codes cannot be converted to metres.
  static Result<DepthRecorder> open(const std::string& directory, int max_frames);

  /// Adds a sampled tile; the frame is written when its last tile has come. Incomplete frames are dropped.
  Status add(FrameId frame, const geometry::Camera& camera, const geometry::Rect& rect, size_t tiles_in_frame,
             const image::DepthImage& tile);

 private:
  struct Frame {
    image::DepthImage image;
    size_t tiles = 0;
  };
  std::string directory_;
  int left_ = 0;
  std::map<FrameId, Frame> open_;
};

}  // namespace telesplat::packer
