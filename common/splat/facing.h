// Finds points and mosaics that face away from the eye. The reference depth map, the viewers' selection and every
// kernel use this one test, so that a point that viewers leave out does not count as seen.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>

#include "common/geometry/box.h"
#include "common/points/point_model.h"

namespace telesplat::splat {

/// A point faces away if the angle between its normal and the direction to the eye exceeds 90 degrees by a margin. The
/// margin is 10 degrees, because normals interpolated over a mesh turn away before the surface does, plus half the
/// angle under which the leaf is seen, because the eye is taken to be in one direction from all of the leaf.
inline constexpr float kCosFacingMargin = 0.98480775f, kSinFacingMargin = 0.17364818f;

/// A leaf's cube as seen from the eye: the part of the test that all its points share.
struct LeafView {
  glm::vec3 to_eye;  ///< from the cube's centre
  /// beta = 10 degrees + half the angle under which the cube's sphere is seen. cos_beta < 0: all points face the eye.
  float sin_beta, cos_beta;
  float distance;  ///< from its centre to the eye; 0 if the eye is inside the sphere
};

inline LeafView leaf_view(const geometry::Box& leaf, const glm::vec3& eye) {
  const glm::vec3 to_eye = eye - leaf.centre();
  const float distance2 = glm::dot(to_eye, to_eye), radius2 = 0.25f * glm::dot(leaf.size(), leaf.size());
  if (!(distance2 > radius2)) return {to_eye, 1.0f, -1.0f, 0.0f};
  const float sin_half = std::sqrt(radius2 / distance2), cos_half = std::sqrt(1.0f - radius2 / distance2);
  return {to_eye, sin_half * kCosFacingMargin + cos_half * kSinFacingMargin,
          cos_half * kCosFacingMargin - sin_half * kSinFacingMargin, std::sqrt(distance2)};
}

enum class Facing {
  kAway,    ///< every point faces away
  kMixed,   ///< points must be tested one by one
  kTowards  ///< no point faces away
};

/// By the mosaic's normal cone: away if the angle between its axis and the direction to the eye exceeds 90 degrees +
/// cone + beta.
inline Facing facing_of(const points::Mosaic& m, const LeafView& view) {
  if (view.cos_beta <= 0) return Facing::kTowards;
  const glm::vec3 axis = m.cone_axis_direction();
  const float towards = glm::dot(axis, view.to_eye), cos_cone = m.cone_cosine();
  // Tests first for mosaics that face the eye, as most do: axis and eye at most 90 degrees - cone - beta apart.
  if (cos_cone <= 0) return Facing::kMixed;
  const float sin_cone = std::sqrt(1.0f - cos_cone * cos_cone);
  const float scale = view.distance * std::sqrt(glm::dot(axis, axis));
  if (towards >= (sin_cone * view.cos_beta - cos_cone * view.sin_beta) * scale) return Facing::kTowards;
  if (cos_cone * view.cos_beta - sin_cone * view.sin_beta <= 0) return Facing::kMixed;  // cone + beta >= 90 degrees
  return towards < -(sin_cone * view.cos_beta + cos_cone * view.sin_beta) * scale ? Facing::kAway : Facing::kMixed;
}

/// A point with the normal n, not of unit length, faces away if dot(n, this) < -|n|. Zero: no point does.
inline glm::vec3 facing_vector(const LeafView& view) {
  return view.cos_beta <= 0 ? glm::vec3(0) : view.to_eye / (view.distance * view.sin_beta);
}

}  // namespace telesplat::splat
