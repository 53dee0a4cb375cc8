// Facts about the session that the worker writes and other threads read; and the session's end.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "client/viewer/display/display_surface.h"
#include "client/viewer/display/frame_figures.h"
#include "client/viewer/hands/meaning.h"
#include "client/viewer/legend_book.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Thread-safe.
class SessionBoard {
 public:
  /// A scene that can be shown.
  struct Scene {
    std::string name;
    std::shared_ptr<const SceneTerms> terms;
    ShownScene shown;
  };

  /// scene: null leaves the one before.
  void show(std::shared_ptr<const wire::Welcome> session, const Scene* scene) {
    const std::lock_guard lock(mutex_);
    session_ = std::move(session);
    if (scene) scene_ = *scene;
  }
  /// Sets the size of the newest view request, pixels.
  void show_size(int width, int height) {
    const std::lock_guard lock(mutex_);
    sampled_width_ = width, sampled_height_ = height;
  }
  /// Null before the first.
  std::shared_ptr<const wire::Welcome> session() const {
    const std::lock_guard lock(mutex_);
    return session_;
  }
  Scene scene() const {
    const std::lock_guard lock(mutex_);
    return scene_;
  }
  void add_figures(SessionFigures& figures) const {
    const std::lock_guard lock(mutex_);
    figures.scene = scene_.name;
    figures.sampled_width = sampled_width_, figures.sampled_height = sampled_height_;
  }

  LegendBook legends;
  std::atomic<InstanceId> instance;
  std::atomic<double> offset_s{0};   ///< master's clock minus the monotonic one
  std::atomic<double> horizon_s{0};  ///< time ahead for which views are asked for

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const wire::Welcome> session_;
  Scene scene_;
  int sampled_width_ = 0, sampled_height_ = 0;
};

/// The end of a viewer's session, and its reason. Thread-safe.
class SessionEnd {
 public:
  void stop() { stop_ = true; }
  bool stops() const { return stop_; }
  void on_shutdown(std::string why) {
    why_ = std::move(why);
    shutdown_ = true;
  }
  void on_failure() { failed_ = shutdown_ = true; }
  void set_link_code(int code) { link_code_ = code; }
  bool shutdown() const { return shutdown_; }
  bool failed() const { return failed_; }
  /// Precondition: shutdown().
  const std::string& why() const { return why_; }
  int link_code() const { return link_code_; }

 private:
  std::string why_;  // written before shutdown_
  std::atomic<bool> stop_{false}, shutdown_{false}, failed_{false};
  std::atomic<int> link_code_{0};
};

}  // namespace telesplat::viewer
