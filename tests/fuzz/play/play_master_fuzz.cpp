// Sends the master valid messages of any role in any order.
#include "tests/fuzz/play/play_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return telesplat::test::play_or_abort(telesplat::test::play_master, data, size);
}
