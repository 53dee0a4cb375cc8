// The viewer's flags about who moves the head, and how its movements are foreseen. Part of viewer_options.h.
#pragma once

#include "client/viewer/viewer_options.h"

namespace telesplat::viewer {

/// What is wrong with "X,Y,Z"; empty: nothing.
std::string complain_about_point(const std::string& text);
/// Publishers of poses, prediction.
options::Table head_source_table(ViewerOptions& options);
/// What these flags and those of a headset come to. Error: names the flag that cannot be.
Status settle_head_source(ViewerOptions& options);

}  // namespace telesplat::viewer
