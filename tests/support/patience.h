// Deadlines of tests, and their expectations of slow programs.
#pragma once

#include <string>

namespace telesplat::test {

/// Sanitized programs do less in the same time.
#ifdef TELESPLAT_SANITIZED
inline constexpr bool kSlow = true;
#else
inline constexpr bool kSlow = false;
#endif

/// Returns a test's deadline in seconds, given that of ordinary builds: sanitized programs are several times slower. A
/// wait ends as soon as its condition holds, so a long deadline costs time only when a test fails.
constexpr double patient(double seconds) { return kSlow ? 5 * seconds : seconds; }

/// Returns a program's argument; a sanitized program needs another one: a longer duration, fewer views to verify.
inline std::string ordinary_or_slow(const char* ordinary, const char* slow) { return kSlow ? slow : ordinary; }

}  // namespace telesplat::test
