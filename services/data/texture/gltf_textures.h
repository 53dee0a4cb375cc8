// The pictures of a glTF file, and how its textures use them. Source: Khronos, "glTF 2.0 Specification", sections 3.8,
// 4.4, 5.18, 5.26, 5.29.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/texture/texture.h"

namespace telesplat::data {

/// The JSON text of a .gltf file (all of it) or a .glb file (its first chunk); empty if a .glb is too short for what it
/// claims.
std::string_view gltf_json(std::string_view content);

/// Of that text what stands outside of its own texts, in which buffers may stand: each byte may take 20 of memory.
inline constexpr uint64_t kMostGltfJson = uint64_t{64} << 20;
/// Whether that text keeps to kMostGltfJson. One that does not is not read.
bool gltf_json_fits(std::string_view content);

/// Paths of the pictures that lie beside the file.
std::vector<std::string> gltf_picture_files(std::string_view content, const std::string& path);

struct GltfTextures {
  std::vector<std::shared_ptr<const Texture>> all;  ///< as the file numbers them; null: it is not there or not used
  std::vector<std::string> notes;                   ///< pictures that are missing
};
/// Of those textures that are base colours of a material. Error, naming the file: a picture is damaged, of no known
/// format, too large.
Result<GltfTextures> read_gltf_textures(std::string_view content, const std::string& path);

}  // namespace telesplat::data
