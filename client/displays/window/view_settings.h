// What a person can change of a display while it shows: settings of scene::settings() that a viewer keeps, as texts.
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
  bool pictures = false;  ///< views come as pictures: what changes nothing in these is refused
};

/// Gives the setting of this order a value, as its flag takes it. Error: what is wrong, or that no setting has this
/// order; then nothing changes.
Status change(ViewSettings& settings, const std::string& order, const std::string& value);
/// All of them as they are, by their orders.
std::map<std::string, std::string> values_of(const ViewSettings& settings);

/// "on" or "off".
Result<bool> read_switch(const std::string& value);

}  // namespace telesplat::viewer
