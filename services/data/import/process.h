// Running the program telesplat-import, which reads with other people's libraries what may crash them.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "services/data/base/mesh.h"

namespace telesplat::data {

/// Exit code of the program where its file was cut off while it was mapped (base/cut_off.h).
inline constexpr int kCutOffExit = 3;

/// Runs it with `words` as its arguments, the first being what to read as and the second the file's name, and takes the
/// mesh or the error that it hands back. reader: who reads, for error texts ("GDAL's raster"). files: what it may read,
/// the file itself first. Error: what it says; it crashed, did not end, is missing.
Result<Mesh> import(const std::string& reader, std::vector<std::string> words, const std::vector<std::string>& files);

/// The two halves of import(), for what comes back otherwise: starts the program, which writes into `output`, and sends
/// it the files (files.h) ...
Result<pid_t> start_import(std::vector<std::string> words, const std::vector<std::string>& files, int output);
/// ... and waits for its end. Error: it crashed, did not end, gave up, is missing.
Status end_import(pid_t child, const std::string& reader, const std::string& format, const std::string& path);

}  // namespace telesplat::data
