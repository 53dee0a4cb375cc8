// The outside of a glTF file: its JSON text, its binary chunk, the files that it names. Source: Khronos, "glTF 2.0
// Specification", sections 2.8, 3.6.1 and 4.4.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::data {

/// Whether this is glTF by its content: a GLB, or JSON with an asset.
bool looks_like_gltf(std::string_view content);

/// The JSON text of a .gltf file (all of it) or a .glb file (its first chunk); empty if a .glb is too short for what it
/// claims.
std::string_view gltf_json(std::string_view content);
/// The second chunk of a .glb file; empty if it has none.
std::string_view glb_binary(std::string_view content);

/// Limit of that JSON text outside of its own texts, in which buffers may stand: each byte may take 20 of memory.
inline constexpr uint64_t kMostGltfJson = uint64_t{64} << 20;
/// Whether that text keeps to kMostGltfJson. One that does not is not read.
bool gltf_json_fits(std::string_view content);

/// Names of the buffers and pictures beside the file, at most 1024: what their URIs mean, then as they stand in it.
std::vector<std::string> gltf_files(std::string_view content);
/// The file that a URI means: %20 and its like are undone, backslashes become slashes.
std::string uri_file(const std::string& uri);

}  // namespace telesplat::data
