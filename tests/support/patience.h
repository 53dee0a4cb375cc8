// How long tests wait for what is to happen.
#pragma once

namespace telesplat::test {

/// Seconds that a test of such a deadline waits, given those of ordinary builds: sanitized programs are several times
/// slower. Waiting ends when what is waited for happens, so a long deadline costs time only where a test fails.
constexpr double patient(double seconds) {
#ifdef TELESPLAT_SANITIZED
  return 5 * seconds;
#else
  return seconds;
#endif
}

}  // namespace telesplat::test
