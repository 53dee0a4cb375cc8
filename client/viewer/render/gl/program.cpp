#include "client/viewer/render/gl/program.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <string>

#include "common/splat/splat_table.h"

namespace telesplat::viewer {
namespace {

// The same arithmetic as common/splat/projection-inl.h, in the same order: `precise` forbids fusing.
constexpr const char* kVertexShader = R"(#version 430 core
struct Draw {
  vec4 row_x, row_y, row_w;
  uint word, count;
  int side;
  float diameter, bias_growth;
  int sub_steps, unused0, unused1;
};
layout(std430, binding = 0) readonly buffer Points { uint points[]; };
layout(std430, binding = 1) readonly buffer Draws { Draw draws[]; };
layout(std430, binding = 2) readonly buffer Intensities { uint intensities[]; };
layout(location = 0) in uint draw_number;
uniform vec2 frame_size;
uniform float margin;
uniform float near_m;

flat out uint colour;
flat out float depth_m;
flat out ivec2 first_pixel;  // of the square, margin included
flat out vec2 centre;        // of the splat, from that pixel's corner
flat out vec2 shape;         // bias growth; squared radius, or 0 for a square

uint half_word(uint i) { return (points[i >> 1] >> ((i & 1u) * 16u)) & 0xffffu; }

float row(vec4 r, vec3 p) {
  precise float xy = p.x * r.x + p.y * r.y;
  precise float h = (xy + p.z * r.z) + r.w;
  return h;
}

void main() {
  Draw d = draws[draw_number];
  uint i = uint(gl_VertexID);
  uint first_half = 2u * d.word;
  vec3 p = vec3(half_word(first_half + i), half_word(first_half + d.count + i), half_word(first_half + 2u * d.count + i));
  depth_m = row(d.row_w, p);
  precise float inverse = float(d.sub_steps) / max(depth_m, near_m);
  float shift = float(d.sub_steps) * 0.5 * float(1 - d.side);
  precise float fixed_x = row(d.row_x, p) * inverse + shift;
  precise float fixed_y = row(d.row_y, p) * inverse + shift;
  ivec2 fixed_place = ivec2(clamp(floor(vec2(fixed_x, fixed_y)), -1e6, 1e6));
  int bits = findMSB(d.sub_steps);
  ivec2 pixel = fixed_place >> bits;
  first_pixel = pixel + int(margin);
  centre = (vec2(fixed_place - (pixel << bits)) + 0.5) / float(d.sub_steps) + 0.5 * float(d.side - 1);
  shape = d.side == 1 ? vec2(0) : vec2(d.bias_growth, 0.25 * d.diameter * d.diameter);

  uint albedo = points[d.word + 2u * d.count + i];
  uint normal = half_word(first_half + 3u * d.count + i);
  uint light = (intensities[normal >> 2] >> ((normal & 3u) * 8u)) & 255u;
  uvec3 rgb = (uvec3(albedo >> 16, albedo >> 8, albedo) & 255u) * light + 127u;
  rgb /= 255u;
  colour = 0xff000000u | rgb.r << 16 | rgb.g << 8 | rgb.b;

  bool seen = depth_m >= near_m;
  vec2 middle = (vec2(first_pixel) + 0.5 * float(d.side)) / frame_size;
  gl_Position = seen ? vec4(middle * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = float(d.side);
}
)";

constexpr const char* kFragmentShader = R"(#version 430 core
flat in uint colour;
flat in float depth_m;
flat in ivec2 first_pixel;
flat in vec2 centre;
flat in vec2 shape;
uniform float near_m;
layout(location = 0) out uint out_colour;
layout(location = 1) out float out_depth_m;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) - first_pixel;
  vec2 d = vec2(pixel) + 0.5 - centre;
  float r2 = dot(d, d);
  if (shape.y > 0.0 && r2 > shape.y && pixel != ivec2(centre)) discard;
  uint bias = min(uint(floor(shape.x * r2 + 0.5)), MAX_BIASu) << BIAS_SHIFT;
  gl_FragDepth = near_m / uintBitsToFloat(floatBitsToUint(depth_m) + bias);
  out_colour = colour;
  out_depth_m = depth_m;
}
)";

Result<uint32_t> compile(GLenum kind, const std::string& source) {
  const GLuint shader = glCreateShader(kind);
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok) return shader;
  char log[1024] = {};
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  glDeleteShader(shader);
  return Error{
      fmt::format("the {} shader does not compile: {}", kind == GL_VERTEX_SHADER ? "vertex" : "fragment", log)};
}

std::string with_constants(std::string source) {
  const auto replace = [&](const std::string& name, const std::string& value) {
    for (size_t at; (at = source.find(name)) != std::string::npos;) source.replace(at, name.size(), value);
  };
  replace("MAX_BIAS", std::to_string(splat::kMaxBias));
  replace("BIAS_SHIFT", std::to_string(splat::kBiasShift));
  return source;
}

}  // namespace

Result<SplatProgram> make_splat_program() {
  const auto vertex = compile(GL_VERTEX_SHADER, kVertexShader);
  if (!vertex) return vertex.error();
  const auto fragment = compile(GL_FRAGMENT_SHADER, with_constants(kFragmentShader));
  if (!fragment) {
    glDeleteShader(*vertex);
    return fragment.error();
  }
  SplatProgram out;
  out.program = glCreateProgram();
  glAttachShader(out.program, *vertex);
  glAttachShader(out.program, *fragment);
  glLinkProgram(out.program);
  glDeleteShader(*vertex);
  glDeleteShader(*fragment);
  GLint ok = 0;
  glGetProgramiv(out.program, GL_LINK_STATUS, &ok);
  if (!ok) {
    char log[1024] = {};
    glGetProgramInfoLog(out.program, sizeof log, nullptr, log);
    glDeleteProgram(out.program);
    return Error{fmt::format("the splatting program does not link: {}", log)};
  }
  out.frame_size = glGetUniformLocation(out.program, "frame_size");
  out.margin = glGetUniformLocation(out.program, "margin");
  out.near_m = glGetUniformLocation(out.program, "near_m");
  return out;
}

}  // namespace telesplat::viewer
