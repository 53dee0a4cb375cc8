// Lists the widgets of panel and dialogs, their places, and how often each was used: for programs that test the window
// from outside. No window, no OpenGL, no Dear ImGui.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace telesplat::viewer {

/// Used by one thread.
class WidgetLog {
 public:
  static constexpr const char* kVariable = "TELESPLAT_WIDGET_LOG";  ///< names the file

  /// In screen coordinates of the window.
  struct Rect {
    float left = 0, top = 0, right = 0, bottom = 0;
  };
  struct Widget {
    std::string kind;  ///< "button", "slider", ...
    Rect rect;
    bool here = false;       ///< the newest build has it
    bool reachable = false;  ///< it is here, and its middle is not scrolled out of view
    bool on = false;         ///< it was used in the newest build that had it
    uint64_t uses = 0;
  };

  /// path: a file with the present list, renamed into place after each build that changes it; empty: no log.
  explicit WidgetLog(std::string path) : path_(std::move(path)) {}
  /// Makes the log that the environment asks for.
  static WidgetLog from_environment();
  bool on() const { return !path_.empty(); }

  void begin_build();
  /// All widgets until the next call lie in this part of a window: their names begin with it.
  void enter(std::string_view part) { part_ = part; }
  /// used: the person uses it in this build; several builds in a row are one use. visible: part of the window's area in
  /// which it can be seen. If two widgets of a build have one name, the first one counts.
  void seen(std::string_view kind, std::string_view name, const Rect& rect, const Rect& visible, bool used);
  void end_build();

  /// Keys are names: "Display/splats", "Display/splats=disc".
  const std::map<std::string, Widget, std::less<>>& widgets() const { return widgets_; }
  /// One line for each widget: name, kind, left, top, right, bottom, here, reachable, uses; tabs between.
  std::string text() const;

 private:
  std::string path_, part_, written_;
  std::map<std::string, Widget, std::less<>> widgets_;
};

/// A build of the panel that a log follows. Without a log it costs one comparison a widget.
class LoggedBuild {
 public:
  explicit LoggedBuild(WidgetLog& log) {
    if (!log.on()) return;
    log.begin_build();
    log_ = &log;
  }
  ~LoggedBuild() {
    if (log_) log_->end_build();
    log_ = nullptr;
  }
  LoggedBuild(const LoggedBuild&) = delete;
  LoggedBuild& operator=(const LoggedBuild&) = delete;
  static WidgetLog* log() { return log_; }

 private:
  inline static WidgetLog* log_ = nullptr;  // log of the present build
};

}  // namespace telesplat::viewer
