#include "common/gl/stage_timer.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace telesplat::gl {

StageTimer::StageTimer(int stages) : ms_(static_cast<size_t>(stages)) {
  GLint bits = 0;
  glGetQueryiv(GL_TIMESTAMP, GL_QUERY_COUNTER_BITS, &bits);
  available_ = bits > 0;
  if (!available_) return;
  for (Frame& frame : frames_) {
    frame.queries.resize(static_cast<size_t>(stages) + 1);
    frame.written.resize(frame.queries.size());
    glGenQueries(stages + 1, frame.queries.data());
  }
}

StageTimer::~StageTimer() {
  for (const Frame& frame : frames_)
    if (!frame.queries.empty()) glDeleteQueries(static_cast<GLsizei>(frame.queries.size()), frame.queries.data());
}

void StageTimer::begin_frame() {
  if (!available_) return;
  frame_ = (frame_ + 1) % kFrames;
  Frame& frame = frames_[frame_];
  collect(frame, false);
  std::fill(frame.written.begin(), frame.written.end(), false);
  frame.pending = true;
  frame.written[0] = true;
  glQueryCounter(frame.queries[0], GL_TIMESTAMP);
}

void StageTimer::end_stage(int stage) {
  if (!available_) return;
  Frame& frame = frames_[frame_];
  frame.written[static_cast<size_t>(stage) + 1] = true;
  glQueryCounter(frame.queries[static_cast<size_t>(stage) + 1], GL_TIMESTAMP);
}

void StageTimer::collect(Frame& frame, bool wait) {
  if (!frame.pending) return;
  if (!wait) {
    // Time stamps come in order, so the last one written tells for all.
    size_t last = frame.written.size() - 1;
    while (!frame.written[last]) --last;
    GLint there = 0;
    glGetQueryObjectiv(frame.queries[last], GL_QUERY_RESULT_AVAILABLE, &there);
    if (!there) return;
  }
  frame.pending = false;
  GLuint64 before = 0;
  glGetQueryObjectui64v(frame.queries[0], GL_QUERY_RESULT, &before);
  for (size_t i = 1; i < frame.queries.size(); ++i) {
    ms_[i - 1] = 0;
    if (!frame.written[i]) continue;
    GLuint64 now = 0;
    glGetQueryObjectui64v(frame.queries[i], GL_QUERY_RESULT, &now);
    if (now > before) ms_[i - 1] = static_cast<double>(now - before) * 1e-6;
    before = std::max(before, now);
  }
}

const std::vector<double>& StageTimer::results(bool wait) {
  if (!available_) return ms_;
  if (wait) {
    collect(frames_[frame_], true);
  } else {
    for (int i = 1; i <= kFrames; ++i) collect(frames_[(frame_ + i) % kFrames], false);  // oldest first
  }
  return ms_;
}

}  // namespace telesplat::gl
