// One run of a sweep: `telesplat run` as a child process, watched until it has ended.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "tools/telesplat/sweep/load.h"

namespace telesplat::launcher {

struct RunRequest {
  std::string program;                 ///< telesplat
  std::vector<std::string> arguments;  ///< run, scene, flags, --out
  std::string log;                     ///< file that what it says on stderr is appended to
  double limit_s = 0;                  ///< it is ended when it takes longer, and has failed; 0: no limit
};

struct RunEnd {
  int exit_code = 0;         ///< or 128 + signal
  std::string reason;        ///< empty: it is done
  bool interrupted = false;  ///< this process was told to stop meanwhile
  double wall_s = 0;
  Load load;
};

/// Runs it to its end. watch(seconds since its start) is called every 50 ms. If this process is told to stop, the run
/// is told once (it ends in order), and again if that is repeated; the third time it is killed.
RunEnd carry_out(const RunRequest& request, const std::function<void(double)>& watch);

inline constexpr uintmax_t kMostLastWords = 1 << 20;
/// What was written to a file behind its first `offset` bytes, the last kMostLastWords bytes of it.
std::string last_words(const std::string& path, uintmax_t offset);

/// What a run said last that it complained about: the last line that begins "telesplat: ", else the last one; without
/// control characters, 300 bytes at most.
std::string complaint_in(const std::string& log);

}  // namespace telesplat::launcher
