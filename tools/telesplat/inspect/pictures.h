// What `telesplat inspect` tells of pictures, recorded frames and sampled depth images, and the depth it writes.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "services/data/description.h"

namespace telesplat::launcher {

/// A picture, with depth and normals where it has some.
struct Picture {
  image::View view;                ///< depth_m: empty: it has none
  std::vector<glm::vec3> normals;  ///< one a pixel, room space, (0, 0, 0) where nothing is; or none
  std::optional<geometry::Camera> camera;
  data::Description description;
};

/// A picture or recorded frame: all that OpenImageIO reads, and .frame files of a spool.
Result<Picture> inspect_picture(const std::string& path);

/// A .depth file of --record-depth. near_m: of the camera that saw it; nothing: it is taken from cameras.csv beside the
/// file. Where that does not tell either, the depths stay codes and `view` empty.
Result<Picture> inspect_depth_image(const std::string& path, std::optional<double> near_m);

/// Writes its depth: .npy (float32 metres, rows from the top), or .exr (Z in metres, R, G, B, and N where it has
/// normals). Infinity where nothing is. Error: another extension, no depth in it, not writable.
Status write_depth(const std::string& path, const Picture& picture, const std::string& name);

/// Writes `values`, rows x columns of them row by row, as little-endian float32 (numpy.load reads it). The file appears
/// whole or not at all. Errors name the path. Source: NEP 1, "A Simple File Format for NumPy Arrays", version 1.0.
Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns);

}  // namespace telesplat::launcher
