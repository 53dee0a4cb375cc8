// The warp (T4.5.1, last stage; T4.5.2, second part): slice images -> the current view.
#pragma once

#include <memory>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/volume/shear.h"
#include "common/volume/warp/layer_image.h"

namespace telesplat::volume {

/// A complete frame in a viewer. Immutable once made (make_volume_frame), so that it may be drawn while the next one is
/// decoded.
struct VolumeFrame {
  Grid grid;
  ShearFrame shear;
  std::vector<LayerImage> layers;  ///< result of merge_layers: at most one image a layer, in order
  FrameId frame;
  EpochId epoch;
  uint64_t bytes = 0;  ///< as received

  /// Number of raster pixels held.
  uint64_t pixels() const;
};

/// images: all slabs' of one frame, in any order. Does all work that warping needs once a frame: costs about a copy of
/// the images.
VolumeFrame make_volume_frame(const Grid& grid, const ShearFrame& shear, std::span<const SliceImage> images,
                              FrameId frame, EpochId epoch, uint64_t bytes);

/// Orders the layers of a frame by the distance of their planes from an eye (index coordinates, at any place) along the
/// principal axis, nearest first. (Seen from between two planes, neither hides the other: no ray meets both.) Returns
/// indices into frame.layers, without a layer whose plane holds the eye.
std::vector<int> front_to_back(const VolumeFrame& frame, const glm::dvec3& eye_index);

/// Host memory to draw into: rows of width pixels, 0xAARRGGBB (see render()); depth may be null.
struct WarpTarget {
  int width = 0, height = 0;
  uint32_t* colour = nullptr;
  /// Distance along -z, metres, of the plane at which opacity, summed from the front, reaches kSolid; +infinity if it
  /// never does.
  float* depth_m = nullptr;
};
inline constexpr float kSolid = 0.25f;

struct WarpStats {
  double prepare_ms = 0;   ///< ordering, matrices
  double warp_ms = 0;      ///< wall-clock time in total
  double warp_cpu_ms = 0;  ///< summed over threads
  uint64_t images = 0;     ///< layers that were used
  uint64_t samples = 0;    ///< bilinear look-ups
};

/// Draws on the CPU: display tiles in parallel, layers front to back, bilinear look-ups (SIMD, every target gives the
/// same pixels), skipping empty tiles and blocks, stopping early at opaque pixels. A pixel depends only on its ray, not
/// on threads, tiles or the image's borders: a view of geometry::crop(camera, rect) has the whole view's pixels.
///
/// A pixel's colour, all channels premultiplied: C = sum over layers of c_i T_i + background T, T_i = product of 1 -
/// a_j over the layers in front, in 1/128ths of 8-bit steps (kernels.cpp has each rounding). T below 0.5 / 255 counts
/// as 0.
class Warper {
 public:
  explicit Warper(int threads);  ///< 0: one a core
  ~Warper();
  /// background: 0x00RRGGBB, under everything. The upper byte of a colour becomes the volume's coverage of the pixel.
  /// frame may be null: draws the background alone. Preconditions: camera valid, target as large as it states; frame
  /// valid (volume::validate).
  WarpStats render(const VolumeFrame* frame, const geometry::Camera& camera, uint32_t background,
                   const WarpTarget& target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::volume
