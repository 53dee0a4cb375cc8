// Keeps whole sampled depth images on disk: composed from their tiles, as codec streams that `telesplat inspect` reads.
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
  /// Writes into `directory` (made if need be) as frame-NNNNNN.depth, at most `max_frames` of them, and into its
  /// cameras.csv where each was seen from: without the near plane, codes are not metres.
  static Result<DepthRecorder> open(const std::string& directory, int max_frames);

  /// Adds a tile as sampled; the frame is written when its last tile is here. Frames never completed are dropped.
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
