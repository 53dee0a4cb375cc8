// Instances, the headset and its properties; texts and times.
#include <fmt/format.h>
#include <openxr/openxr_reflection.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/support/xr/calls.h"
#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test::calls {
namespace {

using Of = Runtime::Of;

constexpr XrSystemId kHeadset = 1;
constexpr uint32_t kMostSide = 4096;

Runtime& runtime() { return Runtime::get(); }

Result<Config> configured() {
  const char* text = std::getenv("TELESPLAT_XR_TEST");
  return parse_config(text ? text : "");
}

std::vector<std::pair<const char*, uint32_t>> extensions() {
  std::vector<std::pair<const char*, uint32_t>> out{
      {XR_KHR_OPENGL_ENABLE_EXTENSION_NAME, XR_KHR_opengl_enable_SPEC_VERSION},
      {XR_MNDX_EGL_ENABLE_EXTENSION_NAME, XR_MNDX_egl_enable_SPEC_VERSION},
      {XR_KHR_CONVERT_TIMESPEC_TIME_EXTENSION_NAME, XR_KHR_convert_timespec_time_SPEC_VERSION}};
  const auto config = configured();
  if (config && config->depth)
    out.emplace_back(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME, XR_KHR_composition_layer_depth_SPEC_VERSION);
  return out;
}

}  // namespace

XrResult EnumerateInstanceExtensionProperties(const char*, uint32_t capacity, uint32_t* count,
                                              XrExtensionProperties* out) {
  std::vector<XrExtensionProperties> list;
  for (const auto& [name, version] : extensions()) {
    XrExtensionProperties p{XR_TYPE_EXTENSION_PROPERTIES};
    std::strncpy(p.extensionName, name, XR_MAX_EXTENSION_NAME_SIZE - 1);
    p.extensionVersion = version;
    list.push_back(p);
  }
  return hand_out(list, capacity, count, out);
}

XrResult CreateInstance(const XrInstanceCreateInfo* info, XrInstance* instance) {
  Runtime& r = runtime();
  const auto config = configured();
  if (!config) {
    std::fprintf(stderr, "xr test runtime: %s\n", config.error().text.c_str());
    return XR_ERROR_RUNTIME_FAILURE;
  }
  return r.call("xrCreateInstance", Of::kNothing, [&] {
    if (r.exists) return XR_ERROR_LIMIT_REACHED;
    // If an application comes again, faults do not, and the record goes on.
    if (!r.recorder) {
      r.config = *config;
      r.recorder = std::make_unique<Recorder>(config->out);
      r.recorder->count("xrCreateInstance");
    }
    const auto there = extensions();
    r.enabled.clear();
    for (uint32_t i = 0; i < info->enabledExtensionCount; ++i) {
      const char* name = info->enabledExtensionNames[i];
      if (std::none_of(there.begin(), there.end(), [&](const auto& e) { return std::strcmp(e.first, name) == 0; }))
        return XR_ERROR_EXTENSION_NOT_PRESENT;
      r.enabled.insert(name);
    }
    if (info->applicationInfo.applicationName[0] == 0) return r.wrong(XR_ERROR_NAME_INVALID, "no application's name");
    r.exists = true;
    r.gone = r.requirements_asked = false;
    r.events.clear();
    *instance = r.instance();
    return XR_SUCCESS;
  });
}

XrResult DestroyInstance(XrInstance) {
  Runtime& r = runtime();
  return r.call("xrDestroyInstance", Of::kInstance, [&] {
    if (r.session) r.recorder->mistake("xrDestroyInstance: its session is still there");
    r.session.reset();
    r.actions.clear();
    r.action_sets.clear();
    r.exists = false;
    r.recorder->flush();
    return XR_SUCCESS;
  });
}

XrResult GetInstanceProperties(XrInstance, XrInstanceProperties* out) {
  return runtime().call("xrGetInstanceProperties", Of::kInstance, [&] {
    out->runtimeVersion = XR_MAKE_VERSION(1, 0, 0);
    std::strncpy(out->runtimeName, "Telesplat test runtime", XR_MAX_RUNTIME_NAME_SIZE - 1);
    return XR_SUCCESS;
  });
}

XrResult PollEvent(XrInstance, XrEventDataBuffer* event) {
  Runtime& r = runtime();
  return r.call("xrPollEvent", Of::kInstance, [&] {
    if (r.events.empty()) return XR_EVENT_UNAVAILABLE;
    *event = r.events.front();
    r.events.pop_front();
    if (event->type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING) r.gone = true;
    return XR_SUCCESS;
  });
}

XrResult ResultToString(XrInstance, XrResult value, char out[XR_MAX_RESULT_STRING_SIZE]) {
  const char* name = "XR_UNKNOWN_RESULT";
  switch (value) {
#define TELESPLAT_XR_NAME(result, number) \
  case result:                            \
    name = #result;                       \
    break;
    XR_LIST_ENUM_XrResult(TELESPLAT_XR_NAME)
#undef TELESPLAT_XR_NAME
        default : break;
  }
  std::snprintf(out, XR_MAX_RESULT_STRING_SIZE, "%s", name);
  return XR_SUCCESS;
}

XrResult StructureTypeToString(XrInstance, XrStructureType value, char out[XR_MAX_STRUCTURE_NAME_SIZE]) {
  std::snprintf(out, XR_MAX_STRUCTURE_NAME_SIZE, "XR_STRUCTURE_TYPE_%d", int(value));
  return XR_SUCCESS;
}

XrResult GetSystem(XrInstance, const XrSystemGetInfo* info, XrSystemId* system) {
  return runtime().call("xrGetSystem", Of::kInstance, [&] {
    if (info->formFactor != XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY) return XR_ERROR_FORM_FACTOR_UNSUPPORTED;
    *system = kHeadset;
    return XR_SUCCESS;
  });
}

XrResult GetSystemProperties(XrInstance, XrSystemId system, XrSystemProperties* out) {
  Runtime& r = runtime();
  return r.call("xrGetSystemProperties", Of::kInstance, [&] {
    if (system != kHeadset) return r.wrong(XR_ERROR_SYSTEM_INVALID, "another system");
    out->systemId = kHeadset;
    std::strncpy(out->systemName, "no headset", XR_MAX_SYSTEM_NAME_SIZE - 1);
    out->graphicsProperties = {kMostSide, kMostSide, XR_MIN_COMPOSITION_LAYERS_SUPPORTED};
    out->trackingProperties = {XR_TRUE, XR_TRUE};
    return XR_SUCCESS;
  });
}

XrResult EnumerateEnvironmentBlendModes(XrInstance, XrSystemId, XrViewConfigurationType, uint32_t capacity,
                                        uint32_t* count, XrEnvironmentBlendMode* out) {
  return runtime().call("xrEnumerateEnvironmentBlendModes", Of::kInstance,
                        [&] { return hand_out(std::array{XR_ENVIRONMENT_BLEND_MODE_OPAQUE}, capacity, count, out); });
}

XrResult EnumerateViewConfigurations(XrInstance, XrSystemId, uint32_t capacity, uint32_t* count,
                                     XrViewConfigurationType* out) {
  return runtime().call("xrEnumerateViewConfigurations", Of::kInstance, [&] {
    return hand_out(std::array{XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO}, capacity, count, out);
  });
}

XrResult GetViewConfigurationProperties(XrInstance, XrSystemId, XrViewConfigurationType type,
                                        XrViewConfigurationProperties* out) {
  return runtime().call("xrGetViewConfigurationProperties", Of::kInstance, [&] {
    out->viewConfigurationType = type;
    out->fovMutable = XR_FALSE;
    return type == XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO ? XR_SUCCESS
                                                             : XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED;
  });
}

XrResult EnumerateViewConfigurationViews(XrInstance, XrSystemId, XrViewConfigurationType type, uint32_t capacity,
                                         uint32_t* count, XrViewConfigurationView* out) {
  Runtime& r = runtime();
  return r.call("xrEnumerateViewConfigurationViews", Of::kInstance, [&] {
    if (type != XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO) return XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED;
    XrViewConfigurationView eye{XR_TYPE_VIEW_CONFIGURATION_VIEW};
    eye.recommendedImageRectWidth = uint32_t(r.config.width);
    eye.recommendedImageRectHeight = uint32_t(r.config.height);
    eye.maxImageRectWidth = eye.maxImageRectHeight = kMostSide;
    eye.recommendedSwapchainSampleCount = eye.maxSwapchainSampleCount = 1;
    return hand_out(std::array{eye, eye}, capacity, count, out);
  });
}

XrResult GetOpenGLGraphicsRequirementsKHR(XrInstance, XrSystemId, XrGraphicsRequirementsOpenGLKHR* out) {
  Runtime& r = runtime();
  return r.call("xrGetOpenGLGraphicsRequirementsKHR", Of::kInstance, [&] {
    r.requirements_asked = true;
    out->minApiVersionSupported = XR_MAKE_VERSION(3, 3, 0);
    out->maxApiVersionSupported = XR_MAKE_VERSION(4, 6, 0);
    return XR_SUCCESS;
  });
}

XrResult ConvertTimespecTimeToTimeKHR(XrInstance, const timespec* at, XrTime* out) {
  return runtime().call("xrConvertTimespecTimeToTimeKHR", Of::kInstance, [&] {
    *out = XrTime(at->tv_sec) * 1'000'000'000 + at->tv_nsec;
    return XR_SUCCESS;
  });
}

XrResult ConvertTimeToTimespecTimeKHR(XrInstance, XrTime time, timespec* out) {
  return runtime().call("xrConvertTimeToTimespecTimeKHR", Of::kInstance, [&] {
    *out = {.tv_sec = time_t(time / 1'000'000'000), .tv_nsec = long(time % 1'000'000'000)};
    return XR_SUCCESS;
  });
}

XrResult StringToPath(XrInstance, const char* text, XrPath* path) {
  Runtime& r = runtime();
  return r.call("xrStringToPath", Of::kInstance, [&] {
    if (text[0] != '/') return r.wrong(XR_ERROR_PATH_FORMAT_INVALID, text);
    const auto found = std::find(r.paths.begin(), r.paths.end(), text);
    *path = XrPath(found - r.paths.begin());
    if (found == r.paths.end()) r.paths.emplace_back(text);
    return XR_SUCCESS;
  });
}

XrResult PathToString(XrInstance, XrPath path, uint32_t capacity, uint32_t* count, char* out) {
  Runtime& r = runtime();
  return r.call("xrPathToString", Of::kInstance, [&] {
    if (path == XR_NULL_PATH || path >= r.paths.size()) return XR_ERROR_PATH_INVALID;
    const std::string& text = r.paths[path];
    const std::string_view whole(text.c_str(), text.size() + 1);
    return hand_out(whole, capacity, count, out);
  });
}

}  // namespace telesplat::xr_test::calls
