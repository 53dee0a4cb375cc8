#include <string>

#include "services/data/cloud/readers.h"
#include "tests/fuzz/mesh_reader_fuzz.h"

// Makes the check sums of pages right, so that what stands behind them is reached.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  constexpr size_t kPage = 1024, kPayload = kPage - 4;
  std::string file(reinterpret_cast<const char*>(data), size);
  for (size_t page = 0; page + kPage <= size; page += kPage) {
    uint32_t sum = ~uint32_t{0};
    for (size_t i = 0; i < kPayload; ++i) {
      sum ^= uint8_t(file[page + i]);
      for (int bit = 0; bit < 8; ++bit) sum = sum >> 1 ^ (sum & 1 ? 0x82f63b78 : 0);
    }
    for (size_t i = 0; i < 4; ++i) file[page + kPayload + i] = char(~sum >> (24 - 8 * i));
  }
  const auto cloud = telesplat::data::read_e57(file, "fuzz", nullptr);
  return cloud ? telesplat::data::use((*cloud)->mesh()) : 0;
}
