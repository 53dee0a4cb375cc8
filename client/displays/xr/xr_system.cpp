#include "client/displays/xr/xr_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace telesplat::viewer {
namespace {

int pixels(double focal, double extent) {
  return std::clamp(int(std::lround(focal * extent)), 1, geometry::kMaxImageSide);
}

constexpr XrVersion kOpenGl = XR_MAKE_VERSION(4, 3, 0);  // contexts here are made for this version

const char* meaning(XrResult result) {
  switch (result) {
    case XR_ERROR_RUNTIME_UNAVAILABLE:
    case XR_ERROR_FILE_ACCESS_ERROR:
      return ": no OpenXR runtime was found; one is named by XR_RUNTIME_JSON or by "
             "/etc/xdg/openxr/1/active_runtime.json";
    case XR_ERROR_FORM_FACTOR_UNAVAILABLE:
      return ": no headset is connected";
    case XR_ERROR_FORM_FACTOR_UNSUPPORTED:
      return ": the runtime knows no headsets";
    default:
      return "";
  }
}

std::vector<XrExtensionProperties> extensions() {
  uint32_t count = 0;
  if (XR_FAILED(xrEnumerateInstanceExtensionProperties(nullptr, 0, &count, nullptr))) return {};
  std::vector<XrExtensionProperties> out(count, {XR_TYPE_EXTENSION_PROPERTIES});
  if (XR_FAILED(xrEnumerateInstanceExtensionProperties(nullptr, count, &count, out.data()))) return {};
  return out;
}

}  // namespace

geometry::Pose room_pose(const XrPosef& p, const glm::dvec3& origin) {
  const glm::dquat q(p.orientation.w, p.orientation.x, p.orientation.y, p.orientation.z);
  return {glm::dvec3(p.position.x, p.position.y, p.position.z) - origin, glm::normalize(q)};
}

geometry::Camera eye_camera(const XrView& view, const glm::dvec3& origin, int width, int height, double near_m) {
  geometry::Camera out;
  out.pose = room_pose(view.pose, origin);
  out.left = std::tan(view.fov.angleLeft), out.right = std::tan(view.fov.angleRight);
  out.bottom = std::tan(view.fov.angleDown), out.top = std::tan(view.fov.angleUp);
  out.width = width, out.height = height;
  out.near_m = near_m;
  return out;
}

// Depths are linear in the reciprocal.
double step_of_depth_m(double near_m, double far_m) { return (1 / near_m - 1 / far_m) / 65535; }

geometry::Camera both_eyes(const std::array<geometry::Camera, 2>& eyes) {
  geometry::Camera out = eyes[0];
  out.pose.orientation = glm::normalize(glm::slerp(eyes[0].pose.orientation, eyes[1].pose.orientation, 0.5));
  const glm::dvec3 middle = 0.5 * (eyes[0].pose.position_room + eyes[1].pose.position_room);
  const glm::dquat to_head = glm::conjugate(out.pose.orientation);
  // Covers all directions of either eye, as tangents on the head's own axes.
  glm::dvec2 lo(1e9), hi(-1e9);
  glm::dvec3 apexes[2];
  for (int e = 0; e < 2; ++e) {
    const geometry::Camera& eye = eyes[size_t(e)];
    apexes[e] = to_head * (eye.pose.position_room - middle);
    const glm::dquat turn = to_head * eye.pose.orientation;
    for (const double u : {eye.left, eye.right})
      for (const double v : {eye.bottom, eye.top}) {
        const glm::dvec3 d = turn * glm::dvec3(u, v, -1);
        const glm::dvec2 tangent(d.x / -d.z, d.y / -d.z);
        lo = glm::min(lo, tangent), hi = glm::max(hi, tangent);
      }
  }
  // The apex (x, y, behind) sees the eye at a if lo (behind - a.z) <= a - (x, y) <= hi (behind - a.z), in both axes.
  glm::dvec2 most(-1e9), least(1e9);
  for (const auto& a : apexes) {
    most = glm::max(most, glm::dvec2(a) + hi * a.z);
    least = glm::min(least, glm::dvec2(a) + lo * a.z);
  }
  const glm::dvec2 needed = (most - least) / (hi - lo);
  const double behind = std::max({needed.x, needed.y, apexes[0].z, apexes[1].z});
  const glm::dvec2 aside = 0.5 * ((most - hi * behind) + (least - lo * behind));
  out.pose.position_room = middle + out.pose.orientation * glm::dvec3(aside, behind);
  out.left = lo.x, out.right = hi.x, out.bottom = lo.y, out.top = hi.y;
  out.width = pixels(std::max(eyes[0].focal_x(), eyes[1].focal_x()), hi.x - lo.x);
  out.height = pixels(std::max(eyes[0].focal_y(), eyes[1].focal_y()), hi.y - lo.y);
  return out;
}

Error XrSystem::error(const char* what, XrResult result) const {
  char name[XR_MAX_RESULT_STRING_SIZE] = "";
  if (instance_ == XR_NULL_HANDLE || XR_FAILED(xrResultToString(instance_, result, name)))
    return Error{fmt::format("{} failed with {}{}", what, int(result), meaning(result))};
  return Error{fmt::format("{} failed with {}{}", what, name, meaning(result))};
}

Status XrSystem::check(const char* what, XrResult result) const {
  if (result == XR_ERROR_SESSION_LOST) return Error{"the runtime lost the headset"};  // an event reports it, too
  return XR_FAILED(result) ? Status(error(what, result)) : ok_status();
}

template <class Function>
Status XrSystem::load(const char* name, Function& function) {
  return check(name, xrGetInstanceProcAddr(instance_, name, reinterpret_cast<PFN_xrVoidFunction*>(&function)));
}

Status XrSystem::make_instance() {
  const auto there = extensions();
  const auto has = [&](const char* name) {
    return std::any_of(there.begin(), there.end(),
                       [&](const XrExtensionProperties& p) { return std::strcmp(p.extensionName, name) == 0; });
  };
  std::vector<const char*> wanted{XR_KHR_OPENGL_ENABLE_EXTENSION_NAME, XR_MNDX_EGL_ENABLE_EXTENSION_NAME,
                                  XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME};
  if (!there.empty())  // otherwise xrCreateInstance reports why
    for (const char* name : wanted)
      if (!has(name)) return Error{fmt::format("the OpenXR runtime has no {}, which --xr needs", name)};
  takes_depth_ = has(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
  if (takes_depth_) wanted.push_back(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
  XrInstanceCreateInfo info{XR_TYPE_INSTANCE_CREATE_INFO};
  std::strncpy(info.applicationInfo.applicationName, "Telesplat", XR_MAX_APPLICATION_NAME_SIZE - 1);
  std::strncpy(info.applicationInfo.engineName, "Telesplat", XR_MAX_ENGINE_NAME_SIZE - 1);
  info.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  info.enabledExtensionCount = uint32_t(wanted.size());
  info.enabledExtensionNames = wanted.data();
  if (const Status s = check("xrCreateInstance", xrCreateInstance(&info, &instance_)); !s) return s;
  if (const Status s = load("xrConvertTimespecTimeToTimeKHR", to_time_); !s) return s;
  return load("xrConvertTimeToTimespecTimeKHR", to_timespec_);
}

Status XrSystem::find_headset() {
  XrInstanceProperties runtime{XR_TYPE_INSTANCE_PROPERTIES};
  if (const Status s = check("xrGetInstanceProperties", xrGetInstanceProperties(instance_, &runtime)); !s) return s;
  XrSystemGetInfo wanted{XR_TYPE_SYSTEM_GET_INFO};
  wanted.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  if (const Status s = check("xrGetSystem", xrGetSystem(instance_, &wanted, &system_)); !s) return s;
  XrSystemProperties headset{XR_TYPE_SYSTEM_PROPERTIES};
  if (const Status s = check("xrGetSystemProperties", xrGetSystemProperties(instance_, system_, &headset)); !s)
    return s;
  const XrVersion v = runtime.runtimeVersion;
  name_ = fmt::format("{} {}.{}.{}, {}", runtime.runtimeName, XR_VERSION_MAJOR(v), XR_VERSION_MINOR(v),
                      XR_VERSION_PATCH(v), headset.systemName);
  return ok_status();
}

Status XrSystem::read_sizes() {
  XrViewConfigurationView views[2]{{XR_TYPE_VIEW_CONFIGURATION_VIEW}, {XR_TYPE_VIEW_CONFIGURATION_VIEW}};
  uint32_t count = 0;
  const XrResult result = xrEnumerateViewConfigurationViews(instance_, system_, kTwoEyes, 2, &count, views);
  if (const Status s = check("xrEnumerateViewConfigurationViews", result); !s) return s;
  if (count != 2) return Error{fmt::format("{} has {} views instead of two", name_, count)};
  // Both eyes have pictures of one size, so that each takes equally long to draw.
  eye_size_ = {int(std::max(views[0].recommendedImageRectWidth, views[1].recommendedImageRectWidth)),
               int(std::max(views[0].recommendedImageRectHeight, views[1].recommendedImageRectHeight)),
               int(std::min(views[0].maxImageRectWidth, views[1].maxImageRectWidth)),
               int(std::min(views[0].maxImageRectHeight, views[1].maxImageRectHeight))};
  return ok_status();
}

Status XrSystem::read_blend_mode() {
  XrEnvironmentBlendMode modes[8];
  uint32_t count = 0;
  const XrResult result = xrEnumerateEnvironmentBlendModes(instance_, system_, kTwoEyes, 8, &count, modes);
  if (const Status s = check("xrEnumerateEnvironmentBlendModes", result); !s) return s;
  if (count == 0) return Error{name_ + " has no blend mode"};
  const bool opaque = std::find(modes, modes + count, XR_ENVIRONMENT_BLEND_MODE_OPAQUE) != modes + count;
  blend_mode_ = opaque ? XR_ENVIRONMENT_BLEND_MODE_OPAQUE : modes[0];
  return ok_status();
}

// OpenXR requires this call before a session.
Status XrSystem::check_opengl() {
  PFN_xrGetOpenGLGraphicsRequirementsKHR requirements = nullptr;
  if (const Status s = load("xrGetOpenGLGraphicsRequirementsKHR", requirements); !s) return s;
  XrGraphicsRequirementsOpenGLKHR needs{XR_TYPE_GRAPHICS_REQUIREMENTS_OPENGL_KHR};
  const XrResult result = requirements(instance_, system_, &needs);
  if (const Status s = check("xrGetOpenGLGraphicsRequirementsKHR", result); !s) return s;
  if (needs.minApiVersionSupported <= kOpenGl) return ok_status();
  return Error{fmt::format("{} needs OpenGL {}.{}; contexts here are of 4.3", name_,
                           XR_VERSION_MAJOR(needs.minApiVersionSupported),
                           XR_VERSION_MINOR(needs.minApiVersionSupported))};
}

Result<std::unique_ptr<XrSystem>> XrSystem::open() {
  std::unique_ptr<XrSystem> out(new XrSystem);
  for (const auto step : {&XrSystem::make_instance, &XrSystem::find_headset, &XrSystem::read_sizes,
                          &XrSystem::read_blend_mode, &XrSystem::check_opengl})
    if (const Status s = ((*out).*step)(); !s) return s.error();
  return out;
}

XrSystem::~XrSystem() {
  if (instance_ != XR_NULL_HANDLE) xrDestroyInstance(instance_);
}

double XrSystem::to_monotonic_s(XrTime time) const {
  timespec at{};
  return XR_SUCCEEDED(to_timespec_(instance_, time, &at)) ? double(at.tv_sec) + 1e-9 * double(at.tv_nsec) : 0;
}

XrTime XrSystem::to_time(double monotonic_s) const {
  const double whole = std::floor(monotonic_s);
  const timespec at{.tv_sec = time_t(whole), .tv_nsec = long((monotonic_s - whole) * 1e9)};
  XrTime out = 0;
  return XR_SUCCEEDED(to_time_(instance_, &at, &out)) ? out : 0;
}

}  // namespace telesplat::viewer
