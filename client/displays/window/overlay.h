// Small pictures that lie over the finished frame, in the window alone: keys, a legend. Recordings, screenshots and
// verification never see them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A picture in a corner of the window, at its own size; smaller where the window is too small for it.
struct Overlay {
  enum class Corner { kUpperLeft, kUpperRight, kLowerLeft, kLowerRight, kNone };
  image::View picture;  ///< 0xAARRGGBB, not premultiplied: 0xff opaque, 0 nothing
  Corner corner = Corner::kUpperLeft;
  int x = 0, y = 0;  ///< with kNone: where its upper left pixel lies, at its own size
};

/// What lies over the frames at present, by names that their owners choose ("help"). Used by the display's thread.
class Overlays {
 public:
  /// Shows it, in place of what has this name. Hides that where the picture is empty.
  void show(const std::string& name, Overlay overlay);
  void hide(const std::string& name);
  bool shows(const std::string& name) const { return all_.contains(name); }

  /// Another one after each change.
  uint64_t version() const { return version_; }
  const std::map<std::string, Overlay>& all() const { return all_; }

 private:
  std::map<std::string, Overlay> all_;
  uint64_t version_ = 0;
};

/// Lines of text on a dark, translucent ground. scale: pixels a side of a letter's dot.
image::View text_panel(const std::vector<std::string>& lines, int scale);

/// Where a picture of width x height lies in a window; scaled down, never up, to fit with a small margin. hidden: so
/// many columns at the window's left are covered by something else.
geometry::Rect place_overlay(const Overlay& overlay, int window_width, int window_height, int hidden = 0);

}  // namespace telesplat::viewer
