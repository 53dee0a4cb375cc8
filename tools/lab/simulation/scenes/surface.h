// Small surfaces that are solved, not stored: a data server serves them as a mesh in chunks, a sampler finds each ray's
// hit by a quadratic equation. A tile of 64 x 48 pixels takes less than 0.3 ms. All is computed with + - * / and sqrt,
// so that every x86-64 machine gives the same bits.
#pragma once

#include <memory>

#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/image/file.h"
#include "common/image/shading.h"
#include "services/data/served.h"
#include "services/sampler/mesh/sampler.h"

namespace telesplat::simulation {

/// All lie within 0.4 m of the room's origin on each axis.
enum class Surface {
  kSpheres,  ///< eight spheres, one behind the other, a chunk each
  kTerrain,  ///< a plain with paraboloids as hills, in six chunks
  kFence,    ///< four rows of slats 1.5 mm wide, two cables 1 mm thick and a wall behind them, in six chunks
};

/// The mesh as the real data server serves it, from memory: the chunks' boxes hold the surface, and each part of it has
/// two triangles, which fill its box. It has the file's own colours alone: arrays cannot be asked for. Asks no file and
/// starts no thread.
std::unique_ptr<data::Served> serve_surface(Surface surface);

/// A sampler of the surface, for MeshTiles in place of the ray sampler. Once it is given a chunk of another surface it
/// samples that one. It refuses chunks that do not validate. A pixel is empty where its ray's first hit belongs to a
/// chunk that is not held, or that has another box than the surface's chunk: nothing behind the hit is shown. It
/// ignores colours of arrays.
std::unique_ptr<sampler::Sampler> sample_surface(Surface surface);

/// Renders all chunks, shaded with unquantised normals: the truth that pictures are compared with. Depth in
/// metres, +infinity where nothing is.
image::View render_surface(Surface surface, const geometry::Camera& camera, const image::Shading& shading,
                           const geometry::Clip& clip = {});

}  // namespace telesplat::simulation
