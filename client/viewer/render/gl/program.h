// Shader programs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/core/result.h"

namespace telesplat::gl {

/// One stage: its source is the concatenation of the parts; the first part begins with #version.
struct ShaderSource {
  uint32_t kind = 0;  ///< GL_VERTEX_SHADER, GL_FRAGMENT_SHADER, GL_COMPUTE_SHADER
  std::vector<std::string_view> parts;
};

/// A linked program, deleted with this object: the context that made it must be current then.
class Program {
 public:
  /// Error: `name`, and the text of the compiler or linker.
  static Result<Program> link(std::string_view name, const std::vector<ShaderSource>& stages);

  Program() = default;
  ~Program();
  Program(Program&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  Program& operator=(Program&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }

  void use() const;
  /// Location of a uniform; -1 if the compiler found that it has no effect.
  int32_t uniform(const char* name) const;

 private:
  explicit Program(uint32_t id) : id_(id) {}
  uint32_t id_ = 0;
};

}  // namespace telesplat::gl
