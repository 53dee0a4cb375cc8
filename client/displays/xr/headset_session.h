// A session with a headset: its states, its spaces, its frames. Whatever fails ends it; the display opens another one.
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

/// Used by one thread, in which the context of open() is current in all calls.
class HeadsetSession {
 public:
  static Result<std::unique_ptr<HeadsetSession>> open(const XrSystem& system, const gl::EglContext& context,
                                                      const XrOptions& options, double near_m);
  ~HeadsetSession();

  int width() const { return width_; }
  int height() const { return height_; }

  /// Looks at what happened. Between frames, and while it shows nothing, to be called many times a second.
  void poll();
  /// Frames are to be shown.
  bool running() const { return running_; }
  /// Over: lost, or failed. Why stands in the news.
  bool over() const { return over_; }
  /// The person is done with the application.
  bool quits() const { return quits_; }
  /// The headset's space was set anew, so poses have jumped. Once.
  bool take_recentring() { return std::exchange(recentred_, false); }
  /// Lines for the person, since the last call.
  std::vector<std::string> take_news() { return std::exchange(news_, {}); }
  /// The runtime shows the application that it is done; states follow.
  void request_exit();

  struct Frame {
    XrTime display_time = 0;
    double display_s = 0;    ///< the same on the monotonic clock: when it is seen
    double period_s = 0;     ///< of the display's refreshes
    bool renders = false;    ///< somebody sees it
    bool discarded = false;  ///< the frame before it was begun and is never shown
  };
  /// Waits until a frame is to be drawn, and begins it. Nothing: the session is over.
  std::optional<Frame> begin_frame();

  struct Eyes {
    std::array<geometry::Camera, 2> cameras;
    std::array<XrView, 2> views;
  };
  /// Where the eyes will be at that time; nothing: the headset does not know.
  std::optional<Eyes> locate_eyes(XrTime time);
  /// The head, in the room.
  std::optional<geometry::Pose> locate_head(XrTime time) const;
  Hands& hands() { return *hands_; }
  HandRays locate_hands(XrTime time);

  /// The picture of an eye, left 0, right 1. It has the size of its camera, and depth if the session takes it.
  void put(int eye, const image::View& picture);
  bool takes_depth() const { return !depth_.empty(); }
  /// Ends the frame. eyes: what the pictures show; null: there is no picture.
  void end_frame(const Frame& frame, const Eyes* eyes);

 private:
  HeadsetSession(const XrSystem& system, const XrOptions& options, double near_m)
      : system_(system), options_(options), near_m_(near_m) {}
  Status make_session(const gl::EglContext& context);
  Status make_spaces();
  Status make_chains();
  void on_state(const XrEventDataSessionStateChanged& event);
  /// False, and the session is over: it failed.
  bool done(const char* what, XrResult result);
  bool done(const Status& status);

  const XrSystem& system_;
  const XrOptions options_;
  const double near_m_;
  ::XrSession session_ = XR_NULL_HANDLE;
  XrSpace stage_ = XR_NULL_HANDLE, head_ = XR_NULL_HANDLE;
  glm::dvec3 origin_{0.0};
  int width_ = 0, height_ = 0;
  std::vector<PictureChain> colour_, depth_;  // an eye each
  std::unique_ptr<Hands> hands_;
  bool running_ = false, over_ = false, quits_ = false, recentred_ = false;
  std::optional<XrTime> recentres_at_;
  std::vector<std::string> news_;
};

}  // namespace telesplat::viewer
