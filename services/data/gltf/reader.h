// Reads glTF 2.0, as text or GLB.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Reads the triangles, strips and fans of the default scene (else the first; else all roots): nodes applied, skins and
/// morphs in their rest pose, instances; attributes of all types, sparse or packed by meshoptimizer (EXT and KHR) or
/// Draco; colours from COLOR_0, base colours (or diffuse ones) and their textures, which are baked (bake_textures())
/// with at most `texture_detail` triangles. The mesh's notes name what is left out. name: for error texts.
/// Error: the file is cut off, damaged, not of version 2, requires an extension that is not read, or needs a missing
/// buffer. Memory is not allocated by a count that the file merely claims, but a hostile Draco part may ask for much.
/// Source: Khronos, "glTF 2.0 Specification", and the extensions' own.
Result<Mesh> read_gltf(std::string_view content, const std::string& name, Companions& companions,
                       uint64_t texture_detail);

}  // namespace telesplat::data
