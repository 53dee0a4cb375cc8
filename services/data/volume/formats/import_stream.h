// Sends a volume from telesplat-import through a pipe, so that its voxels are never in memory twice. Each message is a
// kind, a length, and the bytes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

struct StreamedVolume {
  /// Sizes, type and placement are the reader's, in native byte order; scale, offset and ct are the file's.
  VolumeFileHeader header;
  std::vector<std::byte> bytes;
};

/// Writes all bytes. False: writing failed (reason in errno).
bool write_all(int descriptor, const void* data, uint64_t bytes);

// For telesplat-import. False: the receiver is gone.
bool send_progress(int descriptor, double fraction);
bool send_error(int descriptor, const std::string& text);
/// voxels: header.voxel_bytes() bytes.
bool send_volume(int descriptor, const VolumeFileHeader& header, const void* voxels);

/// Reads until a volume or an error has come, without trust in any byte. most_bytes: limit for the voxels. nullopt: the
/// stream ended too early, or is not valid. Error: the error that was sent; more voxels than `most_bytes`.
std::optional<Result<StreamedVolume>> receive_volume(int descriptor, uint64_t most_bytes, const std::string& path,
                                                     const ReadProgress& progress);

}  // namespace telesplat::data
