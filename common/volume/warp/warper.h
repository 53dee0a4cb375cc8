// The warp (T4.5.1, last stage; T4.5.2, second part): slice images -> the view of now.
#pragma once

#include <memory>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/volume/shear.h"
#include "common/volume/warp/layer_image.h"

namespace telesplat::volume {

/// A complete frame as a viewer holds it. Immutable once made (make_volume_frame), so that it may be drawn while the
/// next one is decoded.
struct VolumeFrame {
  Grid grid;
  ShearFrame shear;
  std::vector<LayerImage> layers;  ///< merge_layers of what was received: at most one a layer, in their order
  FrameId frame;
  EpochId epoch;
  uint64_t bytes = 0;  ///< as received

  /// Raster pixels held.
  uint64_t pixels() const;
};

/// images: all slabs' of one frame, in any order. Does all that warping needs done once a frame: costs about a copy of
/// the images.
VolumeFrame make_volume_frame(const Grid& grid, const ShearFrame& shear, std::span<const SliceImage> images,
                              FrameId frame, EpochId epoch, uint64_t bytes);

/// The order in which the layers of a frame lie behind each other for an eye (index coordinates), wherever it is,
/// nearest first: by the distance of their planes along the principal axis. (Seen from between two planes none lies
/// behind the other: no ray meets both.) Indices into frame.layers; one whose plane holds the eye is left out.
std::vector<int> front_to_back(const VolumeFrame& frame, const glm::dvec3& eye_index);

/// Host memory to draw into: rows of width pixels, 0xffRRGGBB; depth may be null.
struct WarpTarget {
  int width = 0, height = 0;
  uint32_t* colour = nullptr;
  /// Distance along -z, metres, of the plane where opacity, counted from the front, reaches kSolid; +infinity where it
  /// never does.
  float* depth_m = nullptr;
};
inline constexpr float kSolid = 0.25f;

struct WarpStats {
  double prepare_ms = 0;   ///< ordering, matrices
  double warp_ms = 0;      ///< wall time, all of it
  double warp_cpu_ms = 0;  ///< summed over threads
  uint64_t images = 0;     ///< layers that were looked at
  uint64_t samples = 0;    ///< bilinear look-ups
};

/// Draws on the CPU: display tiles in parallel, layers front to back, bilinear look-ups (SIMD, every target the same
/// pixels), tiles and blocks without anything skipped, early termination where opaque. A pixel depends on its ray
/// alone, not on threads, tiles or the image's borders: a view of geometry::crop(camera, rect) has the whole view's
/// pixels.
///
/// A pixel's colour, all channels premultiplied: C = sum over layers of c_i T_i + background T, T_i = product of 1 -
/// a_j over the layers in front, in 1/128ths of 8-bit steps (kernels.cpp has each rounding). Where T falls below 0.5 /
/// 255 it is taken for 0.
class Warper {
 public:
  explicit Warper(int threads);  ///< 0: one a core
  ~Warper();
  /// background: 0x00RRGGBB, under everything. The upper byte of a colour becomes how much of the pixel the volume
  /// covers. frame may be null: background alone.
  /// Preconditions: camera valid, target as large as it says; frame valid (volume::validate).
  WarpStats render(const VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                   const WarpTarget& target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::volume
