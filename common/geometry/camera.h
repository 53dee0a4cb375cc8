// The pinhole camera that makes and shows every image: position, orientation, off-axis frustum, pixel grid.
#pragma once

#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "common/core/result.h"
#include "common/geometry/box.h"

namespace telesplat::geometry {

/// Largest width or height of any image in pixels.
inline constexpr int kMaxImageSide = 16384;

/// A head pose in room space (metres, right-handed). The camera looks along its own -z, y is up.
struct Pose {
  glm::dvec3 position_room{0.0};
  glm::dquat orientation{1.0, 0.0, 0.0, 0.0};  ///< camera-to-room rotation, unit length
  bool operator==(const Pose&) const = default;
};

/// A rectangle of pixels [x, x+width) x [y, y+height); y grows downwards, (0,0) is the upper left pixel.
struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
  bool operator==(const Rect&) const = default;
};

/// True if `inner` has at least one pixel and lies in `outer`. Safe for any numbers from outside: nothing overflows.
constexpr bool contains(const Rect& outer, const Rect& inner) {
  return inner.width >= 1 && inner.height >= 1 && inner.width <= outer.width && inner.height <= outer.height &&
         inner.x >= outer.x && inner.y >= outer.y && int64_t{inner.x} + inner.width <= int64_t{outer.x} + outer.width &&
         int64_t{inner.y} + inner.height <= int64_t{outer.y} + outer.height;
}

/// A perspective camera. left, right, bottom, top are the tangents of the frustum's edges (the frustum cut at z = -1),
/// so off-axis frusta need no further numbers. Pixel (x, y) has its centre at
///   u = left + (x + 0.5) / width * (right - left),   v = top - (y + 0.5) / height * (top - bottom)
/// and sees along (u, v, -1) in camera space. "Depth" is always distance along -z in metres, not along the ray.
struct Camera {
  Pose pose;
  double left = -1, right = 1, bottom = -0.625, top = 0.625;
  double near_m = 0.02;  ///< nearest visible depth; 24-bit reciprocal depth has steps of z^2 / (near 2^24) at depth z
  int width = 1280, height = 800;

  bool operator==(const Camera&) const = default;

  /// Pixels per unit tangent.
  double focal_x() const { return width / (right - left); }
  double focal_y() const { return height / (top - bottom); }

  /// Room-to-camera transformation (rigid).
  glm::dmat4 view() const;

  /// Room space -> homogeneous pixels: (x_pix * w, y_pix * w, w) with w = depth; pixel centres lie at +0.5.
  /// Rows, not columns: result[i] . (X, Y, Z, 1).
  struct PixelTransform {
    glm::dvec4 x, y, w;
  };
  PixelTransform room_to_pixel() const;

  /// Room-space point at depth `depth_m` on the ray through continuous pixel position (x_pix, y_pix).
  glm::dvec3 unproject(double x_pix, double y_pix, double depth_m) const;
};

/// A symmetric camera. fov_x_deg: horizontal field of view in degrees, in (1, 175).
Camera make_camera(const Pose& pose, double fov_x_deg, int width, int height, double near_m = 0.02);

/// Refuses NaN, infinities, empty or inverted frusta, sizes outside [1, kMaxImageSide], near outside [1e-6, 1e6],
/// quaternions whose length differs from 1 by more than 1 %. For cameras that arrive from outside.
Status validate(const Camera& camera);

/// The five planes (left, right, bottom, top, near) of a camera's frustum, pointing inwards, in room space.
class Frustum {
 public:
  explicit Frustum(const Camera& camera);
  /// False only if the box is wholly outside one plane (conservative: true does not promise visibility).
  bool may_contain(const Box& box) const { return on_inner_sides(box, false); }
  /// True only if all of the box is inside.
  bool contains(const Box& box) const { return on_inner_sides(box, true); }

 private:
  bool on_inner_sides(const Box& box, bool wholly) const;
  glm::vec4 planes_[5];
};

/// The frustum of a part of the image, as a camera of its own (same pose, off-axis, rect.width x rect.height pixels).
Camera crop(const Camera& camera, const Rect& rect);

/// The camera whose pixel (i, j) looks in the direction of pixel (step * i + step / 2, step * j + step / 2) of
/// `camera`: ceil(width / step) x ceil(height / step) pixels, so the last ones may lie outside camera's image.
/// Precondition: step >= 1.
Camera subsample(const Camera& camera, int step);

/// The camera whose pixel (i, j) covers the pixels (2 i, 2 j) to (2 i + 1, 2 j + 1) of `camera`: half its size, rounded
/// up, so the last ones may lie partly outside camera's image.
Camera half_size(const Camera& camera);

/// Directions in the room of the pixels in the part `rect` of a camera's image, in the form of the depth-image codec
/// (codec::RoomAxes): row i . (x, y, 1) times a pixel's depth in metres is coordinate i, in room space, of the point at
/// its centre, relative to the eye; x and y are its column and row in the part.
std::array<std::array<double, 3>, 3> ray_axes(const Camera& camera, const Rect& rect);

}  // namespace telesplat::geometry
