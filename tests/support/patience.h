// How long tests wait for what is to happen, and what they may expect of slow programs.
#pragma once

#include <string>

namespace telesplat::test {

/// Sanitized programs, which do less in the same time.
#ifdef TELESPLAT_SANITIZED
inline constexpr bool kSlow = true;
#else
inline constexpr bool kSlow = false;
#endif

/// Seconds that a test of such a deadline waits, given those of ordinary builds: sanitized programs are several times
/// slower. Waiting ends when what is waited for happens, so a long deadline costs time only where a test fails.
constexpr double patient(double seconds) { return kSlow ? 5 * seconds : seconds; }

/// What a program is told, if it is sanitized something else: a longer duration, fewer views to verify.
inline std::string ordinary_or_slow(const char* ordinary, const char* slow) { return kSlow ? slow : ordinary; }

}  // namespace telesplat::test
