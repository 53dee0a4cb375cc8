// Samples a quaternion Julia set: rays of a camera in, depth images out (T4.2.2). No sockets, no clocks.
#pragma once

#include <tbb/task_arena.h>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>

#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"
#include "common/image/pixel_mask.h"
#include "common/image/shading.h"
#include "services/sampler/julia/scene.h"
#include "services/sampler/julia/trace.h"

namespace telesplat::sampler {

class JuliaSampler {
 public:
  /// threads: number of oneTBB threads that trace, 0 = all cores. trace: for tests and benchmarks.
  explicit JuliaSampler(int threads, JuliaTrace trace = julia_trace);

  /// Samples the pixels `rect` of the frame `camera` at their centres: the first point of a ray, inside the box and
  /// beyond the near plane, whose distance estimate is lod footprints or less. footprint_px: size of a footprint in
  /// pixels of this camera, above 0. It is that of the view that the samples are for, so that all samples belong to one
  /// surface: 1/4 for a camera that takes every fourth pixel of every fourth row, 4 for one that has 4 x 4 rays for
  /// each of the view's pixels. Colours are unlit albedo, darkened by occlusion and shadow; normals face the camera.
  /// mask, of the rectangle's size: only its pixels are sampled, the others are empty; null: all. Returns a canonical
  /// image of rect.width x rect.height. A pixel does not depend on the rectangle and mask of the call. Precondition:
  /// rect lies in the camera's image. Any number of threads may call it.
  image::DepthImage sample(const JuliaScene& scene, const geometry::Camera& camera, const geometry::Rect& rect,
                           double footprint_px, const image::PixelMask* mask = nullptr);

 private:
  tbb::task_arena arena_;
  JuliaTrace trace_;
};

/// Direct rendering for verification: every pixel of `camera` traced, shaded with unquantised normals. Depth in metres,
/// +infinity where no surface is. threads: 0 = all cores. footprint_px: as in JuliaSampler::sample().
image::View render_julia_directly(const JuliaScene& scene, const geometry::Camera& camera,
                                  const image::Shading& shading, int threads, double footprint_px = 1);

// Periodic palettes for Julia sets, in the order of julia::palette_names().

class JuliaPalette {
 public:
  static constexpr int kEntries = 1024;

  /// A closed Catmull-Rom curve through `stops` (0x00RRGGBB, at least 3), evenly spaced in [0, 1), clamped to the
  /// cube of colours.
  template <size_t kStops>
  explicit JuliaPalette(const uint32_t (&stops)[kStops]) : JuliaPalette(stops, kStops) {}

  /// Returns a colour, 0..255 per channel. tone: its whole part is ignored; tones that are not finite count as 0.
  const glm::vec3& at(float tone) const;
  /// Returns at(tone) * light, rounded: 0x00RRGGBB. light: 0..1.
  uint32_t rounded(float tone, float light) const {
    const glm::vec3 c = at(tone) * light + 0.5f;
    return static_cast<uint32_t>(c.x) << 16 | static_cast<uint32_t>(c.y) << 8 | static_cast<uint32_t>(c.z);
  }

 private:
  JuliaPalette(const uint32_t* stops, size_t count);
  glm::vec3 entries_[kEntries];
};

/// Precondition: index is one into julia::palette_names().
const JuliaPalette& julia_palette(int index);
/// Number of palettes; there must be the same number of names.
int julia_palette_count();

}  // namespace telesplat::sampler
