#include "common/gl/egl_context.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <array>

namespace telesplat::gl {
namespace {

Error egl_error(const char* what) { return Error{fmt::format("{} failed with {:#x}", what, eglGetError())}; }

}  // namespace

EglContext::Current::Current(const EglContext& context)
    : display_(context.display_),
      previous_display_(eglGetCurrentDisplay()),
      previous_context_(eglGetCurrentContext()),
      previous_draw_(eglGetCurrentSurface(EGL_DRAW)),
      previous_read_(eglGetCurrentSurface(EGL_READ)),
      ok_(eglMakeCurrent(context.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context.context_)) {}

EglContext::Current::~Current() {
  if (previous_context_ != EGL_NO_CONTEXT)
    eglMakeCurrent(previous_display_, previous_draw_, previous_read_, previous_context_);
  else
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

// Does not terminate the display: all users of the same device in this process share it.
EglContext::~EglContext() { eglDestroyContext(display_, context_); }

bool is_software(std::string_view renderer) {
  for (const char* name : {"llvmpipe", "softpipe", "SwiftShader", "Software Rasterizer"})
    if (renderer.find(name) != std::string_view::npos) return true;
  return false;
}

Result<std::unique_ptr<EglContext>> EglContext::make_on(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return egl_error("eglGetPlatformDisplayEXT");
  if (!eglInitialize(display, nullptr, nullptr)) return egl_error("eglInitialize");
  if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context")) return Error{"no EGL_KHR_surfaceless_context"};
  if (!eglBindAPI(EGL_OPENGL_API)) return egl_error("eglBindAPI");
  constexpr EGLint kConfig[] = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint found = 0;
  if (!eglChooseConfig(display, kConfig, &config, 1, &found) || found == 0) return egl_error("eglChooseConfig");
  constexpr EGLint kVersion[] = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, kVersion);
  if (context == EGL_NO_CONTEXT) return egl_error("eglCreateContext for OpenGL 4.3 core");
  std::unique_ptr<EglContext> made(new EglContext(display, config, context));
  const Current current(*made);
  if (!current.ok()) return egl_error("eglMakeCurrent");
  made->renderer_ = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return made;
}

Result<std::unique_ptr<EglContext>> EglContext::make() {
  std::string tried;
  const auto attempt = [&](const std::string& what, EGLDisplay display) -> std::unique_ptr<EglContext> {
    auto made = make_on(display);
    if (made) return std::move(*made);
    tried += (tried.empty() ? "" : "; ") + what + ": " + made.error().text;
    return nullptr;
  };

  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
      (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration") ||
       epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_base"))) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (!eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) count = 0;
    for (EGLint i = 0; i < count; ++i)
      if (auto made = attempt(fmt::format("EGL device {}", i),
                              eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr)))
        return made;
    if (count == 0) tried = "no EGL devices";
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
    if (auto made = attempt("Mesa surfaceless",
                            eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)))
      return made;
  return Error{fmt::format("no off-screen OpenGL 4.3 context: {}",
                           tried.empty() ? "EGL has neither devices nor a surfaceless platform" : tried)};
}

}  // namespace telesplat::gl
