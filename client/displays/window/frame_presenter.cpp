#include "client/displays/window/frame_presenter.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <utility>

namespace telesplat::viewer {
namespace {

// The first row of a frame is the uppermost one, the first row of a texture the lowest.
constexpr const char* kVertexShader = R"(#version 330 core
uniform vec2 part;  // of the frame's width: where it begins, how much it is
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
  place = vec2(part.x + part.y * corner.x, 1.0 - corner.y);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
})";
constexpr const char* kFragmentShader = R"(#version 330 core
uniform sampler2D frame;
uniform bool keeps_alpha;
in vec2 place;
out vec4 colour;
void main() {
  vec4 texel = texture(frame, place);
  colour = vec4(texel.rgb, keeps_alpha ? texel.a : 1.0);
}
)";

}  // namespace

Result<std::unique_ptr<FramePresenter>> FramePresenter::make() {
  auto program =
      gl::Program::link("window", {{GL_VERTEX_SHADER, {kVertexShader}}, {GL_FRAGMENT_SHADER, {kFragmentShader}}});
  if (!program) return program.error();
  std::unique_ptr<FramePresenter> out(new FramePresenter);
  out->program_ = std::move(*program);
  out->keeps_alpha_ = out->program_.uniform("keeps_alpha");
  out->part_ = out->program_.uniform("part");
  glGenVertexArrays(1, &out->vertex_array_);
  return out;
}

FramePresenter::~FramePresenter() {
  resize(0, 0);
  load_overlays({});
  glDeleteVertexArrays(1, &vertex_array_);
}

void FramePresenter::resize(int width, int height) {
  width_ = width;
  height_ = height;
  glDeleteTextures(1, &texture_);
  texture_ = 0;
  if (width == 0) return;
  glGenTextures(1, &texture_);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, nullptr);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

void FramePresenter::load_overlays(const Overlays& overlays) {
  for (const auto& [name, texture] : overlay_textures_) glDeleteTextures(1, &texture);
  overlay_textures_.clear();
  for (const auto& [name, overlay] : overlays.all()) {
    const image::View& picture = overlay.picture;
    uint32_t& texture = overlay_textures_[name];
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, picture.width, picture.height, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV,
                 picture.colour.data());
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  }
  overlay_version_ = overlays.version();
}

// Precondition: the frame's program and vertices are bound.
void FramePresenter::draw_overlays(const Overlays& overlays, int width, int height, int hidden) {
  if (overlays.version() != overlay_version_) load_overlays(overlays);
  if (overlay_textures_.empty()) return;
  glUniform1i(keeps_alpha_, 1);
  glUniform2f(part_, 0, 1);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  for (const auto& [name, overlay] : overlays.all()) {
    const auto place = place_overlay(overlay, width, height, hidden);
    glViewport(place.x, height - place.y - place.height, place.width, place.height);
    glBindTexture(GL_TEXTURE_2D, overlay_textures_[name]);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  glDisable(GL_BLEND);
}

void FramePresenter::draw(const image::View& view, int width, int height, const Overlays& overlays, int hidden) {
  if (view.width != width_ || view.height != height_) resize(view.width, view.height);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, width_, height_, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, view.colour.data());
  const bool same = view.width == (two_eyes_ ? 2 * width : width) && view.height == height;
  const GLint filter = same ? GL_NEAREST : GL_LINEAR;
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, filter);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  if (!two_eyes_) return draw_part(0, 1, width, height, overlays, hidden);
  for (const auto& [buffer, begin] : {std::pair{GL_BACK_LEFT, 0.0f}, {GL_BACK_RIGHT, 0.5f}}) {
    glDrawBuffer(GLenum(buffer));
    draw_part(begin, 0.5f, width, height, overlays, hidden);
    glBindTexture(GL_TEXTURE_2D, texture_);
  }
  glDrawBuffer(GL_BACK);  // both buffers, for drawing over the frame
}

// Draws a part of the frame's width over the whole buffer.
void FramePresenter::draw_part(float begin, float share, int width, int height, const Overlays& overlays, int hidden) {
  glViewport(0, 0, width, height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  program_.use();
  glUniform1i(keeps_alpha_, 0);
  glUniform2f(part_, begin, share);
  glBindVertexArray(vertex_array_);
  if (hidden > 0) {
    glEnable(GL_SCISSOR_TEST);
    glScissor(hidden, 0, std::max(0, width - hidden), height);
  }
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_SCISSOR_TEST);
  draw_overlays(overlays, width, height, hidden);
}

}  // namespace telesplat::viewer
