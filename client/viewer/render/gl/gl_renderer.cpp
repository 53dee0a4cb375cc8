#include "client/viewer/render/gl/gl_renderer.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "client/viewer/render/gl/frame_targets.h"
#include "client/viewer/render/gl/programs.h"
#include "client/viewer/render/gl/splat_passes.h"
#include "client/viewer/render/gl/stage_timer.h"
#include "common/core/check.h"
#include "common/core/clock.h"
#include "common/splat/finish.h"
#include "common/splat/flat/splat_table.h"

namespace telesplat::viewer {
namespace {

// Largest picture that may be a part of a still picture: 128 x 96 pixels, one more on each side, of 4 x 4 sub-pixels.
constexpr int64_t kPartPixels = 130 * 98 * 16;

Status check_limits() {
  if (epoxy_gl_version() < 43)
    return Error{fmt::format("OpenGL {}.{} instead of 4.3 or later", epoxy_gl_version() / 10, epoxy_gl_version() % 10)};
  GLfloat sizes[2] = {};
  glGetFloatv(GL_POINT_SIZE_RANGE, sizes);
  if (sizes[1] < static_cast<float>(splat::kMaxSplatSide))
    return Error{fmt::format("points of {} pixels at most instead of {}", sizes[1], splat::kMaxSplatSide)};
  return ok_status();
}

std::string device_name() {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name ? name : "no OpenGL context";
}

}  // namespace

struct GlRenderer::Parts {
  Parts(Programs made, std::optional<bool> pack_buffers)
      : programs(std::move(made)), read_back(pack_buffers.value_or(!gl::is_software(device_name()))), timer(kStages) {
    glGenVertexArrays(1, &no_vertices);
    glDisable(GL_DITHER);
    glPointParameteri(GL_POINT_SPRITE_COORD_ORIGIN, GL_UPPER_LEFT);
  }
  ~Parts() { glDeleteVertexArrays(1, &no_vertices); }

  Programs programs;
  // Frames, and parts of still pictures, come by turns: each has its own targets, so they are not remade.
  FrameTargets frame_targets, part_targets;
  FrameTargets* targets = &frame_targets;  // targets of the frame at hand
  SplatPasses splatting;
  ReadBack read_back;
  gl::StageTimer timer;
  uint32_t no_vertices = 0;  // vertex array of whole-frame passes
};

Result<std::unique_ptr<GlRenderer::Parts>> GlRenderer::make_parts(std::optional<bool> pack_buffers) {
  if (const Status good = check_limits(); !good) return Error{device_name() + ": " + good.error().text};
  auto programs = Programs::make();
  if (!programs) return Error{device_name() + ": " + programs.error().text};
  return std::make_unique<Parts>(std::move(*programs), pack_buffers);
}

Result<std::unique_ptr<GlRenderer>> GlRenderer::make(std::optional<bool> pack_buffers) {
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  const gl::EglContext::Current current(**context);
  if (!current.ok()) return Error{(*context)->renderer() + ": cannot be made current"};
  auto parts = make_parts(pack_buffers);
  if (!parts) return parts.error();
  std::string device = (*context)->renderer();
  return std::unique_ptr<GlRenderer>(new GlRenderer(std::move(*context), std::move(*parts), std::move(device)));
}

GlRenderer::GlRenderer(std::unique_ptr<gl::EglContext> context, std::unique_ptr<Parts> parts, std::string device)
    : context_(std::move(context)), parts_(std::move(parts)), device_(std::move(device)) {}

GlRenderer::~GlRenderer() {
  const gl::EglContext::Current current(*context_);
  parts_.reset();
}

void GlRenderer::shade_and_finish(const splat::RenderOptions& options, bool with_depth) {
  struct Step {
    const FramePass* pass;
    Stage stage;
    int reach;  // pixels around its own that the step reads
  };
  const bool sums = splat::traits_of(options.kernel).passes == splat::Passes::kSums;
  const Programs& programs = parts_->programs;
  std::vector<Step> steps{{sums ? &programs.of(options.kernel).resolve : &programs.keys, kResolving, 0}};
  if (options.finish.fill) steps.push_back({&programs.fill(gaps_to_fill(options.finish)), kFilling, splat::kFillReach});
  if (options.finish.smooth) steps.push_back({&programs.smooth, kSmoothing, 1});
  if (options.finish.antialias) steps.push_back({&programs.antialias, kAntialiasing, 1});

  const auto bind = [](uint32_t unit, uint32_t texture) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  if (sums) {
    bind(1, parts_->targets->sums(1));
    bind(0, parts_->targets->sums(0));
  } else {
    bind(0, parts_->targets->keys());
  }
  glBindVertexArray(parts_->no_vertices);
  glEnable(GL_SCISSOR_TEST);
  int reach = splat::finish_reach(options.finish);  // pixels around the image that the remaining steps read
  for (size_t i = 0; i < steps.size(); ++i) {
    const bool last = i + 1 == steps.size();
    reach -= steps[i].reach;
    if (last) {
      parts_->targets->draw_to(with_depth ? FrameTargets::kOutput : FrameTargets::kOutputColour);
      glScissor(0, 0, parts_->targets->width(), parts_->targets->height());
      steps[i].pass->to_output.use();
    } else {
      parts_->targets->draw_to(i % 2 ? FrameTargets::kPair1 : FrameTargets::kPair0);
      const int margin = FrameTargets::kMargin - reach;
      glScissor(margin, margin, parts_->targets->width() + 2 * reach, parts_->targets->height() + 2 * reach);
      steps[i].pass->to_pairs.use();
    }
    glDrawArrays(GL_TRIANGLES, 0, 3);
    parts_->timer.end_stage(steps[i].stage);
    if (!last) bind(0, parts_->targets->pairs(i % 2));
  }
  glDisable(GL_SCISSOR_TEST);
}

Status GlRenderer::draw(const splat::DrawList& list, const geometry::Camera& camera,
                        const splat::RenderOptions& options, const image::Shading& shading, bool with_depth) {
  const bool part = int64_t{camera.width} * camera.height <= kPartPixels;
  parts_->targets = part ? &parts_->part_targets : &parts_->frame_targets;
  if (const Status resized = parts_->targets->resize(camera.width, camera.height); !resized) return resized;
  if (splat::traits_of(options.kernel).passes == splat::Passes::kSums)
    if (const Status made = parts_->targets->make_sums(); !made) return made;
  const double start = monotonic_s();
  parts_->splatting.prepare(list, camera, options.kernel, shading);
  prepare_ms_ = (monotonic_s() - start) * 1e3;
  parts_->timer.begin_frame();
  parts_->splatting.splat(*parts_->targets, parts_->programs, options.kernel);
  parts_->timer.end_stage(kSplatting);
  shade_and_finish(options, with_depth);
  parts_->splatting.end_frame();
  return ok_status();
}

splat::SplatStats GlRenderer::stats(const splat::DrawList& list) {
  splat::SplatStats out;
  out.points_projected = out.points_drawn = list.points;
  const std::vector<double>& ms = parts_->timer.results();
  out.project_ms = prepare_ms_ + ms[kSplatting];
  out.resolve_ms = ms[kResolving];
  out.fill_ms = ms[kFilling];
  out.smooth_ms = ms[kSmoothing];
  out.antialias_ms = ms[kAntialiasing];
  return out;
}

splat::SplatStats GlRenderer::render(const splat::DrawList& list, const geometry::Camera& camera,
                                     const splat::RenderOptions& options, const image::Shading& shading,
                                     const splat::FrameTarget& target) {
  CHECK(target.width == camera.width && target.height == camera.height && target.colour);
  const gl::EglContext::Current current(*context_);
  const double start = monotonic_s();
  if (const Status drawn = draw(list, camera, options, shading, target.depth_m != nullptr); !drawn) {
    // If the GPU cannot hold a frame, the frame is empty, and the viewer goes on.
    if (refusals_.allow(start)) log::error("{}", drawn.error().text);
    for (size_t y = 0; y < static_cast<size_t>(target.height); ++y) {
      std::fill_n(target.colour + y * target.row(), target.width, 0xff000000u | shading.background());
      if (target.depth_m)
        std::fill_n(target.depth_m + y * target.row(), target.width, std::numeric_limits<float>::infinity());
    }
    return {};
  }
  if (!parts_->timer.available()) glFinish();
  const double drawn = monotonic_s();
  parts_->read_back.read(parts_->targets->framebuffer(FrameTargets::kOutput), target);
  const double end = monotonic_s();
  splat::SplatStats out = stats(list);
  if (!parts_->timer.available()) out.project_ms = (drawn - start) * 1e3;
  const double rest = (end - start) * 1e3 - out.project_ms - out.fill_ms - out.smooth_ms - out.antialias_ms;
  out.resolve_ms = std::max(out.resolve_ms, rest);
  return out;
}

}  // namespace telesplat::viewer
