// Running the program telesplat-import, which reads with other people's libraries what may crash them.
#pragma once

#include <string>
#include <vector>

#include "services/data/base/mesh.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {

/// Exit code of the program where its file was cut off while it was mapped (base/cut_off.h).
inline constexpr int kCutOffExit = 3;

/// Runs it with `words` as its arguments, the first being what to read as and the second the file's name, and takes the
/// mesh or the error that it hands back. reader: who reads, for error texts ("GDAL's raster"). files: what it may read,
/// the file itself first. Error: what it says; it crashed, did not end, is missing.
Result<Mesh> import(const std::string& reader, std::vector<std::string> words, const std::vector<std::string>& files);

/// The same for a volume, which it streams. most_bytes: of voxels; more are an error.
Result<StreamedVolume> import_volume(const std::string& reader, std::vector<std::string> words,
                                     const std::vector<std::string>& files, uint64_t most_bytes,
                                     const ReadProgress& progress);

inline constexpr const char* kImportProgram = "telesplat-import";
inline constexpr const char* kParentVariable = "TELESPLAT_IMPORT_PARENT";  ///< its process, which waits for the report

/// Writes result into the descriptor from its current position on. Returns false if that fails (errno tells).
bool write_import_report(int descriptor, const Result<Mesh>& result);

/// Reads what write_import_report wrote, trusting no count in it. Errors name `path`.
Result<Mesh> read_import_report(int descriptor, const std::string& path, const std::string& format);

}  // namespace telesplat::data
