#include "client/viewer/render/gl/stream_buffer.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "common/core/check.h"

namespace telesplat::gl {
namespace {

constexpr GLenum kTarget = GL_COPY_WRITE_BUFFER;  // no other state hangs on this binding

size_t offset_alignment() {
  GLint storage = 0, uniform = 0;
  glGetIntegerv(GL_SHADER_STORAGE_BUFFER_OFFSET_ALIGNMENT, &storage);
  glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &uniform);
  // Both are powers of two.
  return static_cast<size_t>(std::max({storage, uniform, 16}));
}

bool has_buffer_storage() { return epoxy_gl_version() >= 44 || epoxy_has_gl_extension("GL_ARB_buffer_storage"); }

}  // namespace

StreamBuffer::StreamBuffer(bool persistent)
    : persistent_(persistent && has_buffer_storage()), alignment_(offset_alignment()) {}

StreamBuffer::~StreamBuffer() {
  for (void* fence : fences_)
    if (fence) glDeleteSync(static_cast<GLsync>(fence));
  if (buffer_) glDeleteBuffers(1, &buffer_);  // unmaps it; the driver keeps it as long as the GPU reads it
}

void StreamBuffer::wait(int part) {
  const auto fence = static_cast<GLsync>(fences_[part]);
  if (!fence) return;
  while (glClientWaitSync(fence, GL_SYNC_FLUSH_COMMANDS_BIT, 1'000'000'000) == GL_TIMEOUT_EXPIRED) {
  }
  glDeleteSync(fence);
  fences_[part] = nullptr;
}

void StreamBuffer::reserve(size_t bytes) {
  if (bytes <= part_bytes_) return;
  part_bytes_ = padded(bytes + bytes / 2);
  if (!persistent_) {
    gathered_.resize(part_bytes_);
    if (!buffer_) glGenBuffers(1, &buffer_);
    return;
  }
  for (int part = 0; part < kParts; ++part) wait(part);
  if (buffer_) glDeleteBuffers(1, &buffer_);
  glGenBuffers(1, &buffer_);
  glBindBuffer(kTarget, buffer_);
  constexpr GLbitfield kAccess = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const auto size = static_cast<GLsizeiptr>(part_bytes_ * kParts);
  glBufferStorage(kTarget, size, nullptr, kAccess);
  mapped_ = static_cast<std::byte*>(glMapBufferRange(kTarget, 0, size, kAccess));
  if (mapped_) return;
  // A driver that offers the extension but cannot map this much: the other way always works.
  glDeleteBuffers(1, &buffer_);
  glGenBuffers(1, &buffer_);
  persistent_ = false;
  gathered_.resize(part_bytes_);
}

void StreamBuffer::begin(size_t bytes) {
  part_ = (part_ + 1) % kParts;
  used_ = 0;
  wait(part_);
  reserve(bytes);
}

StreamBuffer::Slice StreamBuffer::take(size_t bytes) {
  CHECK(used_ + bytes <= part_bytes_);
  const size_t first = persistent_ ? static_cast<size_t>(part_) * part_bytes_ : 0;
  Slice slice{(persistent_ ? mapped_ + first : gathered_.data()) + used_, static_cast<intptr_t>(first + used_), bytes};
  used_ = padded(used_ + bytes);
  return slice;
}

void StreamBuffer::commit() {
  if (persistent_) return;
  glBindBuffer(kTarget, buffer_);
  glBufferData(kTarget, static_cast<GLsizeiptr>(used_), gathered_.data(), GL_STREAM_DRAW);
}

void StreamBuffer::end() {
  if (persistent_) fences_[part_] = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
}

}  // namespace telesplat::gl
