#include "client/viewer/render/gl/splat_passes.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <bit>
#include <numeric>

#include "common/splat/ewa/shading.h"
#include "common/splat/surfel/splat.h"

namespace telesplat::viewer {
namespace {

// Fills in the values that do not depend on the place of the item's points.
DrawRecord record(const splat::ItemFigures& item) {
  DrawRecord d{};
  d.spacing = item.spacing;
  if (item.flat) {
    d.size = item.flat->size;
    d.side = item.flat->side;
    d.bias_growth = static_cast<float>(item.flat->bias_growth);
    d.sub_steps = 1 << item.flat->sub_bits;
  } else {
    std::copy(item.source.to_eye.begin(), item.source.to_eye.end(), d.source);
    d.source[3] = item.source.radius_m;
  }
  return d;
}

ClusterRecord record(const splat::LeafTransform& t, const glm::vec3& facing) {
  ClusterRecord cluster;
  std::copy(t.x.begin(), t.x.end(), cluster.row_x);
  std::copy(t.y.begin(), t.y.end(), cluster.row_y);
  std::copy(t.w.begin(), t.w.end(), cluster.row_w);
  cluster.facing[0] = facing.x, cluster.facing[1] = facing.y, cluster.facing[2] = facing.z, cluster.facing[3] = 0;
  return cluster;
}

void clear_depth_and_test() {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  const GLfloat farthest = 1.0f;
  glClearBufferfv(GL_DEPTH, 0, &farthest);
}

}  // namespace

SplatPasses::SplatPasses() {
  glGenBuffers(kStreams, streams_);
  glGenVertexArrays(1, &vertex_array_);
  glGenBuffers(1, &draw_numbers_);
  glBindVertexArray(vertex_array_);
  glBindBuffer(GL_ARRAY_BUFFER, draw_numbers_);
  glEnableVertexAttribArray(0);
  glVertexAttribIPointer(0, 1, GL_UNSIGNED_INT, 0, nullptr);
  glVertexAttribDivisor(0, 1);  // one value per draw: its baseInstance
  glBindVertexArray(0);
}

SplatPasses::~SplatPasses() {
  glDeleteVertexArrays(1, &vertex_array_);
  glDeleteBuffers(1, &draw_numbers_);
  glDeleteBuffers(kStreams, streams_);
}

void SplatPasses::send(Stream stream, const void* data, size_t bytes) {
  glBindBuffer(GL_COPY_WRITE_BUFFER, streams_[stream]);  // no other state depends on this binding
  glBufferData(GL_COPY_WRITE_BUFFER, static_cast<GLsizeiptr>(bytes), data, GL_STREAM_DRAW);
}

splat::RimBias SplatPasses::write_draws(const splat::DrawList& list, const geometry::Camera& camera,
                                        splat::Kernel kernel) {
  clusters_.clear();
  draws_.assign(list.items.size(), {});
  splat::FrameFigures figures(splat::traits_of(kernel), camera, list.scale);
  for (auto& commands : commands_by_arena_) commands.clear();
  for (uint32_t r = 0; r < runs_.runs.size(); ++r) {
    clusters_.push_back(record(runs_.transforms[r], runs_.facing[r]));
    for (uint32_t i = runs_.runs[r].first; i < runs_.runs[r].last; ++i) {
      const splat::DrawItem& item = list.items[i];
      if (item.level.count == 0) continue;
      const PointRange range = arenas_.place(item, list.replica);
      DrawRecord& d = draws_[i] = record(figures.add(item));
      d.word = range.word;
      d.count = item.arrays().count;
      d.cluster = r;
      if (commands_by_arena_.size() <= range.arena) commands_by_arena_.resize(range.arena + 1);
      commands_by_arena_[range.arena].push_back({item.level.count, 1, item.first, i});
    }
  }
  send(kDraws, draws_.data(), draws_.size() * sizeof(DrawRecord));
  send(kClusters, clusters_.data(), clusters_.size() * sizeof(ClusterRecord));
  std::vector<DrawCommand> commands;
  for (const auto& of_arena : commands_by_arena_) commands.insert(commands.end(), of_arena.begin(), of_arena.end());
  send(kCommands, commands.data(), commands.size() * sizeof(DrawCommand));
  return figures.rim();
}

void SplatPasses::write_view(const geometry::Camera& camera, const image::Shading& shading, float scale,
                             const splat::RimBias& rim) {
  const splat::SurfelCamera c = splat::surfel_camera(camera);
  ViewRecord v{};
  std::copy(c.right.begin(), c.right.end(), v.right);
  std::copy(c.down.begin(), c.down.end(), v.down);
  std::copy(c.forward.begin(), c.forward.end(), v.forward);
  v.focal[0] = c.focal_x, v.focal[1] = c.focal_y;
  v.centre[0] = c.centre_x, v.centre[1] = c.centre_y;
  v.step[0] = c.step_x, v.step[1] = c.step_y;
  const splat::EwaLight light = splat::ewa_light(shading.parameters(), c);
  v.light[0] = light.ambient, v.light[1] = light.head, v.light[2] = light.key;
  std::copy(light.key_direction.begin(), light.key_direction.end(), v.light_direction);
  v.frame_size[0] = static_cast<float>(camera.width + 2 * FrameTargets::kMargin);
  v.frame_size[1] = static_cast<float>(camera.height + 2 * FrameTargets::kMargin);
  v.size[0] = camera.width, v.size[1] = camera.height;
  v.near_m = static_cast<float>(camera.near_m);
  v.near_bits = std::bit_cast<uint32_t>(v.near_m);
  v.margin = FrameTargets::kMargin;
  v.background = shading.background();
  const splat::SpacingLimits limits = splat::spacing_limits(scale);
  std::copy(limits.begin(), limits.end(), v.spacing_limits);
  std::copy(rim.begin(), rim.end(), v.rim_bias);
  send(kView, &v, sizeof v);
  send(kIntensities, shading.table().data(), shading.table().size());
}

void SplatPasses::number_draws(size_t count) {
  if (draw_number_count_ >= count) return;
  std::vector<uint32_t> numbers(count * 2);
  std::iota(numbers.begin(), numbers.end(), 0u);
  glBindBuffer(GL_ARRAY_BUFFER, draw_numbers_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(numbers.size() * 4), numbers.data(), GL_STATIC_DRAW);
  draw_number_count_ = numbers.size();
}

void SplatPasses::prepare(const splat::DrawList& list, const geometry::Camera& camera, splat::Kernel kernel,
                          const image::Shading& shading) {
  runs_.build(list.items, camera);
  number_draws(list.items.size());
  const splat::RimBias rim = write_draws(list, camera, kernel);
  write_view(camera, shading, list.scale, rim);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, streams_[kView]);
  for (const Stream stream : {kDraws, kClusters, kIntensities})
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, stream, streams_[stream]);
}

void SplatPasses::draw_points(const gl::Program& program) {
  program.use();
  glBindVertexArray(vertex_array_);
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, streams_[kCommands]);
  size_t first = 0;
  for (uint32_t arena = 0; arena < commands_by_arena_.size(); ++arena) {
    const auto& commands = commands_by_arena_[arena];
    if (commands.empty()) continue;
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, arenas_.buffer(arena));
    glMultiDrawArraysIndirect(GL_POINTS, reinterpret_cast<const void*>(first * sizeof(DrawCommand)),
                              static_cast<GLsizei>(commands.size()), 0);
    first += commands.size();
  }
}

void SplatPasses::splat_keys(const FrameTargets& targets, const gl::Program& program) {
  targets.draw_to(FrameTargets::kSplat);
  const GLuint empty[4] = {~0u, ~0u, ~0u, ~0u};
  glClearBufferuiv(GL_COLOR, 0, empty);
  clear_depth_and_test();
  draw_points(program);
  glDisable(GL_DEPTH_TEST);
}

void SplatPasses::splat_sums(const FrameTargets& targets, const KernelPrograms& programs) {
  targets.draw_to(FrameTargets::kVisibility);
  clear_depth_and_test();
  draw_points(programs.splat);
  glDisable(GL_DEPTH_TEST);

  targets.draw_to(FrameTargets::kSumming);
  const GLfloat nothing[4] = {};
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_COLOR, 1, nothing);
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ONE);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, targets.visible());
  draw_points(programs.sum);
  glDisable(GL_BLEND);
}

void SplatPasses::splat(const FrameTargets& targets, const Programs& programs, splat::Kernel kernel) {
  glEnable(GL_PROGRAM_POINT_SIZE);
  if (splat::traits_of(kernel).passes == splat::Passes::kSums)
    splat_sums(targets, programs.of(kernel));
  else
    splat_keys(targets, programs.of(kernel).splat);
}

}  // namespace telesplat::viewer
