// Any bytes through the decoder of any message (the first byte selects which): an error, or a message that survives a round trip.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tests/support/wire_samples.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  if (size == 0) return 0;
  const wire::Bytes body = std::as_bytes(std::span(data + 1, size - 1));
  size_t selected = data[0] % std::tuple_size_v<test::AllMessages>;
  test::for_each_message([&]<class M>(M*) {
    if (selected-- != 0) return;
    const auto message = wire::decode<M>(body);
    if (!message) {
      if (message.error().text.find(M::kName) == std::string::npos) std::abort();
      return;
    }
    const std::string encoded = wire::encode(*message);
    const auto again = wire::decode<M>(test::bytes_of(encoded));
    if (!again || wire::encode(*again) != encoded) std::abort();
  });
  return 0;
}
