// The interface of all mesh samplers: chunks in, depth images of tiles out. No sockets, no clocks.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/geometry/mesh_chunk.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"
#include "common/image/pixel_mask.h"
#include "common/image/shading.h"
#include "common/scene/colouring.h"

namespace telesplat::sampler {

class Sampler {
 public:
  virtual ~Sampler() = default;

  /// "ray" or "raster".
  virtual const char* name() const = 0;

  /// Decodes a coded chunk (geometry/chunk_code.h) and builds its BVH or GL buffers. Replaces a chunk of the same id.
  /// Refuses bytes that are not valid; then nothing changes.
  virtual Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) = 0;
  /// Adds several chunks at once, in parallel where that helps; refuses bad ones as add_chunk does, and keeps the good
  /// ones.
  virtual Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) = 0;
  virtual void remove_chunk(ChunkId id) = 0;
  /// Returns the costly part of add_chunk(), which may run on any thread while tiles are sampled, and returns the rest,
  /// for the sampler's thread. Null: this kind of sampler has no such part.
  using Add = std::function<void()>;
  virtual std::function<Result<Add>()> preparing(ChunkId id, geometry::ChunkBytes chunk) {
    (void)id, (void)chunk;
    return nullptr;
  }
  /// Samples these chunks alone from now on; unknown ones are ignored. Until the first call all chunks are sampled; one
  /// that is added later is sampled until the next call.
  virtual void show(const std::vector<ChunkId>& chunks) = 0;

  /// Sets the colours of chunks that hold scalars, from now on; null: neutral. Other chunks keep their colours.
  virtual void set_colours(std::shared_ptr<const scene::ColourTable> colours) = 0;

  /// Sets the clip from now on: rays begin and end at its planes, so that the surface behind a cut is sampled.
  virtual void set_clip(const geometry::Clip& clip) = 0;

  /// Samples the pixels `tile` of the frame `camera` at their centres. Colours are unlit albedo interpolated over the
  /// triangle, or looked up for scalars that are interpolated over it; normals are interpolated, in room space, flipped
  /// to the side on which the camera sees the triangle, and turned to the eye (hit_packet.h). Returns a canonical
  /// image of tile.width x tile.height.
  /// mask, of the tile's size: only its pixels are sampled, with the same result as without a mask (if two triangles
  /// are equally near, the other one may be seen); the others are empty. null: all pixels are sampled. Precondition:
  /// tile lies in the camera's image.
  virtual image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                                   const image::PixelMask* mask = nullptr) = 0;
};

/// Returns the colours of scalars before set_colours(): all the same grey.
std::shared_ptr<const scene::ColourTable> neutral_colours();

/// Embree 3 ray packets on `threads` oneTBB threads (0 = all cores).
std::unique_ptr<Sampler> make_ray_sampler(int threads);
/// EGL off-screen G-buffer. Error: no OpenGL 4.3 context can be made; says what was tried.
Result<std::unique_ptr<Sampler>> make_raster_sampler();
/// kind: "ray", "raster", or "auto": raster if OpenGL runs on a GPU, else ray.
Result<std::unique_ptr<Sampler>> make_sampler(const std::string& kind, int threads);

/// Direct rendering for verification: every pixel of `camera` traced from the data, shaded with unquantised normals.
/// Uses the chunks of a ray sampler. Depth in metres.
image::View render_directly(Sampler& ray_sampler, const geometry::Camera& camera, const image::Shading& shading);

}  // namespace telesplat::sampler
