// Runs the program telesplat-import, which reads files with foreign libraries that may crash on them.
#pragma once

#include <string>
#include <vector>

#include "services/data/base/elevation.h"
#include "services/data/base/mesh.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {

/// Exit code of the program if its file was cut off while it was mapped (base/cut_off.h).
inline constexpr int kCutOffExit = 3;

/// Runs the program with the arguments `words` (first the format, then the file's name), and returns its mesh or its
/// error. reader: the library, for error texts ("GDAL's raster"). files: the files that it may read, the data file
/// first. Error: the program's own; or it crashed, did not end, or is missing.
Result<Mesh> import(const std::string& reader, std::vector<std::string> words, const std::vector<std::string>& files);

/// The same for the heights of a raster ("heights", GDAL's).
Result<ElevationRaster> import_heights(std::vector<std::string> words, const std::vector<std::string>& files);

/// The same for a volume, which it streams. most_bytes: limit of voxels; more bytes are an error.
Result<StreamedVolume> import_volume(const std::string& reader, std::vector<std::string> words,
                                     const std::vector<std::string>& files, uint64_t most_bytes,
                                     const ReadProgress& progress);

inline constexpr const char* kImportProgram = "telesplat-import";
inline constexpr const char* kParentVariable = "TELESPLAT_IMPORT_PARENT";  ///< id of the waiting process

/// Writes a result to the descriptor from its current position on. Returns false if that fails (reason in errno).
bool write_import_report(int descriptor, const Result<Mesh>& result);

/// The same for heights.
bool write_heights_report(int descriptor, const Result<ElevationRaster>& result);
/// Reads a report of write_heights_report(), trusting no count in it. Errors name `path`.
Result<ElevationRaster> read_heights_report(int descriptor, const std::string& path);

/// Reads a report of write_import_report(), trusting no count in it. Errors name `path`.
Result<Mesh> read_import_report(int descriptor, const std::string& path, const std::string& format);

}  // namespace telesplat::data
