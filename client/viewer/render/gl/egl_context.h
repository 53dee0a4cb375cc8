// An OpenGL context without a window.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::viewer {

class EglContext {
 public:
  /// OpenGL 4.3 core or later, current in the calling thread: on the first EGL device that gives one, else on Mesa's surfaceless
  /// platform. Fails with what was tried.
  static Result<EglContext> make();

  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&&) = delete;
  ~EglContext();

  /// GL_RENDERER.
  const std::string& device() const { return device_; }
  /// True if that is a software rasteriser.
  bool is_software() const;

 private:
  EglContext() = default;
  void* display_ = nullptr;
  void* context_ = nullptr;
  std::string device_;
};

}  // namespace telesplat::viewer
