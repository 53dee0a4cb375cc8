// A headset of an OpenXR runtime: an instance, a system, the sizes of its pictures. It uses OpenXR with OpenGL through
// EGL, layers with depth and times of the monotonic clock, and converts its types to poses and cameras.
#pragma once

#include <epoxy/egl.h>

#include <ctime>

#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_EGL
#define XR_USE_TIMESPEC
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::viewer {

/// Converts a pose: both are right-handed, metres, +y up, looking along -z. origin: the room's, in the headset's space.
geometry::Pose room_pose(const XrPosef& pose, const glm::dvec3& origin);
/// Returns the camera of an eye; width x height pixels.
geometry::Camera eye_camera(const XrView& view, const glm::dvec3& origin, int width, int height, double near_m);

/// Step between depths at one metre, for pictures with 16 bits of depth from near_m to far_m, metres.
double step_of_depth_m(double near_m, double far_m);

/// Returns one camera for both eyes' views: in the middle of their directions, and so far behind them that its frustum
/// covers both, with as many pixels a radian. One choice of points, and one request, is made for it.
geometry::Camera both_eyes(const std::array<geometry::Camera, 2>& eyes);

class XrSystem {
 public:
  /// Finds the runtime (XR_RUNTIME_JSON, else the system's) and a headset with two eyes. Error: what is missing.
  static Result<std::unique_ptr<XrSystem>> open();
  ~XrSystem();
  XrSystem(const XrSystem&) = delete;
  XrSystem& operator=(const XrSystem&) = delete;

  XrInstance instance() const { return instance_; }
  XrSystemId system() const { return system_; }
  /// "RUNTIME 1.2.3, HEADSET"
  const std::string& name() const { return name_; }
  /// Size of an eye's picture that the runtime recommends, and its upper limit, pixels.
  struct EyeSize {
    int width, height, most_width, most_height;
  };
  const EyeSize& eye_size() const { return eye_size_; }
  /// True if layers may have depth.
  bool takes_depth() const { return takes_depth_; }
  XrEnvironmentBlendMode blend_mode() const { return blend_mode_; }

  /// Convert between the runtime's clock and monotonic_s().
  double to_monotonic_s(XrTime time) const;
  XrTime to_time(double monotonic_s) const;

  /// "WHAT: XR_ERROR_..."
  Error error(const char* what, XrResult result) const;
  Status check(const char* what, XrResult result) const;

 private:
  XrSystem() = default;
  Status make_instance();
  Status find_headset();
  Status read_sizes();
  Status read_blend_mode();
  Status check_opengl();
  template <class Function>
  Status load(const char* name, Function& function);

  XrInstance instance_ = XR_NULL_HANDLE;
  XrSystemId system_ = XR_NULL_SYSTEM_ID;
  std::string name_;
  EyeSize eye_size_{};
  bool takes_depth_ = false;
  XrEnvironmentBlendMode blend_mode_ = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  PFN_xrConvertTimespecTimeToTimeKHR to_time_ = nullptr;
  PFN_xrConvertTimeToTimespecTimeKHR to_timespec_ = nullptr;
};

inline constexpr XrViewConfigurationType kTwoEyes = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;

}  // namespace telesplat::viewer
