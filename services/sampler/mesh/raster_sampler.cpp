// EGL off-screen G-buffer: the mesh sampler for machines with a graphics card.
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <glm/gtc/type_ptr.hpp>
#include <unordered_map>

#include "common/core/log.h"
#include "common/gl/egl_context.h"
#include "services/sampler/mesh/chunk_input.h"
#include "services/sampler/mesh/raster_shaders.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/tiles/masked_image.h"

namespace telesplat::sampler {
namespace {

constexpr int kLargestPart = 4096;  // pixels a side that are rendered at once; larger tiles are rendered in parts

class RasterSampler final : public Sampler {
 public:
  static Result<std::unique_ptr<Sampler>> make();
  ~RasterSampler() override;

  const char* name() const override { return "raster"; }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override;
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override;
  void remove_chunk(ChunkId id) override;
  void show(const std::vector<ChunkId>& chunks) override {
    for (auto& [id, drawable] : chunks_) drawable.shown = false;
    for (const ChunkId id : chunks)
      if (const auto found = chunks_.find(id); found != chunks_.end()) found->second.shown = true;
  }
  void set_colours(std::shared_ptr<const scene::ColourTable> colours) override;
  void set_clip(const geometry::Clip& clip) override { clip_ = clip; }
  image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                           const image::PixelMask* mask = nullptr) override;

 private:
  // A chunk in OpenGL: its decoded bytes as they are, in one buffer.
  struct Drawable {
    GLuint buffer = 0, vertex_array = 0;
    GLuint vertices = 0;
    GLsizei indices = 0;
    bool scalars = false;
    geometry::Box box_room;
    bool shown = true;
  };

  explicit RasterSampler(std::unique_ptr<gl::EglContext> context) : context_(std::move(context)) {}
  Status build_program();
  void reserve_targets(int width, int height);
  Status upload(ChunkId id, std::span<const std::byte> coded);
  static void release(Drawable& drawable);
  void set_planes(const glm::dvec3& eye_room) const;
  void draw(const geometry::Camera& camera, const geometry::Rect& part);
  void read(const geometry::Rect& from, size_t to, std::vector<float>& depth_m, image::DepthImage& out) const;
  GLint uniform(const char* name) const { return glGetUniformLocation(program_, name); }

  std::unique_ptr<gl::EglContext> context_;
  GLuint program_ = 0, framebuffer_ = 0;
  GLuint targets_[4] = {};  // depth in metres, colour, normal, the rasteriser's depth buffer
  int target_width_ = 0, target_height_ = 0, largest_part_ = kLargestPart;
  GLint64 largest_chunk_bytes_ = 0;
  GLuint colour_buffer_ = 0;                           // holds colours_
  std::shared_ptr<const scene::ColourTable> colours_;  // null: no colours were set yet
  std::unordered_map<ChunkId, Drawable> chunks_;
  geometry::Clip clip_;
};

Result<GLuint> compile(GLenum stage, const char* source) {
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled) return shader;
  char text[1024] = "";
  glGetShaderInfoLog(shader, sizeof text, nullptr, text);
  glDeleteShader(shader);
  return Error{fmt::format("the raster sampler's shader does not compile: {}", text)};
}

Result<std::unique_ptr<Sampler>> RasterSampler::make() {
  auto context = gl::EglContext::make();
  if (!context) return context.error();
  std::unique_ptr<RasterSampler> sampler(new RasterSampler(std::move(*context)));
  const gl::EglContext::Current current(*sampler->context_);
  if (!current.ok()) return Error{"the off-screen OpenGL context cannot be made current"};
  if (const Status built = sampler->build_program(); !built.ok()) return built.error();

  glGenFramebuffers(1, &sampler->framebuffer_);
  glGenRenderbuffers(4, sampler->targets_);
  GLint side = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &side);
  sampler->largest_part_ = std::min(kLargestPart, side);
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &sampler->largest_chunk_bytes_);
  glGenBuffers(1, &sampler->colour_buffer_);
  sampler->set_colours(nullptr);
  log::info("raster sampler on {}", sampler->context_->renderer());
  return std::unique_ptr<Sampler>(std::move(sampler));
}

Status RasterSampler::build_program() {
  const auto vertex = compile(GL_VERTEX_SHADER, kVertexShader), fragment = compile(GL_FRAGMENT_SHADER, kFragmentShader);
  if (!vertex) return vertex.error();
  if (!fragment) return fragment.error();
  program_ = glCreateProgram();
  glAttachShader(program_, *vertex);
  glAttachShader(program_, *fragment);
  glLinkProgram(program_);
  glDeleteShader(*vertex);
  glDeleteShader(*fragment);
  GLint linked = 0;
  glGetProgramiv(program_, GL_LINK_STATUS, &linked);
  if (linked) return ok_status();
  char text[1024] = "";
  glGetProgramInfoLog(program_, sizeof text, nullptr, text);
  return Error{fmt::format("the raster sampler's program does not link: {}", text)};
}

RasterSampler::~RasterSampler() {
  const gl::EglContext::Current current(*context_);
  if (!current.ok()) return;
  for (auto& [id, drawable] : chunks_) release(drawable);
  glDeleteBuffers(1, &colour_buffer_);
  glDeleteRenderbuffers(4, targets_);
  glDeleteFramebuffers(1, &framebuffer_);
  glDeleteProgram(program_);
}

void RasterSampler::release(Drawable& drawable) {
  glDeleteVertexArrays(1, &drawable.vertex_array);
  glDeleteBuffers(1, &drawable.buffer);
}

Status RasterSampler::upload(ChunkId id, std::span<const std::byte> coded) {
  const auto held = hold(id, coded);
  if (!held) return held.error();
  const geometry::MeshChunkView& view = held->view;
  const size_t bytes = geometry::chunk_bytes(view.vertices(), view.triangles());
  if (static_cast<GLint64>(bytes) > largest_chunk_bytes_)
    return Error{fmt::format("chunk {} of {} bytes refused: the graphics card's limit is {}", id.value, bytes,
                             largest_chunk_bytes_)};

  Drawable made{0, 0, static_cast<GLuint>(view.vertices()), static_cast<GLsizei>(view.indices.size()), view.scalars,
                {}};
  for (size_t i = 0; i < view.positions_room.size(); i += 3)
    made.box_room.extend(glm::vec3(view.positions_room[i], view.positions_room[i + 1], view.positions_room[i + 2]));
  while (glGetError() != GL_NO_ERROR) continue;
  glGenVertexArrays(1, &made.vertex_array);
  glBindVertexArray(made.vertex_array);
  glGenBuffers(1, &made.buffer);
  glBindBuffer(GL_ARRAY_BUFFER, made.buffer);
  const auto* first = reinterpret_cast<const std::byte*>(view.positions_room.data()) - sizeof(geometry::ChunkHeader);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), first, GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, made.buffer);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 12, reinterpret_cast<const void*>(sizeof(geometry::ChunkHeader)));
  glEnableVertexAttribArray(0);
  glBindVertexArray(0);
  if (const GLenum error = glGetError(); error != GL_NO_ERROR) {
    release(made);
    return Error{fmt::format("chunk {} of {} bytes refused: OpenGL error {:#x}", id.value, bytes, error)};
  }
  if (const auto old = chunks_.find(id); old != chunks_.end()) release(old->second);
  chunks_[id] = made;
  return ok_status();
}

Status RasterSampler::add_chunk(ChunkId id, geometry::ChunkBytes chunk) {
  const gl::EglContext::Current current(*context_);
  if (!current.ok()) return Error{"the off-screen OpenGL context is lost"};
  return upload(id, chunk.bytes);
}

Status RasterSampler::add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) {
  const gl::EglContext::Current current(*context_);
  if (!current.ok()) return Error{"the off-screen OpenGL context is lost"};
  Refusals refusals(chunks.size());
  for (auto& [id, chunk] : chunks)
    if (const Status status = upload(id, chunk.bytes); !status.ok()) refusals.add(status.error());
  return refusals.status();
}

void RasterSampler::remove_chunk(ChunkId id) {
  const auto found = chunks_.find(id);
  if (found == chunks_.end()) return;
  const gl::EglContext::Current current(*context_);
  if (current.ok()) release(found->second);
  chunks_.erase(found);
}

void RasterSampler::set_colours(std::shared_ptr<const scene::ColourTable> colours) {
  if (!colours) colours = neutral_colours();
  if (colours == colours_) return;
  const gl::EglContext::Current current(*context_);
  if (!current.ok()) return;
  colours_ = std::move(colours);
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, colour_buffer_);
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(colours_->colours.size() * sizeof(uint32_t)),
               colours_->colours.data(), GL_STATIC_DRAW);
}

void RasterSampler::reserve_targets(int width, int height) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  if (width <= target_width_ && height <= target_height_) return;
  target_width_ = std::max(width, target_width_), target_height_ = std::max(height, target_height_);
  constexpr GLenum kFormats[4] = {GL_R32F, GL_R32UI, GL_R16UI, GL_DEPTH_COMPONENT32F};
  constexpr GLenum kPlaces[4] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2, GL_DEPTH_ATTACHMENT};
  for (int i = 0; i < 4; ++i) {
    glBindRenderbuffer(GL_RENDERBUFFER, targets_[i]);
    glRenderbufferStorage(GL_RENDERBUFFER, kFormats[i], target_width_, target_height_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, kPlaces[i], GL_RENDERBUFFER, targets_[i]);
  }
  glDrawBuffers(3, kPlaces);
}

// Sets the clip's planes: the rasteriser cuts off all that lies outside.
void RasterSampler::set_planes(const glm::dvec3& eye_room) const {
  static_assert(geometry::Clip::kMostPlanes == 8, "as the shader has it");
  glm::vec4 planes[geometry::Clip::kMostPlanes]{};
  for (size_t i = 0; i < geometry::Clip::kMostPlanes; ++i) {
    const bool on = i < clip_.planes.size();
    if (on) planes[i] = {clip_.planes[i].normal, clip_.planes[i].inside_m(eye_room)};
    on ? glEnable(GL_CLIP_DISTANCE0 + GLenum(i)) : glDisable(GL_CLIP_DISTANCE0 + GLenum(i));
  }
  glUniform4fv(uniform("clip"), GLsizei(geometry::Clip::kMostPlanes), glm::value_ptr(planes[0]));
}

// Draws `part` of the camera's image and leaves the rest as it was.
void RasterSampler::draw(const geometry::Camera& camera, const geometry::Rect& part) {
  glViewport(0, 0, camera.width, camera.height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(part.x, part.y, part.width, part.height);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DITHER);
  constexpr GLfloat kNothing = 0, kFar = 1;
  constexpr GLuint kZero[4] = {};
  glClearBufferfv(GL_COLOR, 0, &kNothing);
  glClearBufferuiv(GL_COLOR, 1, kZero);
  glClearBufferuiv(GL_COLOR, 2, kZero);
  glClearBufferfv(GL_DEPTH, 0, &kFar);

  glUseProgram(program_);
  const glm::vec3 eye(camera.pose.position_room);
  const glm::mat3 to_camera(glm::mat3_cast(glm::conjugate(camera.pose.orientation)));
  glUniform3fv(uniform("eye_room"), 1, glm::value_ptr(eye));
  glUniformMatrix3fv(uniform("to_camera"), 1, GL_FALSE, glm::value_ptr(to_camera));
  glUniform4f(uniform("frustum"), float(camera.left), float(camera.right), float(camera.bottom), float(camera.top));
  glUniform1f(uniform("near_m"), float(camera.near_m));
  set_planes(camera.pose.position_room);
  glUniform2f(uniform("size_pixels"), float(camera.width), float(camera.height));
  glUniform3f(uniform("range"), colours_->lo, colours_->scale, colours_->offset);
  glUniform1ui(uniform("entries"), GLuint{scene::ColourTable::kEntries});
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, colour_buffer_);
  const GLint vertices = uniform("vertices"), scalars = uniform("scalars");

  // Visible chunks, nearest first, so that the depth test spares hidden fragments.
  const geometry::Frustum frustum(geometry::crop(camera, part));
  std::vector<std::pair<float, const Drawable*>> visible;
  for (const auto& [id, drawable] : chunks_)
    if (drawable.shown && frustum.may_contain(drawable.box_room))
      visible.emplace_back(glm::length(glm::clamp(eye, drawable.box_room.lo, drawable.box_room.hi) - eye), &drawable);
  std::sort(visible.begin(), visible.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [distance, drawable] : visible) {
    glBindVertexArray(drawable->vertex_array);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, drawable->buffer);
    glUniform1ui(vertices, drawable->vertices);
    glUniform1i(scalars, drawable->scalars);
    const size_t first_index = sizeof(geometry::ChunkHeader) + 20 * size_t{drawable->vertices};
    glDrawElements(GL_TRIANGLES, drawable->indices, GL_UNSIGNED_INT, reinterpret_cast<const void*>(first_index));
  }
  glBindVertexArray(0);
}

// Copies the part `from` of the targets to the pixels of the image that begin at `to`.
void RasterSampler::read(const geometry::Rect& from, size_t to, std::vector<float>& depth_m,
                         image::DepthImage& out) const {
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ROW_LENGTH, out.width);
  const auto read_plane = [&](GLenum source, GLenum format, GLenum type, void* pixels) {
    glReadBuffer(source);
    glReadPixels(from.x, from.y, from.width, from.height, format, type, pixels);
  };
  read_plane(GL_COLOR_ATTACHMENT0, GL_RED, GL_FLOAT, depth_m.data() + to);
  read_plane(GL_COLOR_ATTACHMENT1, GL_RED_INTEGER, GL_UNSIGNED_INT, out.colour.data() + to);
  read_plane(GL_COLOR_ATTACHMENT2, GL_RED_INTEGER, GL_UNSIGNED_SHORT, out.normal.data() + to);
}

// With a mask, draws only the smallest rectangle that holds it: fragments are shaded many at a time, so that to discard
// single ones would save little.
image::DepthImage RasterSampler::sample(const geometry::Camera& camera, const geometry::Rect& tile,
                                        const image::PixelMask* mask) {
  image::DepthImage out(tile.width, tile.height);
  const geometry::Rect wanted = mask ? bounds(*mask) : geometry::Rect{0, 0, tile.width, tile.height};
  const gl::EglContext::Current current(*context_);
  if (!current.ok() || wanted.width == 0) return out;
  std::vector<float> depth_m(out.pixels());
  for (int y = 0; y < tile.height; y += largest_part_)
    for (int x = 0; x < tile.width; x += largest_part_) {
      const int width = std::min(largest_part_, tile.width - x), height = std::min(largest_part_, tile.height - y);
      const int left = std::max(x, wanted.x), right = std::min(x + width, wanted.x + wanted.width);
      const int top = std::max(y, wanted.y), bottom = std::min(y + height, wanted.y + wanted.height);
      if (left >= right || top >= bottom) continue;
      const geometry::Rect part{left - x, top - y, right - left, bottom - top};
      reserve_targets(width, height);
      draw(geometry::crop(camera, {tile.x + x, tile.y + y, width, height}), part);
      read(part, size_t(top) * tile.width + left, depth_m, out);
    }
  for (size_t i = 0; i < depth_m.size(); ++i) {
    if (depth_m[i] > 0)
      out.depth[i] = image::encode_depth(depth_m[i], camera.near_m);
    else
      out.colour[i] = 0, out.normal[i] = 0;  // nothing there; or a driver's NaN
  }
  if (mask) keep_only(*mask, out);
  return out;
}

}  // namespace

Result<std::unique_ptr<Sampler>> make_raster_sampler() { return RasterSampler::make(); }

Result<std::unique_ptr<Sampler>> make_sampler(const std::string& kind, int threads) {
  if (kind == "ray") return make_ray_sampler(threads);
  if (kind == "raster") return make_raster_sampler();
  if (kind != "auto") return Error{fmt::format("sampler is \"{}\" instead of auto, ray or raster", kind)};
  const auto context = gl::EglContext::make();
  if (context && !(*context)->software()) return make_raster_sampler();
  return make_ray_sampler(threads);
}

}  // namespace telesplat::sampler
