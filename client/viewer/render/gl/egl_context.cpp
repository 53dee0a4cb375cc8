#include "client/viewer/render/gl/egl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <utility>
#include <vector>

namespace telesplat::viewer {
namespace {

bool has_client_extension(const char* name) { return epoxy_has_egl_extension(EGL_NO_DISPLAY, name); }

// Initialises the display and makes a context current on it. Returns why not, or an empty string.
std::string make_current(EGLDisplay display, EGLContext& context) {
  if (display == EGL_NO_DISPLAY) return "no display";
  EGLint major = 0, minor = 0;
  if (!eglInitialize(display, &major, &minor)) return fmt::format("eglInitialize: error {:#x}", eglGetError());
  const EGLint no_context[] = {EGL_CONTEXT_MAJOR_VERSION,
                               4,
                               EGL_CONTEXT_MINOR_VERSION,
                               3,
                               EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                               EGL_NONE};
  const EGLint wanted[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  std::string why;
  if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) why = "no surfaceless contexts";
  else if (!eglBindAPI(EGL_OPENGL_API)) why = "no OpenGL";
  else if (!eglChooseConfig(display, wanted, &config, 1, &configs) || configs == 0) why = "no configuration with OpenGL";
  else if ((context = eglCreateContext(display, config, EGL_NO_CONTEXT, no_context)) == EGL_NO_CONTEXT)
    why = fmt::format("no OpenGL 4.3 core context: error {:#x}", eglGetError());
  else if (!eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
    why = fmt::format("eglMakeCurrent: error {:#x}", eglGetError());
    eglDestroyContext(display, context);
  }
  if (!why.empty()) eglTerminate(display);
  return why;
}

}  // namespace

Result<EglContext> EglContext::make() {
  struct Attempt {
    std::string name;
    EGLenum platform;
    void* native;
  };
  std::vector<Attempt> attempts;
  if (!has_client_extension("EGL_EXT_platform_base")) return Error{"EGL: EGL_EXT_platform_base is missing"};
  if (has_client_extension("EGL_EXT_platform_device") && has_client_extension("EGL_EXT_device_enumeration")) {
    EGLDeviceEXT devices[16];
    EGLint count = 0;
    if (eglQueryDevicesEXT(16, devices, &count))
      for (EGLint i = 0; i < count; ++i) attempts.push_back({fmt::format("EGL device {}", i), EGL_PLATFORM_DEVICE_EXT, devices[i]});
  }
  if (has_client_extension("EGL_MESA_platform_surfaceless"))
    attempts.push_back({"Mesa surfaceless", EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY});

  std::string tried;
  for (const Attempt& attempt : attempts) {
    EGLDisplay display = eglGetPlatformDisplayEXT(attempt.platform, attempt.native, nullptr);
    EGLContext context = EGL_NO_CONTEXT;
    const std::string why = make_current(display, context);
    if (why.empty()) {
      ::telesplat::viewer::EglContext made;
      made.display_ = display;
      made.context_ = context;
      const auto* device = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
      made.device_ = device ? device : "unknown";
      return made;
    }
    tried += fmt::format("{}{}: {}", tried.empty() ? "" : "; ", attempt.name, why);
  }
  return Error{"no OpenGL 4.3 context could be made (" + (tried.empty() ? std::string("EGL offers no off-screen platform") : tried) + ")"};
}

EglContext::EglContext(EglContext&& other) noexcept
    : display_(std::exchange(other.display_, nullptr)),
      context_(std::exchange(other.context_, nullptr)),
      device_(std::move(other.device_)) {}

EglContext::~EglContext() {
  // The display stays initialised: another context of this process may share it.
  if (!context_) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

bool EglContext::is_software() const {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader", "Software Rasterizer"})
    if (device_.find(name) != std::string::npos) return true;
  return false;
}

}  // namespace telesplat::viewer
