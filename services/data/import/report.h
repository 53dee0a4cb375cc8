// What the program telesplat-import hands back: a mesh, or an error, in a file that both processes have open.
#pragma once

#include <string>

#include "services/data/base/mesh.h"

namespace telesplat::data {

inline constexpr const char* kImportProgram = "telesplat-import";
inline constexpr const char* kParentVariable = "TELESPLAT_IMPORT_PARENT";  ///< its process, which waits for the report

/// Writes result into the descriptor from its current position on. Returns false if that fails (errno tells).
bool write_import_report(int descriptor, const Result<Mesh>& result);

/// Reads what write_import_report wrote, trusting no count in it. Errors name `path`.
Result<Mesh> read_import_report(int descriptor, const std::string& path, const std::string& format);

}  // namespace telesplat::data
