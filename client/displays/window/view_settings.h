// Settings of a display that a person can change while it shows: scene::settings() that a viewer keeps, as texts.
#pragma once

#include <map>
#include <string>

#include "client/viewer/coupling/request_options.h"
#include "client/viewer/display/eyes/stereo_options.h"
#include "client/viewer/input/look.h"
#include "common/core/result.h"

namespace telesplat::viewer {

struct ViewSettings {
  Look look;
  bool transparent = false;  ///< the background cannot be chosen
  SamplingWish sampling;
  StereoOptions stereo;
  bool quad_buffers = false;  ///< the window has a buffer for each eye
  bool legend = true;
  bool pictures = false;  ///< views come as pictures: settings that cannot change these are refused
};

/// Sets the setting of this order to a value, written as for its flag. Error: what is wrong, or that no setting has
/// this order; then nothing changes.
Status change(ViewSettings& settings, const std::string& order, const std::string& value);
/// Returns the values of all settings, by their orders.
std::map<std::string, std::string> values_of(const ViewSettings& settings);

/// Reads "on" or "off".
Result<bool> read_switch(const std::string& value);

}  // namespace telesplat::viewer
