#include "tests/support/virtual_display.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <sstream>
#include <vector>

// Included last: its macros are common words.
#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>

namespace telesplat::test {
namespace {

constexpr int kStart_ms = 30000;

Display* display_of(void* connection) { return static_cast<Display*>(connection); }

std::optional<std::string> variable(const char* name) {
  const char* value = std::getenv(name);
  return value ? std::optional<std::string>(value) : std::nullopt;
}
void restore(const char* name, const std::optional<std::string>& value) {
  if (value)
    setenv(name, value->c_str(), 1);
  else
    unsetenv(name);
}

// Windows come and go while a test reads them.
int ignore_error(Display*, XErrorEvent*) { return 0; }

}  // namespace

bool VirtualDisplay::installed() {
  std::istringstream path(variable("PATH").value_or(""));
  for (std::string folder; std::getline(path, folder, ':');)
    if (access((folder + "/Xvfb").c_str(), X_OK) == 0) return true;
  return false;
}

VirtualDisplay::VirtualDisplay() : display_before_(variable("DISPLAY")), wayland_before_(variable("WAYLAND_DISPLAY")) {
  int ends[2];
  if (pipe(ends) != 0) return;
  const pid_t parent = getpid();
  server_ = fork();
  if (server_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) _exit(1);
    ::close(ends[0]);
    const int null = ::open("/dev/null", O_RDWR);
    for (const int fd : {0, 1, 2}) dup2(null, fd);
    const std::string fd = std::to_string(ends[1]);
    execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "1024x2048x24", "-nolisten", "tcp", "-noreset",
           nullptr);
    _exit(127);
  }
  ::close(ends[1]);
  // Xvfb writes its number and a new line once it accepts connections.
  std::string number;
  for (char c = 0; c != '\n';) {
    pollfd readable{ends[0], POLLIN, 0};
    if (poll(&readable, 1, kStart_ms) <= 0 || read(ends[0], &c, 1) != 1) break;
    number += c;
  }
  ::close(ends[0]);
  if (!number.ends_with('\n')) return;
  number.pop_back();
  setenv("DISPLAY", (":" + number).c_str(), 1);
  unsetenv("WAYLAND_DISPLAY");
  XSetErrorHandler(ignore_error);
  connection_ = XOpenDisplay(nullptr);
}

void VirtualDisplay::set_density(int dots_an_inch) {
  Display* d = display_of(connection_);
  const std::string resources = "Xft.dpi:\t" + std::to_string(dots_an_inch) + "\n";
  XChangeProperty(d, DefaultRootWindow(d), XA_RESOURCE_MANAGER, XA_STRING, 8, PropModeReplace,
                  reinterpret_cast<const unsigned char*>(resources.c_str()), int(resources.size()));
  XSync(d, False);
}

void VirtualDisplay::go_away() {
  if (connection_) XCloseDisplay(display_of(connection_));
  connection_ = nullptr;
  if (server_ <= 0) return;
  kill(server_, SIGTERM);
  waitpid(server_, nullptr, 0);
  server_ = -1;
}

VirtualDisplay::~VirtualDisplay() {
  go_away();
  restore("DISPLAY", display_before_);
  restore("WAYLAND_DISPLAY", wayland_before_);
}

std::string VirtualDisplay::title(WindowId window) const {
  Display* d = display_of(connection_);
  Atom type = 0;
  int format = 0;
  unsigned long count = 0, left = 0;
  unsigned char* text = nullptr;
  const int got = XGetWindowProperty(d, window, XInternAtom(d, "_NET_WM_NAME", False), 0, 1024, False,
                                     XInternAtom(d, "UTF8_STRING", False), &type, &format, &count, &left, &text);
  std::string out;
  if (got == Success && text) out = reinterpret_cast<const char*>(text);
  if (text) XFree(text);
  return out;
}

std::optional<VirtualDisplay::WindowId> VirtualDisplay::find(const std::string& text) const {
  Display* d = display_of(connection_);
  Window root = 0, parent = 0, *children = nullptr;
  unsigned count = 0;
  if (!XQueryTree(d, DefaultRootWindow(d), &root, &parent, &children, &count)) return std::nullopt;
  const std::vector<Window> windows(children, children + count);
  if (children) XFree(children);
  for (const Window w : windows) {
    XWindowAttributes a;
    if (XGetWindowAttributes(d, w, &a) && a.map_state == IsViewable && title(w).find(text) != std::string::npos)
      return w;
  }
  return std::nullopt;
}

std::optional<image::View> VirtualDisplay::content(WindowId window) const {
  Display* d = display_of(connection_);
  XWindowAttributes a;
  if (!XGetWindowAttributes(d, window, &a) || a.map_state != IsViewable) return std::nullopt;
  XImage* picture = XGetImage(d, window, 0, 0, unsigned(a.width), unsigned(a.height), AllPlanes, ZPixmap);
  if (!picture) return std::nullopt;
  image::View out{a.width, a.height, {}, {}};
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) out.colour.push_back(uint32_t(XGetPixel(picture, x, y) & 0xffffff));
  XDestroyImage(picture);
  return out;
}

void VirtualDisplay::move_pointer(WindowId window, int x, int y) {
  Display* d = display_of(connection_);
  int root_x = 0, root_y = 0;
  Window child = 0;
  XTranslateCoordinates(d, window, DefaultRootWindow(d), x, y, &root_x, &root_y, &child);
  XTestFakeMotionEvent(d, -1, root_x, root_y, CurrentTime);
  XFlush(d);
}

void VirtualDisplay::button(int number, bool down) {
  XTestFakeButtonEvent(display_of(connection_), unsigned(number), down, CurrentTime);
  XFlush(display_of(connection_));
}

void VirtualDisplay::tap(const std::string& keysym, const std::string& with) {
  Display* d = display_of(connection_);
  const auto code = [&](const std::string& name) { return XKeysymToKeycode(d, XStringToKeysym(name.c_str())); };
  if (!with.empty()) XTestFakeKeyEvent(d, code(with), True, CurrentTime);
  for (const bool down : {true, false}) XTestFakeKeyEvent(d, code(keysym), down, CurrentTime);
  if (!with.empty()) XTestFakeKeyEvent(d, code(with), False, CurrentTime);
  XFlush(d);
}

bool VirtualDisplay::drop_file(WindowId window, const std::string& path) {
  Display* d = display_of(connection_);
  const auto atom = [&](const char* name) { return XInternAtom(d, name, False); };
  const Window source = XCreateSimpleWindow(d, DefaultRootWindow(d), 0, 0, 1, 1, 0, 0, 0);
  XSetSelectionOwner(d, atom("XdndSelection"), source, CurrentTime);
  const auto say = [&](const char* what, long second, long third, long fourth, long fifth) {
    XEvent event{};
    event.xclient = {.type = ClientMessage, .window = window, .message_type = atom(what), .format = 32};
    const long values[] = {long(source), second, third, fourth, fifth};
    for (int i = 0; i < 5; ++i) event.xclient.data.l[i] = values[i];
    XSendEvent(d, window, False, NoEventMask, &event);
  };
  constexpr long kVersion = 5;
  say("XdndEnter", kVersion << 24, long(atom("text/uri-list")), 0, 0);
  say("XdndPosition", 0, 100 << 16 | 100, CurrentTime, long(atom("XdndActionCopy")));
  say("XdndDrop", 0, CurrentTime, 0, 0);
  XFlush(d);
  const std::string text = "file://" + path + "\r\n";
  bool asked = false;
  for (int waited_ms = 0; waited_ms < kStart_ms && !asked; waited_ms += 10) {
    XEvent event;
    if (!XCheckTypedWindowEvent(d, source, SelectionRequest, &event)) {
      usleep(10'000);
      continue;
    }
    const XSelectionRequestEvent& request = event.xselectionrequest;
    XChangeProperty(d, request.requestor, request.property, request.target, 8, PropModeReplace,
                    reinterpret_cast<const unsigned char*>(text.c_str()), int(text.size()));
    XEvent answer{};
    answer.xselection = {.type = SelectionNotify,
                         .requestor = request.requestor,
                         .selection = request.selection,
                         .target = request.target,
                         .property = request.property,
                         .time = request.time};
    XSendEvent(d, request.requestor, False, NoEventMask, &answer);
    XFlush(d);
    asked = true;
  }
  XDestroyWindow(d, source);
  XFlush(d);
  return asked;
}

void VirtualDisplay::resize(WindowId window, int width, int height) {
  XResizeWindow(display_of(connection_), window, unsigned(width), unsigned(height));
  XFlush(display_of(connection_));
}

void VirtualDisplay::close(WindowId window) {
  Display* d = display_of(connection_);
  XEvent event{};
  event.xclient.type = ClientMessage;
  event.xclient.window = window;
  event.xclient.message_type = XInternAtom(d, "WM_PROTOCOLS", False);
  event.xclient.format = 32;
  event.xclient.data.l[0] = long(XInternAtom(d, "WM_DELETE_WINDOW", False));
  XSendEvent(d, window, False, NoEventMask, &event);
  XFlush(d);
}

}  // namespace telesplat::test
