// Turns draw lists into keys on the GPU: the records that shaders read, and the passes that splat.
#pragma once

#include <vector>

#include "client/viewer/render/gl/frame_targets.h"
#include "client/viewer/render/gl/point_arena.h"
#include "client/viewer/render/gl/programs.h"
#include "common/image/shading.h"
#include "common/splat/item_figures.h"
#include "common/splat/kernel_traits.h"
#include "common/splat/pixel_key.h"

namespace telesplat::viewer {

/// The view in all shaders (std140, uniform block 0; shaders/common.h).
struct ViewRecord {
  float right[4], down[4], forward[4];
  float focal[2], centre[2], step[2];
  float frame_size[2];
  int32_t size[2];
  float near_m;
  uint32_t near_bits;
  int32_t margin;
  uint32_t background;
  uint32_t unused[2];
  float light[4], light_direction[4];  ///< splat::EwaLight
  float spacing_limits[4];             ///< splat::SpacingLimits
  uint32_t rim_bias[4];                ///< splat::RimBias
};
static_assert(sizeof(ViewRecord) == 176);

/// Values shared by the draws of one cluster (std430).
struct ClusterRecord {
  float row_x[4], row_y[4], row_w[4];  ///< splat::LeafTransform
  float facing[4];                     ///< splat::facing_vector
};

/// Values of one draw (std430).
struct DrawRecord {
  uint32_t word;      ///< start of the points in their arena
  uint32_t count;     ///< number of the points there: the distance between their arrays
  uint32_t cluster;   ///< number of its ClusterRecord
  uint32_t spacing;   ///< class of the samples' distance on the screen
  float size;         ///< square, disc: side or diameter, pixels
  float bias_growth;  ///< splat::splat_bias_growth
  int32_t side;       ///< side of the square of pixels drawn
  int32_t sub_steps;  ///< 2^sub_bits of the splat's shape
  float source[4];    ///< splat::SurfelSource: direction towards the sampling eye in camera axes, radius in metres
};
static_assert(sizeof(DrawRecord) == 48);

/// All functions need a current GL context.
class SplatPasses {
 public:
  SplatPasses();
  ~SplatPasses();
  SplatPasses(const SplatPasses&) = delete;
  SplatPasses& operator=(const SplatPasses&) = delete;

  /// Uploads points that are not there yet, and writes and binds the data that shaders read in this frame: uniform
  /// block 0, storage buffers 1 (draws), 2 (clusters), 3 (intensities).
  void prepare(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel,
               const image::Shading& shading);
  /// Clears and fills targets.keys() or, for a kernel of Passes::kSums, targets.sums().
  void splat(const FrameTargets& targets, const Programs& programs, splat::Kernel kernel);
  /// Call it after the frame's last pass.
  void end_frame() { arenas_.end_frame(); }

 private:
  struct DrawCommand {
    uint32_t count, instances, first, base_instance;
  };
  /// Data written anew every frame, each in a buffer; up to kIntensities in the order of shader bindings.
  enum Stream { kView, kDraws, kClusters, kIntensities, kCommands, kStreams };
  void send(Stream stream, const void* data, size_t bytes);
  splat::RimBias write_draws(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel);
  void write_view(const geometry::Camera& camera, const image::Shading& shading, float scale,
                  const splat::RimBias& rim);
  void number_draws(size_t count);
  void draw_points(const gl::Program& program);
  void splat_keys(const FrameTargets& targets, const gl::Program& program);
  void splat_sums(const FrameTargets& targets, const KernelPrograms& programs);

  PointArenas arenas_;
  uint32_t streams_[kStreams] = {};
  uint32_t vertex_array_ = 0, draw_numbers_ = 0;
  size_t draw_number_count_ = 0;
  splat::ItemRuns runs_;
  std::vector<ClusterRecord> clusters_;
  std::vector<DrawRecord> draws_;
  std::vector<std::vector<DrawCommand>> commands_by_arena_;  // as in kCommands, one arena after the other
};

}  // namespace telesplat::viewer
