#include "client/viewer/render/gl/gl_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/splat/splat_table.h"

namespace telesplat::viewer {
namespace {

constexpr int kMargin = splat::kMaxSplatSide;  // GL drops points whose centre is outside, however large they are

template <class T>
void stream(GLenum target, uint32_t buffer, const std::vector<T>& data) {
  glBindBuffer(target, buffer);
  glBufferData(target, static_cast<GLsizeiptr>(data.size() * sizeof(T)), data.data(), GL_STREAM_DRAW);
}

}  // namespace

Result<std::unique_ptr<GlRenderer>> GlRenderer::make() {
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  auto current = std::make_unique<Current>(**context);
  if (!current->ok()) return Error{(*context)->renderer() + ": cannot be made current"};
  const auto program = make_splat_program();
  if (!program) return Error{(*context)->renderer() + ": " + program.error().text};
  return std::unique_ptr<GlRenderer>(new GlRenderer(std::move(*context), std::move(current), *program));
}

GlRenderer::GlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Current> current,
                       const SplatProgram& program)
    : context_(std::move(context)),
      current_(std::move(current)),
      program_(program),
      arenas_(std::make_unique<PointArenas>()) {
  glGenFramebuffers(1, &framebuffer_);
  glGenVertexArrays(1, &vertex_array_);
  for (uint32_t* buffer : {&draw_numbers_, &draw_records_, &commands_, &intensities_}) glGenBuffers(1, buffer);
  glBindVertexArray(vertex_array_);
  glBindBuffer(GL_ARRAY_BUFFER, draw_numbers_);
  glEnableVertexAttribArray(0);
  glVertexAttribIPointer(0, 1, GL_UNSIGNED_INT, 0, nullptr);
  glVertexAttribDivisor(0, 1);  // one a draw: indirect draws start at their baseInstance
  glEnable(GL_PROGRAM_POINT_SIZE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_GREATER);
}

GlRenderer::~GlRenderer() {
  arenas_.reset();
  for (uint32_t buffer : {draw_numbers_, draw_records_, commands_, intensities_}) glDeleteBuffers(1, &buffer);
  glDeleteTextures(3, textures_);
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteVertexArrays(1, &vertex_array_);
  glDeleteProgram(program_.program);
}

Status GlRenderer::resize(int width, int height) {
  if (width == width_ && height == height_) return ok_status();
  width_ = height_ = 0;
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  if (std::max(width, height) + 2 * kMargin > largest)
    return Error{fmt::format("a frame of {}x{} pixels and its margin exceed the GPU's {}", width, height, largest)};
  glDeleteTextures(3, textures_);
  glGenTextures(3, textures_);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  const GLenum formats[3] = {GL_R32UI, GL_R32F, GL_DEPTH_COMPONENT32F};
  const GLenum attachments[3] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_DEPTH_ATTACHMENT};
  for (int i = 0; i < 3; ++i) {
    glBindTexture(GL_TEXTURE_2D, textures_[i]);
    glTexStorage2D(GL_TEXTURE_2D, 1, formats[i], width + 2 * kMargin, height + 2 * kMargin);
    glFramebufferTexture2D(GL_FRAMEBUFFER, attachments[i], GL_TEXTURE_2D, textures_[i], 0);
  }
  if (const GLenum state = glCheckFramebufferStatus(GL_FRAMEBUFFER); state != GL_FRAMEBUFFER_COMPLETE)
    return Error{fmt::format("a frame buffer of {}x{} pixels is incomplete: {:#x}", width, height, state)};
  width_ = width;
  height_ = height;
  return ok_status();
}

void GlRenderer::prepare_draws(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel) {
  const bool disc = kernel == splat::Kernel::kDisc;
  runs_.build(list.items, camera);
  records_.resize(list.items.size());
  for (auto& commands : commands_by_arena_) commands.clear();
  for (size_t r = 0; r < runs_.runs.size(); ++r) {
    const splat::LeafTransform& t = runs_.transforms[r];
    for (uint32_t i = runs_.runs[r].first; i < runs_.runs[r].last; ++i) {
      const splat::DrawItem& item = list.items[i];
      if (item.level.count == 0) continue;
      const PointRange range = arenas_->place(item);
      const float diameter = disc ? splat::disc_diameter(item.splat_px) : 0.0f;
      const int side = disc ? static_cast<int>(std::ceil(diameter)) : splat::square_side(item.splat_px);
      DrawRecord& d = records_[i];
      std::copy(t.x.begin(), t.x.end(), d.row_x);
      std::copy(t.y.begin(), t.y.end(), d.row_y);
      std::copy(t.w.begin(), t.w.end(), d.row_w);
      d.word = range.word;
      d.count = item.arrays().count;
      d.side = side;
      d.diameter = diameter;
      d.bias_growth = static_cast<float>(splat::splat_bias_growth(side, camera.focal_x()));
      d.sub_steps = 1 << splat::sub_bits(side);
      if (commands_by_arena_.size() <= range.arena) commands_by_arena_.resize(range.arena + 1);
      commands_by_arena_[range.arena].push_back({item.level.count, 1, item.first, i});
    }
  }
}

void GlRenderer::draw(const geometry::Camera& camera, const image::Shading& shading, bool with_depth) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  const GLenum buffers[2] = {GL_COLOR_ATTACHMENT0, with_depth ? GLenum{GL_COLOR_ATTACHMENT1} : GLenum{GL_NONE}};
  glDrawBuffers(2, buffers);
  glViewport(0, 0, width_ + 2 * kMargin, height_ + 2 * kMargin);
  const GLuint background[4] = {0xff000000u | shading.background(), 0, 0, 0};
  const GLfloat nothing[4] = {std::numeric_limits<float>::infinity(), 0, 0, 0}, farthest = 0.0f;
  glClearBufferuiv(GL_COLOR, 0, background);
  if (with_depth) glClearBufferfv(GL_COLOR, 1, nothing);
  glClearBufferfv(GL_DEPTH, 0, &farthest);
  if (records_.empty()) return;

  glUseProgram(program_.program);
  glUniform2f(program_.frame_size, static_cast<float>(width_ + 2 * kMargin), static_cast<float>(height_ + 2 * kMargin));
  glUniform1f(program_.margin, static_cast<float>(kMargin));
  glUniform1f(program_.near_m, static_cast<float>(camera.near_m));
  glBindVertexArray(vertex_array_);
  if (draw_number_count_ < records_.size()) {
    std::vector<uint32_t> numbers(records_.size() * 2);
    std::iota(numbers.begin(), numbers.end(), 0u);
    stream(GL_ARRAY_BUFFER, draw_numbers_, numbers);
    draw_number_count_ = numbers.size();
  }
  stream(GL_SHADER_STORAGE_BUFFER, draw_records_, records_);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, intensities_);
  glBufferData(GL_SHADER_STORAGE_BUFFER, 65536, shading.table().data(), GL_STREAM_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, draw_records_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, intensities_);
  for (uint32_t arena = 0; arena < commands_by_arena_.size(); ++arena) {
    const auto& commands = commands_by_arena_[arena];
    if (commands.empty()) continue;
    stream(GL_DRAW_INDIRECT_BUFFER, commands_, commands);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, arenas_->buffer(arena));
    glMultiDrawArraysIndirect(GL_POINTS, nullptr, static_cast<GLsizei>(commands.size()), 0);
  }
}

void GlRenderer::read_back(const splat::FrameTarget& target) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(kMargin, kMargin, width_, height_, GL_RED_INTEGER, GL_UNSIGNED_INT, target.colour);
  if (!target.depth_m) return;
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(kMargin, kMargin, width_, height_, GL_RED, GL_FLOAT, target.depth_m);
}

splat::SplatStats GlRenderer::render(const splat::DrawList& list, const geometry::Camera& camera,
                                     const splat::RenderOptions& options, const image::Shading& shading, const splat::FrameTarget& target) {
  CHECK(target.width == camera.width && target.height == camera.height && target.colour);
  const double start = monotonic_s();
  if (const Status resized = resize(target.width, target.height); !resized) {
    // A frame that the GPU cannot hold shows nothing, rather than ending the viewer.
    if (refusals_.allow(start)) log::error("{}", resized.error().text);
    std::fill_n(target.colour, static_cast<size_t>(target.width) * target.height, 0xff000000u | shading.background());
    if (target.depth_m)
      std::fill_n(target.depth_m, static_cast<size_t>(target.width) * target.height,
                  std::numeric_limits<float>::infinity());
    return {};
  }
  prepare_draws(list, camera, options.kernel);
  draw(camera, shading, target.depth_m != nullptr);
  arenas_->end_frame();
  glFinish();
  const double drawn = monotonic_s();
  read_back(target);
  splat::SplatStats stats;
  stats.points_projected = stats.points_drawn = list.points;
  stats.project_ms = (drawn - start) * 1e3;
  stats.resolve_ms = (monotonic_s() - drawn) * 1e3;
  return stats;
}

}  // namespace telesplat::viewer
