#include "client/displays/window/panel/gui/gui.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "client/displays/window/panel/gui/style.h"
#include "client/viewer/render/gl/program.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr double kPeriod_s = 0.1;  // plots and figures are rebuilt this often without events
constexpr size_t kMostWaiting = 4096;
constexpr int kAfterEvent = 2;  // builds after an event: hovering and layouts settle in the second

// The texture has the window's size; both have their first row at the bottom.
constexpr const char* kVertexShader = R"(#version 330 core
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
  gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
})";
constexpr const char* kFragmentShader = R"(#version 330 core
uniform sampler2D drawn;
out vec4 colour;
void main() { colour = texelFetch(drawn, ivec2(gl_FragCoord.xy), 0); }
)";

// A key, or a character (then only `code` is set).
struct Typed {
  int code = 0, scancode = 0, action = 0, mods = 0;
  bool character = false;

  bool releases() const { return !character && action == GLFW_RELEASE; }
  // True if the key acts on the letters typed before it.
  bool acts() const {
    return !character && action == GLFW_PRESS &&
           ((code >= GLFW_KEY_ESCAPE && code <= GLFW_KEY_END) || code == GLFW_KEY_KP_ENTER ||
            (mods & (GLFW_MOD_CONTROL | GLFW_MOD_ALT | GLFW_MOD_SUPER)));
  }
};

// Part of the window, screen coordinates.
struct Area {
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  bool empty() const { return right <= left || bottom <= top; }
  bool has(double x, double y) const { return x >= left && x < right && y >= top && y < bottom; }
  void add(const Area& a) {
    left = std::min(left, a.left), top = std::min(top, a.top);
    right = std::max(right, a.right), bottom = std::max(bottom, a.bottom);
  }
};

// Returns the area that a list of triangles covers.
Area area_of(const ImDrawList& list) {
  Area out;
  for (const ImDrawVert& v : list.VtxBuffer) {
    out.left = std::min(out.left, double(v.pos.x)), out.top = std::min(out.top, double(v.pos.y));
    out.right = std::max(out.right, double(v.pos.x)), out.bottom = std::max(out.bottom, double(v.pos.y));
  }
  return out;
}

}  // namespace

struct Gui::Impl {
  GLFWwindow* window = nullptr;
  ImGuiContext* context = nullptr;
  bool glfw = false, gl = false;  // parts of Dear ImGui that must be shut down
  gl::Program program;
  GLuint vertex_array = 0, texture = 0, framebuffer = 0;
  int width = 0, height = 0;  // size of the texture
  GuiStyle style;
  std::vector<Area> areas;  // areas of the ImGui windows that are shown
  Area shown;               // their union: the texture is empty elsewhere
  int opaque = 0;           // fully covered columns of pixels at the window's left
  double built_at_s = -1e9;
  int builds_due = kAfterEvent;
  std::deque<Typed> typed;  // not taken by a build yet, in their order
  bool expects_text = false, popup = false, closes_popup = false;

  ~Impl() {
    if (gl) ImGui_ImplOpenGL3_Shutdown();
    if (glfw) ImGui_ImplGlfw_Shutdown();
    if (context) ImGui::DestroyContext(context);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteTextures(1, &texture);
    glDeleteVertexArrays(1, &vertex_array);
  }

  void resize(int to_width, int to_height) {
    if (width == to_width && height == to_height) return;
    width = to_width, height = to_height;
    glDeleteTextures(1, &texture);
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
    if (!framebuffer) glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    shown = {0, 0, 1e9, 1e9};  // all, since the new texture's content is unknown
    builds_due = kAfterEvent;
  }

  // Confines drawing to an area, with a rim for soft edges, to the right of column `from`. False: nothing of it is
  // left.
  bool scissor(const Area& area, int from) const {
    const ImGuiIO& io = ImGui::GetIO();
    const double sx = io.DisplayFramebufferScale.x, sy = io.DisplayFramebufferScale.y;
    const auto pixel = [](double v, int most) { return int(within(v, 0.0, double(most))); };
    const int left = std::max(from, pixel(area.left * sx - 1, width)), top = pixel(area.top * sy - 1, height);
    const int right = pixel(area.right * sx + 2, width), bottom = pixel(area.bottom * sy + 2, height);
    if (right <= left || bottom <= top) return false;
    glScissor(left, height - bottom, right - left, bottom - top);
    return true;
  }
};

Gui::Gui(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Gui::~Gui() = default;

Result<std::unique_ptr<Gui>> Gui::make(GLFWwindow* window) {
  auto impl = std::make_unique<Impl>();
  auto program =
      gl::Program::link("panel", {{GL_VERTEX_SHADER, {kVertexShader}}, {GL_FRAGMENT_SHADER, {kFragmentShader}}});
  if (!program) return program.error();
  impl->program = std::move(*program);
  glGenVertexArrays(1, &impl->vertex_array);
  impl->window = window;
  impl->context = ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = io.LogFilename = nullptr;
  impl->glfw = ImGui_ImplGlfw_InitForOpenGL(window, false);
  if (!impl->glfw) return Error{"the panel cannot be shown: Dear ImGui does not take the window"};
  impl->gl = ImGui_ImplOpenGL3_Init("#version 330 core");
  if (!impl->gl) return Error{"the panel cannot be shown: Dear ImGui finds no OpenGL 3.3"};
  return std::unique_ptr<Gui>(new Gui(std::move(impl)));
}

void Gui::stir() { impl_->builds_due = kAfterEvent; }

// Keys pressed while nothing is shown would count as new later: so only releases are kept then.
void Gui::on_key(int key, int scancode, int action, int mods) {
  stir();
  if (action == GLFW_REPEAT) return;  // Dear ImGui repeats keys by itself
  if (action == GLFW_RELEASE || ((shows() || impl_->expects_text) && impl_->typed.size() < kMostWaiting))
    impl_->typed.push_back({key, scancode, action, mods, false});
}
void Gui::on_character(unsigned code) {
  stir();
  if ((shows() || impl_->expects_text) && impl_->typed.size() < kMostWaiting)
    impl_->typed.push_back({int(code), 0, 0, 0, true});
}
void Gui::expect_text(bool expected) { impl_->expects_text = expected; }
bool Gui::close_popup() {
  if (!impl_->popup || !shows()) return false;
  stir();
  return impl_->closes_popup = true;
}
void Gui::on_button(int button, int action, int mods) {
  stir();
  if (shows()) ImGui_ImplGlfw_MouseButtonCallback(impl_->window, button, action, mods);
}
void Gui::on_wheel(double x, double y) {
  stir();
  if (shows()) ImGui_ImplGlfw_ScrollCallback(impl_->window, x, y);
}
void Gui::on_focus(bool focused) {
  stir();
  if (focused) return;
  ImGuiIO& io = ImGui::GetIO();
  std::fill(std::begin(io.KeysDown), std::end(io.KeysDown), false);  // keys may be released elsewhere
  io.KeyCtrl = io.KeyShift = io.KeyAlt = io.KeySuper = false;
}
void Gui::on_enter(bool entered) {
  stir();
  ImGui_ImplGlfw_CursorEnterCallback(impl_->window, entered);
}
void Gui::on_move() { stir(); }

bool Gui::takes_pointer(double x, double y) const {
  return std::any_of(impl_->areas.begin(), impl_->areas.end(), [&](const Area& a) { return a.has(x, y); });
}
bool Gui::shows() const { return !impl_->areas.empty(); }
// State after the last build: WantTextInput is from the build before.
bool Gui::takes_text() const {
  return shows() && GImGui->WantTextInputNextFrame == 1 && GImGui->ActiveId &&
         GImGui->ActiveId == GImGui->InputTextState.ID;
}

bool Gui::due(double now_s) const { return impl_->builds_due > 0 || now_s - impl_->built_at_s >= kPeriod_s; }

// Dear ImGui takes all letters of a build before its keys, and reads key states when a build begins. So a build takes
// what was typed up to the first key that acts, and no key that acts twice. Letters wait for their text's focus, and
// all that was typed after them waits, too. Returns true if the next build has more to take.
bool Gui::take_typed() {
  Impl& m = *impl_;
  const bool takes = takes_text();
  std::vector<int> released;
  while (!m.typed.empty()) {
    const Typed t = m.typed.front();
    if (t.character && !takes && m.expects_text) return false;
    if (t.acts() && std::find(released.begin(), released.end(), t.code) != released.end()) return true;
    if (t.releases()) released.push_back(t.code);
    m.typed.pop_front();
    if (!t.character) ImGui_ImplGlfw_KeyCallback(m.window, t.code, t.scancode, t.action, t.mods);
    if (t.character && takes) ImGui_ImplGlfw_CharCallback(m.window, unsigned(t.code));
    if (t.acts()) break;
  }
  return !m.typed.empty();
}

void Gui::build_texture(const Place& place, const std::function<double()>& build) {
  Impl& m = *impl_;
  m.resize(place.width, place.height);
  ImGui_ImplGlfw_NewFrame();
  const double pixels_a_unit = std::max(0.1, double(ImGui::GetIO().DisplayFramebufferScale.x));
  if (m.style.fit(std::max(0.5, place.content_scale / pixels_a_unit), pixels_a_unit))
    ImGui_ImplOpenGL3_DestroyFontsTexture();
  ImGui_ImplOpenGL3_NewFrame();
  if (ImGui::GetIO().Fonts->TexID == nullptr) ImGui_ImplOpenGL3_CreateFontsTexture();
  const bool more = take_typed();
  ImGui::NewFrame();
  if (std::exchange(m.closes_popup, false) && !GImGui->OpenPopupStack.empty()) ImGui::ClosePopupToLevel(0, true);
  m.opaque = within(int(build() * pixels_a_unit), 0, place.width);
  m.popup = ImGui::IsPopupOpen(nullptr, ImGuiPopupFlags_AnyPopup);
  ImGui::Render();
  if (more) stir();
  const ImDrawData* drawn = ImGui::GetDrawData();
  glBindFramebuffer(GL_FRAMEBUFFER, m.framebuffer);
  glEnable(GL_SCISSOR_TEST);
  if (m.scissor(m.shown, 0)) {
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT);
  }
  glDisable(GL_SCISSOR_TEST);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());  // blended over nothing, so colours become premultiplied
  m.areas.clear();
  m.shown = {};
  for (int i = 0; i < drawn->CmdListsCount; ++i) {
    const Area area = area_of(*drawn->CmdLists[i]);
    if (area.empty()) continue;
    m.areas.push_back(area);
    m.shown.add(area);
  }
}

int Gui::prepare(const Place& place, double now_s, const std::function<double()>& build) {
  Impl& m = *impl_;
  if (!build) {
    m.areas.clear();
    m.opaque = 0;
    if (!m.expects_text)
      for (const Typed& t : std::exchange(m.typed, {}))
        if (t.releases()) ImGui_ImplGlfw_KeyCallback(m.window, t.code, t.scancode, t.action, t.mods);
    m.builds_due = kAfterEvent;  // for the next time that it is shown
    return 0;
  }
  if (due(now_s) || place.width != m.width || place.height != m.height) {
    m.builds_due = std::max(0, m.builds_due - 1);
    m.built_at_s = now_s;
    build_texture(place, build);
  }
  return m.opaque;
}

// Blending reads the frame, which costs most on software OpenGL: so opaque parts are drawn without it.
void Gui::show(const Place& place) {
  Impl& m = *impl_;
  if (!shows()) return;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, place.width, place.height);
  m.program.use();
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, m.texture);
  glBindVertexArray(m.vertex_array);
  glEnable(GL_SCISSOR_TEST);
  if (m.opaque > 0) {
    glScissor(0, 0, m.opaque, place.height);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  }
  if (m.scissor(m.shown, m.opaque)) {
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_BLEND);
  }
  glDisable(GL_SCISSOR_TEST);
}

}  // namespace telesplat::viewer
