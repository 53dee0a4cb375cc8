// Options of a display that shows two eyes' pictures.
#pragma once

#include <optional>
#include <string>

#include "client/stereo/autostereo/panel.h"
#include "client/stereo/mode.h"
#include "client/stereo/pattern.h"
#include "common/geometry/trajectory.h"

namespace telesplat::viewer {

struct StereoOptions {
  stereo::Mode mode = stereo::Mode::kOff;
  double eye_separation_m = 0.064;
  /// Distance from the head to the plane whose points have the same place in both pictures; 0: that of the data set's
  /// middle when the first frame is drawn.
  double screen_m = 0;
  /// Width of a described wall's screen; its distance then follows from the head's camera. 0: another screen.
  double screen_width_m = 0;
  bool swap_eyes = false;                            ///< each eye's picture takes the other one's place
  stereo::Pattern pattern = stereo::Pattern::kNone;  ///< shown instead of the scene
  std::optional<stereo::Panel> panel;                ///< with kAutostereo
  std::string panel_file;                            ///< file of `panel`; read again when it changes
  std::optional<geometry::Trajectory> tracked_head;  ///< with kAutostereo: poses on the panel's axes (panel.h)

  bool on() const { return mode != stereo::Mode::kOff; }
  /// Returns the size of one eye's picture, for a display of width x height pixels.
  stereo::Size eye_size(int width, int height) const {
    return panel ? panel->eye_size() : stereo::eye_size(mode, {width, height});
  }
};

}  // namespace telesplat::viewer
