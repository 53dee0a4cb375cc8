// A session with a headset: its states, its spaces, its frames. Any failure ends it; the display then opens another.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/displays/xr/hands.h"
#include "client/displays/xr/picture_chain.h"
#include "client/displays/xr/xr_system.h"
#include "client/viewer/display/display_options.h"
#include "common/gl/egl_context.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Used by one thread; open()'s context must be current there in all calls.
class HeadsetSession {
 public:
  static Result<std::unique_ptr<HeadsetSession>> open(const XrSystem& system, const gl::EglContext& context,
                                                      const XrOptions& options, double near_m);
  ~HeadsetSession();

  int width() const { return width_; }
  int height() const { return height_; }

  /// Handles the runtime's events. To be called between frames, and many times a second while it shows nothing.
  void poll();
  /// True while frames are to be shown.
  bool running() const { return running_; }
  /// True after it was lost or failed. The news have the reason.
  bool over() const { return over_; }
  /// True if the person has quit the application.
  bool quits() const { return quits_; }
  /// True once after the headset's space was set anew, so that poses have jumped.
  bool take_recentring() { return std::exchange(recentred_, false); }
  /// Returns lines for the person since the last call.
  std::vector<std::string> take_news() { return std::exchange(news_, {}); }
  /// Asks the runtime to end the session; states follow.
  void request_exit();

  struct Frame {
    XrTime display_time = 0;
    double display_s = 0;    ///< when it is seen, on the monotonic clock
    double period_s = 0;     ///< time between the display's refreshes
    bool renders = false;    ///< a person sees it
    bool discarded = false;  ///< the frame before it was begun and is never shown
  };
  /// Waits until a frame is to be drawn, and begins it. Nothing: the session is over.
  std::optional<Frame> begin_frame();

  struct Eyes {
    std::array<geometry::Camera, 2> cameras;
    std::array<XrView, 2> views;
  };
  /// Returns the eyes at that time; nothing: the headset cannot locate them.
  std::optional<Eyes> locate_eyes(XrTime time);
  /// Returns the head, in the room.
  std::optional<geometry::Pose> locate_head(XrTime time) const;
  Hands& hands() { return *hands_; }
  HandRays locate_hands(XrTime time);

  /// Takes the picture of an eye, left 0, right 1. It has its camera's size, and depth if takes_depth().
  void put(int eye, const image::View& picture);
  bool takes_depth() const { return !depth_.empty(); }
  /// Ends the frame. eyes: the pictures' cameras; null: there are no pictures.
  void end_frame(const Frame& frame, const Eyes* eyes);

 private:
  HeadsetSession(const XrSystem& system, const XrOptions& options, double near_m)
      : system_(system), options_(options), near_m_(near_m) {}
  Status make_session(const gl::EglContext& context);
  Status make_spaces();
  Status make_chains();
  void on_state(const XrEventDataSessionStateChanged& event);
  /// Returns false if the call failed; then the session is over.
  bool done(const char* what, XrResult result);
  bool done(const Status& status);

  const XrSystem& system_;
  const XrOptions options_;
  const double near_m_;
  ::XrSession session_ = XR_NULL_HANDLE;
  XrSpace stage_ = XR_NULL_HANDLE, head_ = XR_NULL_HANDLE;
  glm::dvec3 origin_{0.0};
  int width_ = 0, height_ = 0;
  std::vector<PictureChain> colour_, depth_;  // one for each eye
  std::unique_ptr<Hands> hands_;
  bool running_ = false, over_ = false, quits_ = false, recentred_ = false;
  std::optional<XrTime> recentres_at_;
  std::vector<std::string> news_;
};

}  // namespace telesplat::viewer
