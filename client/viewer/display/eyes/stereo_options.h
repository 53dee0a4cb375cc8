// How a display shows two eyes' pictures.
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
  /// How far before the head the plane is whose points lie in one place of both pictures; 0: as far as the data set's
  /// middle is when the first frame is drawn.
  double screen_m = 0;
  /// Of a screen of a described wall: its picture's width. How far it is follows from the head's camera then.
  double screen_width_m = 0;
  bool swap_eyes = false;                            ///< each eye gets the other one's place
  stereo::Pattern pattern = stereo::Pattern::kNone;  ///< shown in place of the scene
  std::optional<stereo::Panel> panel;                ///< of kAutostereo
  std::string panel_file;                            ///< that it was read from; read again when it changes
  std::optional<geometry::Trajectory> tracked_head;  ///< of kAutostereo: poses on the panel's axes (panel.h)

  bool on() const { return mode != stereo::Mode::kOff; }
  /// The picture of one eye, of a display of so many pixels.
  stereo::Size eye_size(int width, int height) const {
    return panel ? panel->eye_size() : stereo::eye_size(mode, {width, height});
  }
};

}  // namespace telesplat::viewer
