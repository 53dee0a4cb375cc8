#include "client/viewer/render/gl/stage_timer.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace telesplat::gl {

StageTimer::StageTimer(int stages) : ms_(static_cast<size_t>(stages)) {
  GLint bits = 0;
  glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
  if (bits <= 0) return;
  queries_.resize(static_cast<size_t>(stages) + 1);
  written_.resize(queries_.size());
  glGenQueries(stages + 1, queries_.data());
}

StageTimer::~StageTimer() {
  if (available()) glDeleteQueries(static_cast<GLsizei>(queries_.size()), queries_.data());
}

void StageTimer::begin_frame() {
  if (!available()) return;
  std::fill(written_.begin(), written_.end(), false);
  glQueryCounter(queries_[0], GL_TIMESTAMP);
}

void StageTimer::end_stage(int stage) {
  if (!available()) return;
  written_[static_cast<size_t>(stage) + 1] = true;
  glQueryCounter(queries_[static_cast<size_t>(stage) + 1], GL_TIMESTAMP);
}

const std::vector<double>& StageTimer::results() {
  if (!available()) return ms_;
  GLuint64 before = 0;
  glGetQueryObjectui64v(queries_[0], GL_QUERY_RESULT, &before);
  for (size_t i = 1; i < queries_.size(); ++i) {
    ms_[i - 1] = 0;
    if (!written_[i]) continue;
    GLuint64 now = 0;
    glGetQueryObjectui64v(queries_[i], GL_QUERY_RESULT, &now);
    if (now > before) ms_[i - 1] = static_cast<double>(now - before) * 1e-6;
    before = std::max(before, now);
  }
  return ms_;
}

}  // namespace telesplat::gl
