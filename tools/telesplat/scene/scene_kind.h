// What a scene is - a mesh, a Julia set, a volume - and which flags go with it.
#pragma once

#include <string>

#include "common/core/result.h"

namespace CLI {
class App;
}

namespace telesplat::launcher {

struct RunOptions;

/// kNone: a session is joined and no scene was named.
enum class SceneKind { kNone, kMesh, kJulia, kVolume };

/// "a mesh", "a Julia set", "a volume".
const char* name_of(SceneKind kind);

/// Once `flags` are parsed into `options`: finds out what the scene is, by its content, and sets what is better for its kind where no
/// flag says otherwise. Error: there is no such scene, or a flag was given that scenes of its kind do not have.
Status settle_scene(const CLI::App& flags, RunOptions& options);

}  // namespace telesplat::launcher
