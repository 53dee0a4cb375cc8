// Says whether viewers of a session have a base (docs/base.md).
#pragma once

#include "common/scene/session.h"

namespace telesplat::scene {

/// Triangles that the base is to have at most; 0: the session has no base.
inline uint64_t base_triangles(const wire::Welcome& session) {
  const bool has_base = SessionView(session).kind() == Kind::kMesh && !session.settings.keep_redundant;
  return has_base ? session.settings.base_triangles : 0;
}

}  // namespace telesplat::scene
