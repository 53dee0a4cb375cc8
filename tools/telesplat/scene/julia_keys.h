// A Julia set in a scene file: its preset, constant and animation, its parameters in [julia], its key frames.
#pragma once

#include <memory>

#include "tools/telesplat/scene/scene_keys.h"

namespace telesplat::launcher {

std::unique_ptr<SceneKeys> make_julia_keys();

}  // namespace telesplat::launcher
