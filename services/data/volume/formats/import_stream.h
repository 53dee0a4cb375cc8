// How a volume comes from telesplat-import: through a pipe, so that its voxels are never in memory twice. Messages of a
// kind, a length and as many bytes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

struct StreamedVolume {
  /// Sizes, type and placement are as its reader has them, in native byte order; scale, offset and ct are the file's.
  VolumeFileHeader header;
  std::vector<std::byte> bytes;
};

/// Writes all of it. False: that fails (errno tells).
bool write_all(int descriptor, const void* data, uint64_t bytes);

// In telesplat-import. They return false if nobody listens any more.
bool send_progress(int descriptor, double fraction);
bool send_error(int descriptor, const std::string& text);
/// voxels: header.voxel_bytes() of them.
bool send_volume(int descriptor, const VolumeFileHeader& header, const void* voxels);

/// Reads from the other end until a volume or an error came, trusting nothing. `most_bytes`: of voxels. None: the
/// stream ended before, or is none of ours. Error: that which was sent; more bytes than `most_bytes`.
std::optional<Result<StreamedVolume>> receive_volume(int descriptor, uint64_t most_bytes, const std::string& path,
                                                     const ReadProgress& progress);

}  // namespace telesplat::data
