// Reports the progress of reading and preparing a data set.
#pragma once

#include <functional>

namespace telesplat::data {

/// Fraction of a file read, 0..1; called now and then on the reading thread.
using ReadProgress = std::function<void(double fraction)>;

/// Stages, in the words that users read.
inline constexpr const char *kIdentifying = "identifying", *kReading = "reading", *kPlacing = "placing it in the room",
                            *kSortingIntoChunks = "sorting into chunks", *kWritingTheStore = "writing the store",
                            *kMakingLevels = "making coarser levels", *kSortingVoxels = "sorting voxels by value";

/// The same for several stages. stage: one of these, or another in such words.
using Progress = std::function<void(const char* stage, double fraction)>;

}  // namespace telesplat::data
