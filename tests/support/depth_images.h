// Procedural depth images for tests and benchmarks: the same bytes from the same arguments, no files needed.
#pragma once

#include <cstdint>

#include "common/image/depth_image.h"

namespace telesplat::test {

/// The view of a camera half a metre above a procedural terrain with spheres on it, ray-marched.
struct TerrainView {
  int width = 1280, height = 800;
  uint32_t seed = 1;
  bool rough = false;            ///< detail finer than a pixel, as in a mesh with several triangles per pixel
  bool constant_albedo = false;  ///< else tinted by height with patches, as interpolated vertex colours are
  bool covers_all = true;        ///< else the terrain ends 0.3 m from its centre, and the rest of the image is empty
};
image::DepthImage render(const TerrainView& view);

/// A plane in reciprocal depth with a constant normal and colour gradients.
image::DepthImage plane(int width, int height, double slope_x, double slope_y);
/// A surface of triangles a few pixels wide, two to a square of five pixels, with normals interpolated between their
/// corners. One colour.
image::DepthImage facets(int width, int height, uint32_t seed, int spread = 100);
/// Every covered pixel has random bits.
image::DepthImage random_pixels(int width, int height, double density, uint32_t seed);

/// Removes pixels at random until about `density` of them are left.
void keep_random(image::DepthImage& image, double density, uint32_t seed);
/// Keeps pixels whose depth code is off the line between two opposite neighbours by 1 % or more: outlines, as
/// redundancy elimination leaves them when the camera moves a little.
void keep_outlines(image::DepthImage& image);

/// Cuts out the rectangle at (x, y), which must lie in the image.
image::DepthImage crop(const image::DepthImage& image, int x, int y, int width, int height);

/// True if depth is 0 exactly where colour and normal must be 0, values are in range, planes have the right size.
bool is_canonical(const image::DepthImage& image);

}  // namespace telesplat::test
