// A record that several masters wrote, one after the other: a master that was killed and started again goes on with it.
// lives.csv has the time when each began, and the place in each file where its rows begin. The figures of such a record
// come from its files: no single master has all of them in memory.
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
/// Returns the name of a table's file, such as "frames.csv".
const char* file_of(Csv csv);

struct Life {
  Beginning begin;                      ///< begin of this master, by its machine's clocks
  std::string clock;                    ///< clock_id() of its machine
  std::array<uint64_t, kCsvs> bytes{};  ///< size of each table by then
};

/// Reads lives.csv of a folder. Error: there is no such file, or it has other content.
Result<std::vector<Life>> read_lives(const std::string& directory);
/// Return the header, and the row of life `number`, which counts from 1.
std::string lives_header();
std::string life_row(size_t number, const Life& life, const Beginning& run);

/// Returns the begin of a record, from which its times count, on the monotonic clock of `now`: first.begin, or, if the
/// machine was restarted or is another one, its time by the wall clocks.
Beginning continued(const Life& first, const Life& now);

/// Returns the bytes of a file up to the end of its last whole row; 0: it has no whole row.
uint64_t whole_rows(const std::string& path);
/// Likewise for a trace (trace_file.h): up to its last whole event, without the list's end; 0: make the file anew.
uint64_t whole_events(const std::string& path);

/// Reads the figures of the tables in `directory`. Leaves out rows that cannot be read, and rows of frames, requests,
/// leases and plans that began before from_s, in seconds since the run's beginning.
Measured read_back(const std::string& directory, const std::vector<Life>& lives, double from_s = -1e300);
/// Returns the columns of a table's header; empty if it has no whole header.
std::vector<std::string> header_of(const std::string& path);

}  // namespace telesplat::metrics
