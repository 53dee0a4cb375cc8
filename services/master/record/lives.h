// A record that several masters wrote, one after the other: one that was killed and started again goes on with it.
// lives.csv tells when each began, and where in the files its rows begin. The figures of such a record come from its
// files: none of its masters has all in memory.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/metrics/run_folder.h"
#include "services/master/record/about.h"
#include "services/master/record/measured.h"

namespace telesplat::metrics {

/// The tables of a record.
enum class Csv { kFrames, kUpdates, kStages, kTiles, kPlans, kEpochs, kAssignment };
inline constexpr size_t kCsvs = 7;
/// "frames.csv"
const char* file_of(Csv csv);

struct Life {
  Beginning begin;                      ///< of this master, by its machine's clocks
  std::string clock;                    ///< clock_id() there
  std::array<uint64_t, kCsvs> bytes{};  ///< that each table had by then
};

/// lives.csv of a folder. Error: there is none, or it is no such file.
Result<std::vector<Life>> read_lives(const std::string& directory);
/// Header, and the row of life `number`, which counts from 1.
std::string lives_header();
std::string life_row(size_t number, const Life& life, const Beginning& run);

/// From when the times of a record count that began at `first`, on the clock by which `now` is told: the same, or, if
/// the machine was started again or is another, as wall clocks have it.
Beginning continued(const Life& first, const Life& now);

/// Bytes of a file up to the end of its last whole row; 0: there is none.
uint64_t whole_rows(const std::string& path);
/// Of a trace (trace_file.h): up to its last whole event, without the list's end; 0: it is to be made anew.
uint64_t whole_events(const std::string& path);

/// What the tables in `directory` add up to. Rows that cannot be read are left out, and those of what began before
/// from_s: frames, requests, leases and plans, since the run's beginning.
Measured read_back(const std::string& directory, const std::vector<Life>& lives, double from_s = -1e300);
/// Columns of a table's header; none if it has no whole one.
std::vector<std::string> header_of(const std::string& path);

}  // namespace telesplat::metrics
