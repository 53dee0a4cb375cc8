#include "client/viewer/render/gl/program.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

namespace telesplat::gl {
namespace {

const char* stage_name(uint32_t kind) {
  return kind == GL_VERTEX_SHADER ? "vertex" : kind == GL_FRAGMENT_SHADER ? "fragment" : "compute";
}

// Attaches the compiled stage to `program`, where it lives until the program is deleted.
Status attach(std::string_view name, const ShaderSource& source, GLuint program) {
  const GLuint shader = glCreateShader(source.kind);
  std::vector<const char*> texts;
  std::vector<GLint> lengths;
  for (const std::string_view part : source.parts) {
    texts.push_back(part.data());
    lengths.push_back(static_cast<GLint>(part.size()));
  }
  glShaderSource(shader, static_cast<GLsizei>(texts.size()), texts.data(), lengths.data());
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok) glAttachShader(program, shader);
  char log[2048] = {};
  if (!ok) glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  glDeleteShader(shader);
  if (!ok)
    return Error{fmt::format("the {} shader of \"{}\" does not compile: {}", stage_name(source.kind), name, log)};
  return ok_status();
}

}  // namespace

Result<Program> Program::link(std::string_view name, const std::vector<ShaderSource>& stages) {
  Program program(glCreateProgram());
  for (const ShaderSource& stage : stages)
    if (const Status attached = attach(name, stage, program.id_); !attached) return attached.error();
  glLinkProgram(program.id_);
  GLint ok = 0;
  glGetProgramiv(program.id_, GL_LINK_STATUS, &ok);
  if (!ok) {
    char log[2048] = {};
    glGetProgramInfoLog(program.id_, sizeof log, nullptr, log);
    return Error{fmt::format("the program \"{}\" does not link: {}", name, log)};
  }
  return program;
}

Program::~Program() {
  if (id_) glDeleteProgram(id_);
}

void Program::use() const { glUseProgram(id_); }

int32_t Program::uniform(const char* name) const { return glGetUniformLocation(id_, name); }

}  // namespace telesplat::gl
