// The warp (T4.5.1, last stage; T4.5.2, second part): slice images -> the view of now.
#pragma once

#include <memory>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/volume/shear.h"
#include "common/volume/slice_image.h"

namespace telesplat::volume {

/// A complete frame as a viewer holds it. Immutable once made, so that it may be drawn while the next one is decoded.
struct VolumeFrame {
  Grid grid;
  ShearFrame shear;
  std::vector<SliceImage> images;
  FrameId frame;
  EpochId epoch;
  uint64_t bytes = 0;  ///< as received
};

/// The order in which the images of a frame lie behind each other for an eye (index coordinates), nearest first: by the distance of their planes along
/// the principal axis; on the same plane by the distance of their slabs from the eye along k. Indices into frame.images; those whose plane is
/// not in front of the eye are left out.
std::vector<int> front_to_back(const VolumeFrame& frame, const glm::dvec3& eye_index);

/// Host memory to draw into: rows of width pixels, 0x00RRGGBB; depth may be null.
struct WarpTarget {
  int width = 0, height = 0;
  uint32_t* colour = nullptr;
  /// Distance along -z, metres, of the plane where opacity, counted from the front, passes kSolid; +infinity where it never does.
  float* depth_m = nullptr;
};
inline constexpr float kSolid = 0.25f;

struct WarpStats {
  double prepare_ms = 0;   ///< ordering, matrices, binning
  double warp_ms = 0;      ///< wall time
  double warp_cpu_ms = 0;  ///< summed over threads
  uint64_t images = 0;     ///< drawn
  uint64_t samples = 0;    ///< bilinear look-ups
};

/// Draws on the CPU: display tiles in parallel, images front to back, bilinear look-ups (SIMD, every target the same pixels), tiles and blocks without
/// anything skipped, early termination where opaque. Pixels do not depend on threads or tiles.
class Warper {
 public:
  explicit Warper(int threads);  ///< 0: one a core
  ~Warper();
  /// background: 0x00RRGGBB, under everything. frame may be null: background alone.
  WarpStats render(const VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                   const WarpTarget& target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::volume
