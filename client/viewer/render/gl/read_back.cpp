#include "client/viewer/render/gl/read_back.h"

#include <epoxy/gl.h>

#include <cstring>

namespace telesplat::viewer {

ReadBack::~ReadBack() {
  if (buffers_[0]) glDeleteBuffers(2, buffers_);
}

void ReadBack::read_image(uint32_t attachment, bool is_colour, const splat::FrameTarget& target, void* to) {
  glReadBuffer(attachment);
  if (is_colour)  // 0xAARRGGBB in a word, on machines of either byte order
    glReadPixels(0, 0, target.width, target.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, to);
  else
    glReadPixels(0, 0, target.width, target.height, GL_RED, GL_FLOAT, to);
}

void ReadBack::read(uint32_t framebuffer, const splat::FrameTarget& target) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  for (const GLenum whole : {GL_PACK_ROW_LENGTH, GL_PACK_SKIP_ROWS, GL_PACK_SKIP_PIXELS, GL_PACK_SWAP_BYTES})
    glPixelStorei(whole, 0);
  if (target.row() != static_cast<size_t>(target.width) && !pack_buffers_)
    glPixelStorei(GL_PACK_ROW_LENGTH, static_cast<GLint>(target.row()));
  const int images = target.depth_m ? 2 : 1;
  void* const to[2] = {target.colour, target.depth_m};
  if (!pack_buffers_) {
    glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
    for (int i = 0; i < images; ++i) read_image(GL_COLOR_ATTACHMENT0 + static_cast<uint32_t>(i), i == 0, target, to[i]);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    return;
  }
  const size_t bytes = static_cast<size_t>(target.width) * static_cast<size_t>(target.height) * 4;
  if (!buffers_[0]) glGenBuffers(2, buffers_);
  if (bytes != bytes_)
    for (const uint32_t buffer : buffers_) {
      glBindBuffer(GL_PIXEL_PACK_BUFFER, buffer);
      glBufferData(GL_PIXEL_PACK_BUFFER, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_READ);
    }
  bytes_ = bytes;
  for (int i = 0; i < images; ++i) {
    glBindBuffer(GL_PIXEL_PACK_BUFFER, buffers_[i]);
    read_image(GL_COLOR_ATTACHMENT0 + static_cast<uint32_t>(i), i == 0, target, nullptr);
  }
  for (int i = 0; i < images; ++i) {
    glBindBuffer(GL_PIXEL_PACK_BUFFER, buffers_[i]);
    if (const void* from = glMapBufferRange(GL_PIXEL_PACK_BUFFER, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_READ_BIT)) {
      const size_t row = static_cast<size_t>(target.width) * 4;
      for (size_t y = 0; y < static_cast<size_t>(target.height); ++y)
        std::memcpy(static_cast<char*>(to[i]) + y * target.row() * 4, static_cast<const char*>(from) + y * row, row);
      glUnmapBuffer(GL_PIXEL_PACK_BUFFER);
    } else {
      glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
      glPixelStorei(GL_PACK_ROW_LENGTH, static_cast<GLint>(target.row()));
      read_image(GL_COLOR_ATTACHMENT0 + static_cast<uint32_t>(i), i == 0, target, to[i]);
      glPixelStorei(GL_PACK_ROW_LENGTH, 0);
    }
  }
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
}

}  // namespace telesplat::viewer
