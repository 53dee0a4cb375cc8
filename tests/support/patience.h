// How long tests wait for what is to happen, and what they may expect of slow programs.
#pragma once

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

}  // namespace telesplat::test
