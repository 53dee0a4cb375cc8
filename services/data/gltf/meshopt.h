// Inside services/data/gltf: buffer views that meshoptimizer has packed. Source: Khronos, "EXT_meshopt_compression" and
// "KHR_meshopt_compression", appendices A and B.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace telesplat::data::gltf {

struct MeshoptView {
  size_t count, stride;      ///< stride: bytes an element
  std::string mode, filter;  ///< as the extension names them; filter: "" or "NONE": none
};

/// Unpacks count times stride bytes: all modes, filters and versions of both extensions. Throws Refusal: the data are
/// damaged, or claim more than their bytes can hold.
std::vector<std::byte> decode_meshopt(std::span<const std::byte> packed, const MeshoptView& view);

}  // namespace telesplat::data::gltf
