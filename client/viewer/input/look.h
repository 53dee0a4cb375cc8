// How frames are drawn, as far as a person can change it while looking: keys write it, sources read it.
#pragma once

#include "common/splat/render_options.h"

namespace telesplat::viewer {

struct Look {
  splat::RenderOptions render;
  bool lit = true;
};

}  // namespace telesplat::viewer
