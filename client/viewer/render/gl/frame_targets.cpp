#include "client/viewer/render/gl/frame_targets.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "common/splat/flat/splat_table.h"

namespace telesplat::viewer {

static_assert(FrameTargets::kMargin >= splat::kMaxSplatSide);

FrameTargets::~FrameTargets() { release(); }

void FrameTargets::release() {
  glDeleteFramebuffers(kBuffers, framebuffers_);  // zeros are ignored
  glDeleteTextures(kTextures, textures_);
  std::fill_n(framebuffers_, static_cast<int>(kBuffers), 0u);
  std::fill_n(textures_, static_cast<int>(kTextures), 0u);
  width_ = height_ = 0;
}

void FrameTargets::make_texture(Texture which, uint32_t format, bool padded) {
  glGenTextures(1, &textures_[which]);
  glBindTexture(GL_TEXTURE_2D, textures_[which]);
  const int margin = padded ? 2 * kMargin : 0;
  glTexStorage2D(GL_TEXTURE_2D, 1, format, width_ + margin, height_ + margin);
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    glTexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
}

Status FrameTargets::make_framebuffer(Buffer which, const uint32_t* colours, int count, bool with_depth_test) {
  glGenFramebuffers(1, &framebuffers_[which]);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffers_[which]);
  constexpr std::array<GLenum, 2> kAttachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  for (int i = 0; i < count; ++i)
    glFramebufferTexture2D(GL_FRAMEBUFFER, kAttachments[static_cast<size_t>(i)], GL_TEXTURE_2D, colours[i], 0);
  if (with_depth_test)
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, textures_[kVisible], 0);
  if (count > 0) {
    glDrawBuffers(count, kAttachments.data());
  } else {
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
  }
  if (const GLenum state = glCheckFramebufferStatus(GL_FRAMEBUFFER); state != GL_FRAMEBUFFER_COMPLETE)
    return Error{fmt::format("a frame buffer of {}x{} pixels is incomplete: {:#x}", width_, height_, state)};
  return ok_status();
}

Status FrameTargets::resize(int width, int height) {
  if (width == width_ && height == height_) return ok_status();
  release();
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (std::max(width, height) + 2 * kMargin > largest)
    return Error{fmt::format("a frame of {}x{} pixels and its margin exceed the GPU's {}", width, height, largest)};
  width_ = width, height_ = height;
  make_texture(kKeys, GL_RG32UI, true);
  make_texture(kVisible, GL_DEPTH_COMPONENT32F, true);
  make_texture(kPairs0, GL_RG32UI, true);
  make_texture(kPairs1, GL_RG32UI, true);
  make_texture(kColour, GL_RGBA8, false);
  make_texture(kDepth, GL_R32F, false);
  const auto make = [&](Buffer which, Texture first, int count, bool with_depth_test) {
    return make_framebuffer(which, &textures_[first], count, with_depth_test);
  };
  for (const Status& made :
       {make(kSplat, kKeys, 1, true), make(kVisibility, kKeys, 0, true), make(kPair0, kPairs0, 1, false),
        make(kPair1, kPairs1, 1, false), make(kOutput, kColour, 2, false), make(kOutputColour, kColour, 1, false)})
    if (!made) {
      const Error error = made.error();
      release();
      return error;
    }
  return ok_status();
}

Status FrameTargets::make_sums() {
  if (textures_[kSums0]) return ok_status();
  make_texture(kSums0, GL_RGBA32F, true);
  make_texture(kSums1, GL_RGBA32F, true);
  const Status made = make_framebuffer(kSumming, &textures_[kSums0], 2, false);
  if (!made) release();  // otherwise the next frame would count them as complete
  return made;
}

void FrameTargets::draw_to(Buffer buffer) const {
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffers_[buffer]);
  const bool padded = buffer != kOutput && buffer != kOutputColour;
  glViewport(0, 0, padded ? padded_width() : width_, padded ? padded_height() : height_);
}

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
