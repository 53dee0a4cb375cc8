// The flags of stereo displays, and the options that they give.
#pragma once

#include <string>

#include "client/viewer/display/eyes/stereo_options.h"
#include "common/options/table.h"

namespace telesplat::viewer {

struct StereoFlags {
  std::string mode = "off";
  double eye_separation_m = 0.064;
  double screen_m = 0;
  bool swap_eyes = false;
  std::string panel_file, head_file, pattern = "off";
};

options::Table stereo_table(StereoFlags& flags);

/// Makes options from the flags; reads the files that they name. Error: names the flag or the file.
Result<StereoOptions> settle(const StereoFlags& flags);

}  // namespace telesplat::viewer
