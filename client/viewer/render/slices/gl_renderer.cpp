#include "client/viewer/render/slices/gl_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "client/viewer/render/gl/frame_targets.h"
#include "client/viewer/render/gl/program.h"
#include "client/viewer/render/gl/shaders/common.h"
#include "client/viewer/render/gl/shaders/slices.h"
#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/volume/warp/plan.h"

namespace telesplat::viewer {
namespace {

// One layer in the shader (std140).
struct LayerRecord {
  float row_x[4], row_y[4], row_w[4], range[4];
};
static_assert(sizeof(LayerRecord) == 64);

Result<gl::Program> make_program() {
  const std::string constants =
      fmt::format("#define MAX_LAYERS {}\n#define NEAREST_W {:.9e}\n#define SOLID {:.9e}\n#define DONE {:.9e}\n",
                  volume::kMaxLayers, volume::kWarpNearestW, volume::kSolid,
                  1 - float(volume::kWarpDone) / float(volume::kWarpOpaque));
  return gl::Program::link("volume warp",
                           {{GL_VERTEX_SHADER, {shaders::kVersion, shaders::kVolumeVertex}},
                            {GL_FRAGMENT_SHADER, {shaders::kVersion, constants, shaders::kVolumeFragment}}});
}

}  // namespace

struct VolumeGlRenderer::Parts {
  Parts(gl::Program made, bool software) : program(std::move(made)), read_back(!software) {
    glGenVertexArrays(1, &no_vertices);
    glGenBuffers(1, &records);
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest_side);
  }
  ~Parts() {
    release_target();
    glDeleteTextures(1, &images);
    glDeleteBuffers(1, &records);
    glDeleteVertexArrays(1, &no_vertices);
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  void release_target() {
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(2, targets);
    framebuffer = targets[0] = targets[1] = 0;
    width = height = 0;
  }
  Status resize(int new_width, int new_height);
  Status upload(const volume::VolumeFrame& frame);
  void draw(const volume::VolumeFrame* frame, const geometry::Camera& camera, uint32_t background);

  gl::Program program;
  ReadBack read_back;
  GLint largest_side = 0;
  uint32_t no_vertices = 0, records = 0;
  uint32_t framebuffer = 0, targets[2] = {};  // colour, depth
  int width = 0, height = 0;

  uint32_t images = 0;  // array texture, one slice for each layer
  int images_width = 0, images_height = 0, slices = 0;
  // The frame that `images` holds.
  const volume::VolumeFrame* held = nullptr;
  FrameId held_frame;
  EpochId held_epoch;
  const uint32_t* held_texels = nullptr;

  size_t layers_drawn = 0;
};

Status VolumeGlRenderer::Parts::resize(int new_width, int new_height) {
  if (new_width == width && new_height == height) return ok_status();
  release_target();
  if (std::max(new_width, new_height) > largest_side)
    return Error{fmt::format("a frame of {}x{} pixels, the GPU's limit is {}", new_width, new_height, largest_side)};
  glGenTextures(2, targets);
  glGenFramebuffers(1, &framebuffer);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  constexpr std::array<GLenum, 2> kAttachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  for (size_t i = 0; i < 2; ++i) {
    glBindTexture(GL_TEXTURE_2D, targets[i]);
    glTexStorage2D(GL_TEXTURE_2D, 1, i == 0 ? GL_RGBA8 : GL_R32F, new_width, new_height);
    glFramebufferTexture2D(GL_FRAMEBUFFER, kAttachments[i], GL_TEXTURE_2D, targets[i], 0);
  }
  glDrawBuffers(2, kAttachments.data());
  const GLenum state = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (state != GL_FRAMEBUFFER_COMPLETE) {
    release_target();
    return Error{fmt::format("a frame buffer of {}x{} pixels is incomplete: {:#x}", new_width, new_height, state)};
  }
  width = new_width, height = new_height;
  return ok_status();
}

Status VolumeGlRenderer::Parts::upload(const volume::VolumeFrame& frame) {
  const uint32_t* texels = frame.layers.empty() ? nullptr : frame.layers[0].texels.data();
  if (&frame == held && frame.frame == held_frame && frame.epoch == held_epoch && texels == held_texels)
    return ok_status();
  held = nullptr;
  int most_x = 1, most_y = 1;
  const int count = std::max(static_cast<int>(frame.layers.size()), 1);
  for (const auto& layer : frame.layers)
    most_x = std::max(most_x, layer.pitch), most_y = std::max(most_y, layer.rows());
  if (std::max(most_x, most_y) > largest_side)
    return Error{fmt::format("layers of {}x{} texels, the GPU's limit is {}", most_x, most_y, largest_side)};
  if (most_x > images_width || most_y > images_height || count > slices) {
    glDeleteTextures(1, &images);
    glGenTextures(1, &images);
    glBindTexture(GL_TEXTURE_2D_ARRAY, images);
    // Rounded up, since sizes vary a little from frame to frame.
    const auto roomy = [&](int side) { return std::min((side + 255) / 256 * 256, static_cast<int>(largest_side)); };
    images_width = roomy(most_x), images_height = roomy(most_y), slices = count;
    while (glGetError() != GL_NO_ERROR) {
    }
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA8, images_width, images_height, slices);
    if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
      const Error refused{
          fmt::format("{} layers of {}x{} texels: error {:#x}", slices, images_width, images_height, error)};
      images_width = images_height = slices = 0;
      return refused;
    }
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D_ARRAY, filter, GL_LINEAR);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
      glTexParameteri(GL_TEXTURE_2D_ARRAY, wrap, GL_CLAMP_TO_EDGE);
  }
  glBindTexture(GL_TEXTURE_2D_ARRAY, images);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  for (size_t i = 0; i < frame.layers.size(); ++i) {
    const auto& layer = frame.layers[i];
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, static_cast<GLint>(i), layer.pitch, layer.rows(), 1, GL_BGRA,
                    GL_UNSIGNED_INT_8_8_8_8_REV, layer.texels.data());
  }
  held = &frame, held_frame = frame.frame, held_epoch = frame.epoch, held_texels = texels;
  return ok_status();
}

void VolumeGlRenderer::Parts::draw(const volume::VolumeFrame* frame, const geometry::Camera& camera,
                                   uint32_t background) {
  std::vector<LayerRecord> layers;
  for (const auto& placed : frame ? volume::place_layers(*frame, camera) : std::vector<volume::PlacedLayer>()) {
    // w is at most about 1, as the shader's limit assumes.
    double most = 0;
    for (const auto& [x, y] : {std::pair{0, 0}, {width, 0}, {0, height}, {width, height}})
      most = std::max(most, glm::dot(placed.to_texel[2], glm::dvec3(x, y, 1)));
    if (!(most > 0)) continue;
    const glm::dmat3 rows = placed.to_texel / most;
    LayerRecord record{};
    for (int i = 0; i < 3; ++i) {
      record.row_x[i] = static_cast<float>(rows[0][i]);
      record.row_y[i] = static_cast<float>(rows[1][i]);
      record.row_w[i] = static_cast<float>(rows[2][i]);
    }
    record.range[0] = static_cast<float>(placed.image->rect.width + 1);
    record.range[1] = static_cast<float>(placed.image->rect.height + 1);
    record.range[2] = static_cast<float>(placed.depth / most);
    record.range[3] = static_cast<float>(placed.image - frame->layers.data());
    layers.push_back(record);
  }
  layers_drawn = layers.size();
  layers.resize(volume::kMaxLayers);
  glBindBuffer(GL_UNIFORM_BUFFER, records);
  glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(layers.size() * sizeof(LayerRecord)), layers.data(),
               GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, records);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D_ARRAY, images);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  program.use();
  glUniform1i(0, static_cast<GLint>(layers_drawn));
  const auto unit = [&](int shift) { return static_cast<float>(background >> shift & 255) / 255; };
  glUniform3f(1, unit(16), unit(8), unit(0));
  glBindVertexArray(no_vertices);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Result<std::unique_ptr<VolumeGlRenderer>> VolumeGlRenderer::make() {
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  const gl::EglContext::Current current(**context);
  if (!current.ok()) return Error{(*context)->renderer() + ": cannot be made current"};
  auto program = make_program();
  if (!program) return Error{(*context)->renderer() + ": " + program.error().text};
  auto parts = std::make_unique<Parts>(std::move(*program), (*context)->software());
  glDisable(GL_DITHER);
  return std::unique_ptr<VolumeGlRenderer>(new VolumeGlRenderer(std::move(*context), std::move(parts)));
}

VolumeGlRenderer::VolumeGlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Parts> parts)
    : context_(std::move(context)), parts_(std::move(parts)) {}

VolumeGlRenderer::~VolumeGlRenderer() {
  const gl::EglContext::Current current(*context_);
  parts_.reset();
}

volume::WarpStats VolumeGlRenderer::render(const volume::VolumeFrame* frame, const geometry::Camera& camera,
                                           uint32_t background, const volume::WarpTarget& target) {
  CHECK(target.width == camera.width && target.height == camera.height && target.colour);
  const gl::EglContext::Current current(*context_);
  const double start = monotonic_s();
  const auto pixels = static_cast<size_t>(target.width) * static_cast<size_t>(target.height);
  Status ready = parts_->resize(target.width, target.height);
  if (ready && frame) ready = parts_->upload(*frame);
  if (!ready) {
    if (refusals_.allow(start)) log::error("{}: {}", device(), ready.error().text);
    std::fill_n(target.colour, pixels, background & 0xffffffu);
    if (target.depth_m) std::fill_n(target.depth_m, pixels, std::numeric_limits<float>::infinity());
    return {};
  }
  volume::WarpStats stats;
  stats.prepare_ms = (monotonic_s() - start) * 1e3;
  parts_->draw(frame, camera, background);
  parts_->read_back.read(parts_->framebuffer, {target.width, target.height, target.colour, target.depth_m});
  stats.images = parts_->layers_drawn;
  stats.samples = pixels * parts_->layers_drawn;
  stats.warp_ms = stats.warp_cpu_ms = (monotonic_s() - start) * 1e3;
  return stats;
}

}  // namespace telesplat::viewer
