#include "client/displays/window/window.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

#include "client/displays/window/frame_presenter.h"
#include "client/displays/window/open_window.h"
#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/within.h"
#include "common/gl/egl_context.h"

namespace telesplat::viewer {
namespace {

constexpr int kSmallestSide = 120;
constexpr int kSmallestPicture = 16;  // pixels a side: window managers need not respect kSmallestSide

std::string last_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "no reason given";
}

// Keeps GLFW initialised while it lives.
struct Library {
  const bool ready = glfwInit() == GLFW_TRUE;
  ~Library() {
    if (ready) glfwTerminate();
  }
};

std::atomic<bool> connection_lost{false};

// The driver sends pictures over Xlib's connection with XCB, and does not report a broken one to Xlib, whose next
// request would write through a bad pointer. And Mesa, which draws without a GPU, then cuts a picture into parts of
// size 0, for minutes or for ever. So XCB and its socket are checked before requests. Null: another window system.
struct Xcb {
  void* connection = nullptr;
  int socket = -1;
  int (*has_error)(void* connection) = nullptr;

  bool broken() const {
    if (!connection) return false;
    pollfd end{socket, POLLRDHUP, 0};
    return has_error(connection) || (poll(&end, 1, 0) == 1 && end.revents);
  }
} xcb;

// When its connection breaks, or a request is refused, Xlib writes a line and ends the process. With these handlers the
// window is lost and the viewer ends in order, or the window goes on. GLFW loads Xlib at run time; so its functions are
// looked up after that, and other window systems do not need it. Displays are only passed on, so they need no type.
void survive_broken_connection() {
  connection_lost = false;
  xcb = {};
  using Handler = int (*)(void* display);
  using ExitHandler = void (*)(void* display, void* data);
  void* const xlib = dlopen("libX11.so.6", RTLD_LAZY | RTLD_NOLOAD);
  void* const glfw = dlsym(RTLD_DEFAULT, "glfwGetX11Display");
  if (!xlib || !glfw) return;
  void* const display = reinterpret_cast<void* (*)()>(glfw)();
  void* const bridge = dlopen("libX11-xcb.so.1", RTLD_LAZY | RTLD_NOLOAD);
  using OfConnection = int (*)(void* connection);
  const auto connection_of = bridge ? reinterpret_cast<void* (*)(void*)>(dlsym(bridge, "XGetXCBConnection")) : nullptr;
  const auto socket_of = reinterpret_cast<OfConnection>(dlsym(xlib, "xcb_get_file_descriptor"));
  const auto has_error = reinterpret_cast<OfConnection>(dlsym(xlib, "xcb_connection_has_error"));
  if (display && connection_of && socket_of && has_error) {
    void* const connection = connection_of(display);
    xcb = {connection, socket_of(connection), has_error};
  }
  if (bridge) dlclose(bridge);
  const auto set_handler = reinterpret_cast<Handler (*)(Handler)>(dlsym(xlib, "XSetIOErrorHandler"));
  const auto set_exit = reinterpret_cast<void (*)(void*, ExitHandler, void*)>(dlsym(xlib, "XSetIOErrorExitHandler"));
  // If another program drops a file here and ends at once, its requests fail: the viewer must not end because of that.
  using ErrorHandler = int (*)(void* display, void* event);
  const auto set_error = reinterpret_cast<ErrorHandler (*)(ErrorHandler)>(dlsym(xlib, "XSetErrorHandler"));
  if (set_error)
    set_error([](void*, void*) {
      log::warn("the window system refused a request; the window goes on");
      return 0;
    });
  if (display && set_handler && set_exit) {
    set_handler([](void*) {
      connection_lost = true;
      return 0;
    });
    set_exit(
        display, [](void*, void*) {}, nullptr);
  }
  dlclose(xlib);
}

constexpr std::pair<int, Key> kGlfwKeys[] = {{GLFW_KEY_F1, Key::kF1},
                                             {GLFW_KEY_F11, Key::kF11},
                                             {GLFW_KEY_F12, Key::kF12},
                                             {GLFW_KEY_TAB, Key::kTab},
                                             {GLFW_KEY_ESCAPE, Key::kEscape},
                                             {GLFW_KEY_LEFT_SHIFT, Key::kShift},
                                             {GLFW_KEY_RIGHT_SHIFT, Key::kShift}};

std::optional<Key> key_of(int glfw_key) {
  for (const auto& [code, key] : kGlfwKeys)
    if (code == glfw_key) return key;
  for (const int first : {GLFW_KEY_1, GLFW_KEY_KP_1})
    if (glfw_key >= first && glfw_key < first + 8) return Key(int(Key::k1) + glfw_key - first);
  return glfw_key >= GLFW_KEY_A && glfw_key <= GLFW_KEY_Z ? letter_key(char(glfw_key)) : std::nullopt;
}

// Returns the print on a key, in upper case; 0: no Latin letter.
char letter_of(int glfw_key, int scancode) {
  const char* name = glfwGetKeyName(glfw_key, scancode);
  const char c = name && *name && !name[1] ? *name : '\0';
  if (c >= 'a' && c <= 'z') return char(c - 'a' + 'A');
  // A keyboard of another script has control letters where a US keyboard has them.
  return glfw_key >= GLFW_KEY_A && glfw_key <= GLFW_KEY_Z && (!c || (c & 0x80)) ? char(glfw_key) : '\0';
}

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

struct Place {
  int x = 0, y = 0, width = 0, height = 0;
};

struct Screen {
  GLFWmonitor* monitor = nullptr;
  const GLFWvidmode* mode = nullptr;  // null: no screen
};
// Returns the screen on which most of the window lies.
Screen screen_of(const Place& place) {
  int count = 0;
  GLFWmonitor** const monitors = glfwGetMonitors(&count);
  Screen out;
  int64_t most = -1;
  for (int i = 0; i < count; ++i) {
    int x = 0, y = 0;
    glfwGetMonitorPos(monitors[i], &x, &y);
    const GLFWvidmode* m = glfwGetVideoMode(monitors[i]);
    if (!m) continue;
    const int64_t width = std::min(x + m->width, place.x + place.width) - std::max(x, place.x);
    const int64_t height = std::min(y + m->height, place.y + place.height) - std::max(y, place.y);
    const int64_t common = std::max<int64_t>(0, width) * std::max<int64_t>(0, height);
    if (common > most) most = common, out = {monitors[i], m};
  }
  return out;
}

std::string upper_case(std::string name) {
  for (char& c : name)
    if (c >= 'a' && c <= 'z') c = char(c - 'a' + 'A');
  return name;
}

}  // namespace

struct Window::Impl {
  Library library;
  GLFWwindow* window = nullptr;
  std::unique_ptr<FramePresenter> presenter;
  Interaction* interaction = nullptr;  // while poll() runs
  bool pointer_caught = false, draws_without_gpu = false;
  std::optional<glm::dvec2> pointer;  // place from the last event, in screen coordinates; nothing: no event yet
  int hidden = 0;                     // columns of pixels at the left
  bool writes = false;                // the key pressed last belongs to a text
  std::unique_ptr<Gui> gui;
  Place before_fullscreen;
  bool moved = false;  // since its screen's refresh rate was last asked for
  std::vector<std::string> dropped;

  ~Impl() {
    if (window) glfwDestroyWindow(window);
  }

  void say_renderer(int width, int height) {
    const std::string_view renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    draws_without_gpu = gl::is_software(renderer);
    log::info("window: {}x{} pixels, {}", width, height, renderer);
  }

  static Impl& of(GLFWwindow* w) { return *static_cast<Impl*>(glfwGetWindowUserPointer(w)); }

  // Factor from screen coordinates to window heights.
  double per_height() const {
    int width = 0, height = 0;
    glfwGetWindowSize(window, &width, &height);
    return 1.0 / std::max(1, height);
  }

  // True if the panel gets this event. Tests the pointer's place at the event, because the pointer may have moved on.
  bool gui_takes_pointer() const {
    if (pointer_caught) return false;
    if (pointer) return gui->takes_pointer(pointer->x, pointer->y);
    double x = 0, y = 0;
    glfwGetCursorPos(window, &x, &y);
    return gui->takes_pointer(x, y);
  }

  // A letter goes to the text that has the focus or that the dialog waits for, else it is a command, never both: the
  // letter that opens the dialog must not be the first of its path.
  void on_key(int key, int scancode, int action, int mods) {
    if (!interaction) return;
    const bool dialog = interaction->open().dialog, field = gui->takes_text();
    if (action == GLFW_PRESS) writes = dialog || field;  // a held key goes on as it began
    if (action == GLFW_PRESS && key == GLFW_KEY_ESCAPE && gui->close_popup()) return;
    gui->on_key(key, scancode, action, mods);
    if (action == GLFW_REPEAT) return;
    const bool down = action == GLFW_PRESS;
    if (down && (mods & (GLFW_MOD_CONTROL | GLFW_MOD_ALT | GLFW_MOD_SUPER))) {
      const bool control = (mods & ~GLFW_MOD_SHIFT) == GLFW_MOD_CONTROL;
      const char letter = control ? letter_of(key, scancode) : '\0';
      if (letter && (!writes || letter == 'Q')) interaction->control(letter, mods & GLFW_MOD_SHIFT);
      return;
    }
    if (down && !writes && (mods & GLFW_MOD_SHIFT) && interaction->shifted(letter_of(key, scancode))) return;
    if (down && field && !(dialog && key == GLFW_KEY_ESCAPE)) return;
    if (const auto known = key_of(key)) interaction->key(*known, down);
    gui->expect_text(interaction->open().dialog);
  }

  void listen() {
    glfwSetWindowUserPointer(window, this);
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int scancode, int action, int mods) {
      of(w).on_key(key, scancode, action, mods);
    });
    glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) {
      if (of(w).writes) of(w).gui->on_character(code);
    });
    glfwSetCursorEnterCallback(window, [](GLFWwindow* w, int entered) { of(w).gui->on_enter(entered); });
    glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** paths) {
      of(w).dropped.insert(of(w).dropped.end(), paths, paths + count);
    });
    glfwSetWindowPosCallback(window, [](GLFWwindow* w, int, int) { of(w).moved = true; });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int mods) {
      of(w).gui->on_button(button, action, mods);
      if (action == GLFW_PRESS && of(w).gui_takes_pointer()) return;
      static constexpr std::pair<int, MouseButton> kButtons[] = {{GLFW_MOUSE_BUTTON_LEFT, MouseButton::kLeft},
                                                                 {GLFW_MOUSE_BUTTON_MIDDLE, MouseButton::kMiddle},
                                                                 {GLFW_MOUSE_BUTTON_RIGHT, MouseButton::kRight}};
      for (const auto& [code, known] : kButtons)
        if (code == button && of(w).interaction) of(w).interaction->button(known, action == GLFW_PRESS);
    });
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) {
      of(w).pointer = glm::dvec2(x, y);
      of(w).gui->on_move();
      if (of(w).interaction) of(w).interaction->move(x * of(w).per_height(), y * of(w).per_height());
    });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double across, double steps) {
      of(w).gui->on_wheel(across, steps);
      if (of(w).gui_takes_pointer()) return;
      if (of(w).interaction) of(w).interaction->wheel(steps);
    });
    glfwSetWindowFocusCallback(window, [](GLFWwindow* w, int focused) {
      of(w).gui->on_focus(focused);
      if (!focused && of(w).interaction) of(w).interaction->focus_lost();
    });
  }
};

Status check_display() {
  const auto set = [](const char* name) {
    const char* value = std::getenv(name);
    return value && *value;
  };
  if (!set("DISPLAY") && !set("WAYLAND_DISPLAY"))
    return Error{"there is no display to open a window on: neither DISPLAY nor WAYLAND_DISPLAY is set"};
  const Library library;
  if (library.ready) return ok_status();
  const char *x11 = std::getenv("DISPLAY"), *wayland = std::getenv("WAYLAND_DISPLAY");
  return Error{fmt::format("the display cannot be opened (DISPLAY is \"{}\", WAYLAND_DISPLAY \"{}\"): {}",
                           x11 ? x11 : "", wayland ? wayland : "", last_error())};
}

Result<std::unique_ptr<Window>> Window::open(const Options& o) {
  if (const Status s = check_display(); !s) return s.error();
  auto impl = std::make_unique<Impl>();
  if (!impl->library.ready) return Error{"no window system: " + last_error()};
  GLFWmonitor* monitor = o.fullscreen ? glfwGetPrimaryMonitor() : nullptr;
  const GLFWvidmode* mode = monitor ? glfwGetVideoMode(monitor) : nullptr;
  if (o.fullscreen && !mode) return Error{"there is no screen to fill: " + last_error()};
  std::string tried;
  // EGL comes first: a renderer's context without a window is EGL's too, and a thread can have current contexts of one
  // API only.
  for (const auto& [minor, api] : {std::pair{43, GLFW_EGL_CONTEXT_API},
                                   {43, GLFW_NATIVE_CONTEXT_API},
                                   {33, GLFW_EGL_CONTEXT_API},
                                   {33, GLFW_NATIVE_CONTEXT_API}}) {
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_CONTEXT_CREATION_API, api);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, minor / 10);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, minor % 10);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    for (const int unused : {GLFW_DEPTH_BITS, GLFW_STENCIL_BITS, GLFW_ALPHA_BITS}) glfwWindowHint(unused, 0);
    glfwWindowHintString(GLFW_X11_CLASS_NAME, "telesplat");
    glfwWindowHintString(GLFW_X11_INSTANCE_NAME, "telesplat");
    if (mode) glfwWindowHint(GLFW_REFRESH_RATE, mode->refreshRate);
    if (o.two_eyes && api == GLFW_EGL_CONTEXT_API) continue;  // EGL has no such buffers
    glfwWindowHint(GLFW_STEREO, o.two_eyes);
    impl->window = glfwCreateWindow(mode ? mode->width : o.width, mode ? mode->height : o.height, o.title.c_str(),
                                    monitor, nullptr);
    if (impl->window) break;
    tried += fmt::format("{}OpenGL {}.{} through {}: {}", tried.empty() ? "" : "; ", minor / 10, minor % 10,
                         api == GLFW_EGL_CONTEXT_API ? "EGL" : "the window system", last_error());
  }
  if (!impl->window)
    return Error{fmt::format("no window with {}OpenGL: {}", o.two_eyes ? "quad-buffered " : "", tried)};
  survive_broken_connection();
  glfwSetWindowSizeLimits(impl->window, kSmallestSide, kSmallestSide, GLFW_DONT_CARE, GLFW_DONT_CARE);
  std::unique_ptr<Window> out(new Window(std::move(impl)));
  {
    const Current current(*out);
    glfwSwapInterval(1);
    auto presenter = FramePresenter::make();
    if (!presenter) return presenter.error();
    out->impl_->presenter = std::move(*presenter);
    if (o.two_eyes) {
      GLboolean there = GL_FALSE;
      glGetBooleanv(GL_STEREO, &there);
      if (!there) return Error{"the driver has no quad-buffered OpenGL, which --stereo quad-buffer needs"};
      out->impl_->presenter->draw_two_eyes();
    }
    auto gui = Gui::make(out->impl_->window);
    if (!gui) return gui.error();
    out->impl_->gui = std::move(*gui);
    out->impl_->listen();
    out->impl_->say_renderer(out->width(), out->height());
  }
  if (glfwGetCurrentContext() == out->impl_->window) glfwMakeContextCurrent(nullptr);
  return out;
}

Window::Window(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) { read_size(); }

Window::~Window() {
  if (lost()) {
    // Libraries would send requests to the server that is gone. `kept` lets leak checkers find the object.
    [[maybe_unused]] static Impl* volatile kept;
    kept = impl_.release();
    return;
  }
  const Current current(*this);
  impl_->presenter.reset();
  impl_->gui.reset();
}

Window::Current::Current(const Window& window)
    : display_(eglGetCurrentDisplay()),
      context_(eglGetCurrentContext()),
      draw_(eglGetCurrentSurface(EGL_DRAW)),
      read_(eglGetCurrentSurface(EGL_READ)) {
  if (glfwGetCurrentContext() == window.impl_->window) {
    context_ = EGL_NO_CONTEXT;
    return;
  }
  if (context_ != EGL_NO_CONTEXT) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  glfwMakeContextCurrent(window.impl_->window);
}

Window::Current::~Current() {
  if (context_ == EGL_NO_CONTEXT) return;
  glfwMakeContextCurrent(nullptr);
  eglMakeCurrent(display_, draw_, read_, context_);
}

void Window::read_size() {
  int width = 0, height = 0;
  glfwGetFramebufferSize(impl_->window, &width, &height);
  if (width <= 0 || height <= 0) return;  // minimised
  width_ = within(width, kSmallestPicture, geometry::kMaxImageSide);
  height_ = within(height, kSmallestPicture, geometry::kMaxImageSide);
}

void Window::poll(Interaction& interaction) {
  if (lost()) return;
  impl_->interaction = &interaction;
  glfwPollEvents();
  impl_->interaction = nullptr;
  if (lost()) return;
  if (interaction.wants_pointer() != impl_->pointer_caught) {
    impl_->pointer_caught = interaction.wants_pointer();
    impl_->pointer.reset();  // while it is caught, its places are not in the window
    glfwSetInputMode(impl_->window, GLFW_CURSOR, impl_->pointer_caught ? GLFW_CURSOR_DISABLED : GLFW_CURSOR_NORMAL);
  }
  impl_->gui->expect_text(interaction.open().dialog);
  read_size();
}

bool Window::lost() const {
  if (xcb.broken()) connection_lost = true;
  return connection_lost;
}

bool Window::closing() const { return lost() || glfwWindowShouldClose(impl_->window); }

void Window::set_title(const std::string& title) {
  if (!lost()) glfwSetWindowTitle(impl_->window, title.c_str());
}

bool Window::fullscreen() const { return !lost() && glfwGetWindowMonitor(impl_->window) != nullptr; }

void Window::toggle_fullscreen() {
  if (lost()) return;
  Place& was = impl_->before_fullscreen;
  refresh_s_ = -1;
  if (fullscreen()) {
    if (was.width == 0) was = {80, 80, 1280, 800};  // it filled the screen from the beginning
    glfwSetWindowMonitor(impl_->window, nullptr, was.x, was.y, was.width, was.height, GLFW_DONT_CARE);
    return;
  }
  glfwGetWindowPos(impl_->window, &was.x, &was.y);
  glfwGetWindowSize(impl_->window, &was.width, &was.height);
  const auto [best, mode] = screen_of(was);
  if (best) glfwSetWindowMonitor(impl_->window, best, 0, 0, mode->width, mode->height, mode->refreshRate);
}

// A question to the window system takes a round trip, so it is asked only after a move.
double Window::refresh_s() {
  if (lost()) return 0;
  if (refresh_s_ >= 0 && !std::exchange(impl_->moved, false)) return refresh_s_;
  Place here;
  glfwGetWindowPos(impl_->window, &here.x, &here.y);
  glfwGetWindowSize(impl_->window, &here.width, &here.height);
  const GLFWvidmode* mode = screen_of(here).mode;
  return refresh_s_ = mode && mode->refreshRate > 0 ? 1.0 / mode->refreshRate : 0;
}

std::string Window::key_name(Key key) const {
  // Keyboards of other scripts have Latin letters too, and the window's font has only ASCII.
  if (key < Key::k1 && !lost())
    if (const char* name = glfwGetKeyName(us_name(key)[0], 0); name && *name && is_ascii(name)) return upper_case(name);
  return us_name(key);
}

double Window::content_scale() const {
  float x = 1, y = 1;
  if (!lost()) glfwGetWindowContentScale(impl_->window, &x, &y);
  return within(double(std::max(x, y)), 0.5, 8.0);
}

std::vector<std::string> Window::take_dropped() { return std::exchange(impl_->dropped, {}); }

int Window::hidden() const { return impl_->hidden; }

bool Window::gui_due(double now_s) const { return impl_->gui->due(now_s); }

void Window::present(const image::View& view, const Overlays& overlays, const std::function<double()>& gui) {
  if (lost()) return;
  int width = 0, height = 0;
  glfwGetFramebufferSize(impl_->window, &width, &height);
  if (width <= 0 || height <= 0) return;
  const Current current(*this);
  const Gui::Place place{width, height, content_scale()};
  const int hidden = impl_->hidden = impl_->gui->prepare(place, monotonic_s(), gui);
  impl_->presenter->draw(view, width, height, overlays, hidden);
  impl_->gui->show(place);
  if (impl_->draws_without_gpu) glFinish();  // the swap would wait here, too; meanwhile the display may go away
  if (lost()) return;
  glfwSwapBuffers(impl_->window);
}

}  // namespace telesplat::viewer
