// Input of the splatting kernels: one frame of one slab, cut into tiles of the raster. They splat a tile's layers one
// after the other.
//
// Extinction and extinction times colour of a slice are resampled separably. A row of voxels becomes a *line* of
// pixels; pixel rows are mixed from the lines of the voxel rows around them. All work is done in blocks of 8
// pixels. A tile is 64 blocks wide, so that one bit of a 64-bit word says whether a block of a row has anything in it,
// or can still be seen.
#pragma once

#include <cstdint>

#include "services/sampler/volume/shear/rows.h"

namespace telesplat::sampler {

inline constexpr int kSplatBlock = 8;
inline constexpr int kTileBlocks = 64;
inline constexpr int kTileWidth = kSplatBlock * kTileBlocks;
/// Accumulated pixels of a tile fill half the second-level cache of common processors (bench volume_bench).
inline constexpr int kTileHeight = 32;

/// A pixel that lets less light through hides all behind it: half a step of 8-bit output.
inline constexpr float kOpaque = 1.0f / 512;

/// One axis of a slice: pixel x of the raster has its centre at index coordinate origin + x * pitch.
struct SliceAxis {
  double origin = 0, pitch = 1;
  int begin = 0, end = 0;  ///< pixels that the slab owns
  /// Voxels that are held, or are known to be empty; kernels wider than a voxel are cut off at their ends.
  double lattice_lo = -1e9, lattice_hi = 1e9;
};

/// A slice, or a plane half way between two: the mean of both, the field being linear there.
struct SplatSlice {
  int held[2] = {-1, -1};    ///< slices in ShearRows; -1: no slice
  float weight = 1;          ///< weight of the voxels of each
  ShearRows::Bounds bounds;  ///< bounds of the voxels of both
  SliceAxis u, v;
};

struct SplatScene {
  const ShearRows* rows = nullptr;
  int size_u = 0;                        ///< voxels in a row of the grid
  const SplatSlice* slices = nullptr;    ///< slices of all layers, front to back
  const float* colours = nullptr;        ///< r, g, b times extinction, and extinction of every level; 16-byte aligned
  const uint8_t* light = nullptr;        ///< intensity by normal, in 1/255
  const float* light_factors = nullptr;  ///< (i, i, i, 1) of every intensity i; 16-byte aligned
  /// For each raster row and block: path from a plane to the next, as the coefficients of 1, n and n^2 for its pixel n.
  const float* paths = nullptr;
  /// If a clip cuts rows: first and last index u that is kept of each held row; first > last: the row is cut away;
  /// null: all is kept.
  const KeptCells* kept = nullptr;
  int blocks_across = 0;  ///< blocks across the raster, rounded up
  int width = 0, height = 0;
};

/// A layer in a tile.
struct SplatTile {
  int x0 = 0, y0 = 0, rows = 0;  ///< raster pixels; rows <= kTileHeight
  int slice_begin = 0, slice_end = 0;
  /// A byte for each block of the raster, `blocks_across` a row: 255 if nearer layers hide it.
  const uint8_t* hidden = nullptr;
  float* remaining = nullptr;  ///< light that comes through the layers so far: raster rows of 8 * blocks_across
  uint64_t* begun = nullptr;  ///< for each row of the tile, bits: blocks of `remaining` that have a value; others are 1
  uint8_t* opaque = nullptr;  ///< as hidden; bits of pixels that this layer made opaque are added
  /// Pixels of the image, 0xAARRGGBB premultiplied; raster pixel (image_x, image_y) is the first. Blocks outside are
  /// empty.
  uint32_t* image = nullptr;
  int image_x = 0, image_y = 0, image_width = 0, image_height = 0;
};

struct SplatOutcome {
  uint64_t voxels = 0;
  uint64_t pixels = 0;                                       ///< pixels of slices composited
  int x_lo = 1 << 30, x_hi = -1, y_lo = 1 << 30, y_hi = -1;  ///< raster pixels that are not transparent, inclusive
};

/// Splats the layer, composites its slices and writes the pixels. Several threads may call it, for a tile each.
void splat_tile(const SplatScene& scene, const SplatTile& tile, SplatOutcome& outcome);

}  // namespace telesplat::sampler
