#include "tests/fuzz/mesh_reader_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return telesplat::data::use(telesplat::data::read_obj({reinterpret_cast<const char*>(data), size}, "fuzz", nullptr));
}
