// Describes pictures, recorded frames and sampled depth images for `telesplat inspect`, and writes their depth.
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

/// A picture, with depth and normals if it has them.
struct Picture {
  image::View view;                ///< depth_m is empty if it has no depth
  std::vector<glm::vec3> normals;  ///< one a pixel, room space, (0, 0, 0) for background; or empty
  std::optional<geometry::Camera> camera;
  data::Description description;
};

/// Reads a picture or recorded frame: every format of OpenImageIO, and .frame files of a spool.
Result<Picture> inspect_picture(const std::string& path);

/// Reads a .depth file of --record-depth. near_m: near plane of its camera; nothing: cameras.csv beside the file gives
/// it. Without either, the depths stay codes and `view` is empty.
Result<Picture> inspect_depth_image(const std::string& path, std::optional<double> near_m);

/// Writes its depth: .npy (float32 metres, rows from the top), or .exr (Z in metres, R, G, B, and N if it has normals).
/// Background has infinity. Error: another extension, no depth, not writable.
Status write_depth(const std::string& path, const Picture& picture, const std::string& name);

/// Writes `values`, rows x columns, row by row, as little-endian float32 (numpy.load reads it). The file appears whole
/// or not at all. Errors name the path. Source: NEP 1, "A Simple File Format for NumPy Arrays", version 1.0.
Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns);

}  // namespace telesplat::launcher
