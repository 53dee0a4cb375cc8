// Finds the content under a place of the display: a point of the model, or the first place of a volume that hides
// enough. It reads the viewer's data, never the picture, so shading, splat sizes and overlays do not matter. No
// sockets, no clocks.
#pragma once

#include <cstdint>
#include <optional>

#include "common/geometry/camera.h"
#include "common/splat/select/view_selection.h"
#include "common/volume/warp/warper.h"

namespace telesplat::viewer {

struct Pick {
  glm::dvec3 position_room{0.0};
  glm::dvec3 normal_room{0.0};  ///< towards the eye, unit length; zero: a volume has none
  uint32_t colour = 0;          ///< 0x00RRGGBB, without light; volume: of all in front of the place
  double depth_m = 0;           ///< along the camera's axis
  double spacing_m = 0;         ///< distance between samples there, half a layer: not a bound of the error
  glm::dvec3 origin_room{0.0}, direction_room{0.0, 0.0, -1.0};  ///< the pixel's ray, from the near plane on
};

/// Picks the surface at a continuous pixel position; pixel centres are at + 0.5. The nearest surface drawn there
/// counts, and of its points the one nearest to the pixel; the place is where the pixel's ray meets that point's
/// tangent plane. list: selected with `camera`, or with a part of it that holds the pixel and kPickReach pixels around
/// it. Nothing: no point lies there.
std::optional<Pick> pick_point(const splat::DrawList& list, const geometry::Camera& camera, double x_pix, double y_pix);
inline constexpr int kPickReach = 18;  ///< pixels: more than splats reach
/// Returns the part of a camera's image that pick_point() needs, as a camera.
geometry::Camera pick_camera(const geometry::Camera& camera, double x_pix, double y_pix);

/// Picks the first place along the pixel's ray at which the volume in front hides `opacity` (0 to 1) of what lies
/// behind. Within that layer, the place is interpolated by opacity. Nothing: the ray never reaches this opacity.
std::optional<Pick> pick_volume(const volume::VolumeFrame& frame, const geometry::Camera& camera, double x_pix,
                                double y_pix, double opacity);

}  // namespace telesplat::viewer
