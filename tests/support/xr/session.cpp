// Sessions and their states.
#include <openxr/openxr.h>

#include "common/core/clock.h"
#include "tests/support/xr/calls.h"
#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test::calls {
namespace {

using Of = Runtime::Of;
Runtime& runtime() { return Runtime::get(); }

}  // namespace

XrResult CreateSession(XrInstance, const XrSessionCreateInfo* info, XrSession* session) {
  Runtime& r = runtime();
  return r.call("xrCreateSession", Of::kInstance, [&] {
    if (r.session) return XR_ERROR_LIMIT_REACHED;
    if (!r.requirements_asked)
      return r.wrong(XR_ERROR_GRAPHICS_REQUIREMENTS_CALL_MISSING, "xrGetOpenGLGraphicsRequirementsKHR comes first");
    const auto* binding = static_cast<const XrGraphicsBindingEGLMNDX*>(info->next);
    if (!binding || binding->type != XR_TYPE_GRAPHICS_BINDING_EGL_MNDX || binding->context == EGL_NO_CONTEXT ||
        !binding->getProcAddress || !r.enabled.contains(XR_MNDX_EGL_ENABLE_EXTENSION_NAME))
      return r.wrong(XR_ERROR_GRAPHICS_DEVICE_INVALID, "no binding of an EGL context");
    r.session = std::make_unique<Session>();
    r.session->display = binding->display;
    r.session->context = binding->context;
    r.profile.clear();
    *session = r.session_handle();
    r.go_to(XR_SESSION_STATE_IDLE);
    r.go_to(XR_SESSION_STATE_READY);
    return XR_SUCCESS;
  });
}

XrResult DestroySession(XrSession) {
  Runtime& r = runtime();
  return r.call("xrDestroySession", Of::kSession, [&] {
    if (r.session->running && !r.session->lost && !r.gone) r.wrong(XR_SUCCESS, "it is still running");
    r.session.reset();
    return XR_SUCCESS;
  });
}

XrResult BeginSession(XrSession, const XrSessionBeginInfo* info) {
  Runtime& r = runtime();
  return r.call("xrBeginSession", Of::kSession, [&] {
    Session& s = *r.session;
    if (s.running) return r.wrong(XR_ERROR_SESSION_RUNNING, "it runs already");
    if (s.state != XR_SESSION_STATE_READY) return r.wrong(XR_ERROR_SESSION_NOT_READY, "before its state is READY");
    if (info->primaryViewConfigurationType != XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO)
      return r.wrong(XR_ERROR_VIEW_CONFIGURATION_TYPE_UNSUPPORTED, "not two eyes");
    s.running = true;
    const double now_s = monotonic_s();
    s.pacing.emplace(r.config.rate_hz, now_s);
    if (!r.began_s) r.began_s = now_s;
    return XR_SUCCESS;
  });
}

XrResult EndSession(XrSession) {
  Runtime& r = runtime();
  return r.call("xrEndSession", Of::kSession, [&] {
    Session& s = *r.session;
    if (s.state != XR_SESSION_STATE_STOPPING)
      return r.wrong(XR_ERROR_SESSION_NOT_STOPPING, "before its state is STOPPING");
    s.running = false;
    r.go_to(XR_SESSION_STATE_IDLE);
    if (s.exits) r.go_to(XR_SESSION_STATE_EXITING);
    return XR_SUCCESS;
  });
}

XrResult RequestExitSession(XrSession) {
  Runtime& r = runtime();
  return r.call("xrRequestExitSession", Of::kSession, [&] {
    if (!r.session->running) return r.wrong(XR_ERROR_SESSION_NOT_RUNNING, "it does not run");
    r.session->exits = true;
    r.go_to(XR_SESSION_STATE_STOPPING);
    return XR_SUCCESS;
  });
}

}  // namespace telesplat::xr_test::calls
