// Controllers: where they point, whether they are pressed.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "client/displays/xr/xr_system.h"
#include "common/geometry/camera.h"

namespace telesplat::viewer {

/// A controller points along its own -z.
struct HandRay {
  geometry::Pose pose;   ///< in the room
  bool pressed = false;  ///< its trigger, or what selects there
};
/// Left, right; nothing: there is no controller, or nobody knows where it is.
using HandRays = std::array<std::optional<HandRay>, 2>;

class Hands {
 public:
  /// Of a session that has no other actions. Error: what failed.
  static Result<std::unique_ptr<Hands>> make(const XrSystem& system, XrSession session);
  ~Hands();
  Hands(const Hands&) = delete;
  Hands& operator=(const Hands&) = delete;

  /// In `space`, where the room's origin is at `origin`. Error: what failed.
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

}  // namespace telesplat::viewer
