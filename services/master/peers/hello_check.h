// What a process may say of itself: all of it is remembered, and parts of it are told to everyone.
#pragma once

#include "common/core/result.h"
#include "common/wire/session_messages.h"

namespace telesplat::master {

inline constexpr size_t kMaxNameBytes = 128;
inline constexpr size_t kMaxEndpoints = 16;
inline constexpr size_t kMaxFacts = 64;
inline constexpr size_t kMaxFactsBytes = 512u << 10;  ///< all of them together: a welcome with them is a message
inline constexpr size_t kMaxParameters = 256;

/// Error: which of these is exceeded, a role that is none of "data", "sampler", "packer", "viewer", "ctl", an instance
/// that is 0 or not below 2^53, a name that is missing or has control characters: it is shown and written to files.
Status check_hello(const wire::Hello& hello);

}  // namespace telesplat::master
