// Small pictures over the finished frame, in the window only: keys, a legend. Recordings, screenshots and verification
// never have them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// A picture in a corner of the window, at its own size; smaller if the window is too small for it.
struct Overlay {
  enum class Corner { kUpperLeft, kUpperRight, kLowerLeft, kLowerRight, kNone };
  image::View picture;  ///< 0xAARRGGBB, not premultiplied: 0xff opaque, 0 transparent
  Corner corner = Corner::kUpperLeft;
  int x = 0, y = 0;  ///< with kNone: place of its upper left pixel, at its own size
};

/// The overlays of the frames at present, by names that their owners choose ("help"). Used by the display's thread.
class Overlays {
 public:
  /// Shows the overlay, in place of the one of this name. An empty picture hides it.
  void show(const std::string& name, Overlay overlay);
  void hide(const std::string& name);
  bool shows(const std::string& name) const { return all_.contains(name); }

  /// Changes with each change of an overlay.
  uint64_t version() const { return version_; }
  const std::map<std::string, Overlay>& all() const { return all_; }

 private:
  std::map<std::string, Overlay> all_;
  uint64_t version_ = 0;
};

/// Draws lines of text on a dark, translucent ground. scale: pixels a side of a letter's dot.
image::View text_panel(const std::vector<std::string>& lines, int scale);

/// Returns the place of an overlay's picture in a window; it is scaled down, never up, to fit with a small margin.
/// hidden: columns at the window's left that are covered.
geometry::Rect place_overlay(const Overlay& overlay, int window_width, int window_height, int hidden = 0);

}  // namespace telesplat::viewer
