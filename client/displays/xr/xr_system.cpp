#include "client/displays/xr/xr_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace telesplat::viewer {
namespace {

constexpr XrVersion kOpenGl = XR_MAKE_VERSION(4, 3, 0);  // what contexts here are made for

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

Error XrSystem::error(const char* what, XrResult result) const {
  char name[XR_MAX_RESULT_STRING_SIZE] = "";
  if (instance_ == XR_NULL_HANDLE || XR_FAILED(xrResultToString(instance_, result, name)))
    return Error{fmt::format("{} failed with {}{}", what, int(result), meaning(result))};
  return Error{fmt::format("{} failed with {}{}", what, name, meaning(result))};
}

Status XrSystem::check(const char* what, XrResult result) const {
  if (result == XR_ERROR_SESSION_LOST) return Error{"the runtime lost the headset"};  // an event says so, too
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
  if (!there.empty())  // else xrCreateInstance says why
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
  // Both eyes have pictures of one size: what is drawn for each takes as long.
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

// The call itself is what OpenXR demands before a session.
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
