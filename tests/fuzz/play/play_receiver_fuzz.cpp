// Sends a viewer of points messages that packers may send.
#include "tests/fuzz/play/play_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return telesplat::test::play_or_abort(telesplat::test::play_receiver, data, size);
}
