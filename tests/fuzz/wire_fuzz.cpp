// Decodes any bytes as any message (the first byte selects which): gives an error, or a message that survives a round
// trip and has only valid UTF-8 texts.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "common/core/utf8.h"
#include "tests/support/wire_samples.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  if (size == 0) return 0;
  const auto& samples = test::message_samples();
  const test::MessageSample& sample = samples[data[0] % samples.size()];
  const auto encoded = sample.round_trip(std::as_bytes(std::span(data + 1, size - 1)));
  if (!encoded) {
    const std::string& why = encoded.error().text;
    if (why.find(sample.name) == std::string::npos || !valid_utf8(why)) std::abort();
    return 0;
  }
  test::value_end(*encoded, 0, [](std::string_view text) {
    if (!valid_utf8(text)) std::abort();
  });
  const auto again = sample.round_trip(test::bytes_of(*encoded));
  if (!again || *again != *encoded) std::abort();
  return 0;
}
