// Runs a play as a fuzz target.
#pragma once

#include <cstdio>
#include <cstdlib>

#include "tests/support/play/play.h"

namespace telesplat::test {

inline int play_or_abort(Play play, const uint8_t* data, size_t size) {
  if (const Complaint complaint = play({data, size}, nullptr)) {
    std::fprintf(stderr, "%s\n", complaint->c_str());
    std::abort();
  }
  return 0;
}

}  // namespace telesplat::test
