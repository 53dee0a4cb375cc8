// An OpenGL context without a window.
#pragma once

#include <epoxy/egl.h>

#include <memory>
#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::gl {

/// True if a GL_RENDERER runs on the processor (llvmpipe, softpipe, SwiftShader).
bool is_software(std::string_view renderer);

/// OpenGL 4.3 core on the first device that works: every EGL device, then Mesa's surfaceless platform. Not current in
/// any thread until a Current is made.
class EglContext {
 public:
  /// Error: lists each attempt and why it failed. Leaves no context current.
  static Result<std::unique_ptr<EglContext>> make();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// GL_RENDERER, for logs.
  const std::string& renderer() const { return renderer_; }
  bool software() const { return is_software(renderer_); }
  /// For libraries that share the context.
  EGLDisplay display() const { return display_; }
  EGLConfig config() const { return config_; }
  EGLContext context() const { return context_; }

  /// Makes the context current in this thread for a scope; restores the previous one afterwards.
  class Current {
   public:
    explicit Current(const EglContext& context);
    ~Current();
    Current(const Current&) = delete;
    Current& operator=(const Current&) = delete;
    bool ok() const { return ok_; }

   private:
    EGLDisplay display_, previous_display_;
    EGLContext previous_context_;
    EGLSurface previous_draw_, previous_read_;
    bool ok_;
  };

 private:
  EglContext(EGLDisplay display, EGLConfig config, EGLContext context)
      : display_(display), config_(config), context_(context) {}
  static Result<std::unique_ptr<EglContext>> make_on(EGLDisplay display);

  EGLDisplay display_;
  EGLConfig config_;
  EGLContext context_;
  std::string renderer_;
};

}  // namespace telesplat::gl
