// What differs between the epochs of a run, in words.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace telesplat::launcher {

/// By an epoch's number those numbers of its row of epochs.csv that differ between epochs: "c.y -0.41  slice.offset
/// 0.2". Nothing where there is one epoch only, or no such file. Values have four digits.
std::map<uint64_t, std::string> epoch_captions(const std::string& run_directory);

}  // namespace telesplat::launcher
