// How large the logs of processes may grow that nobody looks after: one that logs a line a second fills 100 MB in a
// fortnight.
#pragma once

#include <cstdint>
#include <string>

namespace telesplat::launcher {

/// Bytes after which a log begins anew. What was before is kept once, so that a process has twice as much at most, and
/// what it writes between two looks.
inline constexpr uint64_t kMostLogBytes = 64u << 20;

/// NAME.log becomes NAME.before.log, in place of an older one, if it has more than `most` bytes. The process that
/// appends to it goes on with an empty NAME.log; a line that it writes at that moment may be lost. What cannot be
/// copied, since the disk is full, is dropped. Links stay as they are.
void limit_log(const std::string& path, uint64_t most = kMostLogBytes);

}  // namespace telesplat::launcher
