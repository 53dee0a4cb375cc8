// Checks on what a glTF file claims. Source: Khronos, "glTF 2.0 Specification", sections 3 and 4.4.
#pragma once

#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::data {

/// Checks before VTK sees the file: version 2, well-formed JSON, no accessor of more elements than `data_bytes` (the
/// file and its companions), a GLB no longer than it is. Errors start with `name`.
Status check_gltf(std::string_view content, uint64_t data_bytes, const std::string& name);

}  // namespace telesplat::data
