// Inside services/data/gltf: primitives that Draco has packed. Source: Khronos, "KHR_draco_mesh_compression".
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "services/data/gltf/document.h"

namespace telesplat::data::gltf {

struct DracoMesh {
  std::vector<uint32_t> indices;          ///< three a triangle
  std::map<uint32_t, Values> attributes;  ///< by the ids that the extension names; integers as they are stored
};

/// Throws Refusal: it is damaged, or is no triangle mesh.
DracoMesh decode_draco(Bytes packed, const std::vector<uint32_t>& ids);

}  // namespace telesplat::data::gltf
