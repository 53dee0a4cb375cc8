// The outer parts of a glTF file: its JSON text, its binary chunk, the names of other files. Source: Khronos, "glTF 2.0
// Specification", sections 2.8, 3.6.1 and 4.4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::data {

/// True if the content is glTF: a GLB, or JSON with an asset.
bool looks_like_gltf(std::string_view content);

/// Returns the JSON text of a .gltf file (all of it) or a .glb file (its first chunk); empty if a .glb is shorter than
/// it claims.
std::string_view gltf_json(std::string_view content);
/// Returns the second chunk of a .glb file; empty: it has no second chunk.
std::string_view glb_binary(std::string_view content);

/// Limit of the JSON text without its strings, which may hold whole buffers: each byte may take 20 of memory.
inline constexpr uint64_t kMostGltfJson = uint64_t{64} << 20;
/// True if the JSON text keeps to kMostGltfJson. A larger one is not read.
bool gltf_json_fits(std::string_view content);

/// Returns the names of the buffers and pictures beside the file, at most 1024: their URIs decoded, then as written.
std::vector<std::string> gltf_files(std::string_view content);
/// Decodes a URI to a file's name: %20 and the like are undone, backslashes become slashes.
std::string uri_file(const std::string& uri);

}  // namespace telesplat::data
