// Says whether viewers of a session have a base (docs/base.md).
#pragma once

#include <string_view>

#include "common/scene/session.h"

namespace telesplat::scene {

/// True if the fact `format` of a mesh is that of a cloud of points.
inline bool is_cloud(std::string_view mesh_format) { return mesh_format.find(" points") != mesh_format.npos; }

/// Triangles that the base is to have at most; 0: the session has no base. Coarse levels of a cloud's squares are no
/// surface.
inline uint64_t base_triangles(const wire::Welcome& session) {
  const SessionView view(session);
  const bool has_base =
      view.kind() == Kind::kMesh && !session.settings.keep_redundant && !is_cloud(view.fact("format"));
  return has_base ? session.settings.base_triangles : 0;
}

}  // namespace telesplat::scene
