// Voxels of the formats that need nobody else's reader: raw files, NRRD, MetaImage; and what becomes of stored values.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// Reads the voxels that a checked header describes, as stored (type and byte order of the file; text: native order).
/// Memory grows with what the file gives, never by the claim. Error: ends too early, damaged streams; text that is no
/// numbers.
Result<std::vector<std::byte>> read_payload(const VolumeFileHeader& header, const std::string& path,
                                            const ReadProgress& progress);

/// Makes a volume of stored voxels: byte order, narrower types (u32, i32, u64, i64, f64 become f32 where that keeps
/// 1/4096 of their range; else an error), range, Hounsfield guess. `bytes`: header.voxel_bytes() of them.
Result<Volume> make_volume(const VolumeFileHeader& header, std::vector<std::byte> bytes, const std::string& path);

/// Refuses what this machine's free memory cannot hold.
Status check_memory(uint64_t bytes, const std::string& path);

}  // namespace telesplat::data
