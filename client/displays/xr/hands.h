// Controllers: their directions, their triggers, and their rays in the pictures.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "client/displays/xr/xr_system.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A controller points along its own -z.
struct HandRay {
  geometry::Pose pose;   ///< in the room
  bool pressed = false;  ///< its trigger, or another control that selects
};
/// Left, right; nothing: there is no controller, or its place is not known.
using HandRays = std::array<std::optional<HandRay>, 2>;

class Hands {
 public:
  /// Makes actions for a session that has no other actions. Error: the call that failed.
  static Result<std::unique_ptr<Hands>> make(const XrSystem& system, XrSession session);
  ~Hands();
  Hands(const Hands&) = delete;
  Hands& operator=(const Hands&) = delete;

  /// Locates the hands in `space`, where the room's origin is at `origin`. Error: the call that failed.
  Result<HandRays> locate(XrSpace space, const glm::dvec3& origin, XrTime time);

 private:
  Hands(const XrSystem& system, XrSession session) : system_(system), session_(session) {}
  Status make_actions();
  Status make_action(const char* name, const char* shown, XrActionType type, XrAction& action);
  Status suggest(const char* profile, const char* press);
  Status attach();
  Result<XrPath> path(const std::string& text) const;

  const XrSystem& system_;
  XrSession session_;
  XrActionSet set_ = XR_NULL_HANDLE;
  XrAction aim_ = XR_NULL_HANDLE, press_ = XR_NULL_HANDLE;
  std::array<XrPath, 2> hands_{};
  std::array<XrSpace, 2> spaces_{};
};

/// Returns the first visible point of the picture on the ray from `from` along `direction` (unit length), at most
/// kFarthest_m away; nothing: it hits no visible point. Precondition: the picture has depth, and the camera's size.
std::optional<glm::dvec3> first_hit(const image::View& picture, const geometry::Camera& camera, const glm::dvec3& from,
                                    const glm::dvec3& direction);

/// Draws a line of the room, three pixels wide, where the picture shows nothing in front of it; `colour` 0x00RRGGBB.
/// Its depth goes into the picture's.
void draw_line(image::View& picture, const geometry::Camera& camera, const glm::dvec3& from, const glm::dvec3& to,
               uint32_t colour);

inline constexpr double kFarthest_m = 10;

}  // namespace telesplat::viewer
