// Inside services/data/gltf: unpacks Draco and meshoptimizer data. Sources: Khronos, "KHR_draco_mesh_compression";
// "EXT_meshopt_compression" and "KHR_meshopt_compression", appendices A and B.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "services/data/gltf/document.h"

namespace telesplat::data::gltf {

struct DracoMesh {
  std::vector<uint32_t> indices;          ///< three per triangle
  std::map<uint32_t, Values> attributes;  ///< by the ids that the extension names; integers as stored
};

/// Throws Refusal: the data are damaged, or not a triangle mesh.
DracoMesh decode_draco(Bytes packed, const std::vector<uint32_t>& ids);

struct MeshoptView {
  size_t count, stride;      ///< stride: bytes per element
  std::string mode, filter;  ///< as the extension names them; filter "" or "NONE": no filter
};

/// Unpacks count times stride bytes: all modes, filters and versions of both extensions. Throws Refusal: the data are
/// damaged, or claim more bytes than they can hold.
std::vector<std::byte> decode_meshopt(std::span<const std::byte> packed, const MeshoptView& view);

}  // namespace telesplat::data::gltf
