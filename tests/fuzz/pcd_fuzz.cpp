#include "services/data/cloud/readers.h"
#include "tests/fuzz/mesh_reader_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto cloud = telesplat::data::read_pcd({reinterpret_cast<const char*>(data), size}, "fuzz", nullptr);
  return cloud ? telesplat::data::use((*cloud)->mesh()) : 0;
}
