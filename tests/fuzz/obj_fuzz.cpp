#include "tests/fuzz/mesh_reader_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::data;
  FolderCompanions none("/nonexistent/fuzz");
  return use(read_obj({reinterpret_cast<const char*>(data), size}, "fuzz", nullptr, none));
}
