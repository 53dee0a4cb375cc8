// Rays of controllers in pictures: what they meet, and how they are shown.
#pragma once

#include <optional>

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// The first point of what the picture shows on the ray from `from` along `direction` (unit length), at most
/// kFarthest_m away; nothing: it meets nothing that the picture shows. Precondition: the picture has depth, and the
/// camera's size.
std::optional<glm::dvec3> first_hit(const image::View& picture, const geometry::Camera& camera, const glm::dvec3& from,
                                    const glm::dvec3& direction);

/// A line in the room, three pixels wide, where nothing in the picture is before it; `colour` 0x00RRGGBB. Its depth
/// goes into the picture's.
void draw_line(image::View& picture, const geometry::Camera& camera, const glm::dvec3& from, const glm::dvec3& to,
               uint32_t colour);

inline constexpr double kFarthest_m = 10;

}  // namespace telesplat::viewer
