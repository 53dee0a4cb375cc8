#include "common/net/keys/seal.h"

#include <sodium.h>

#include <algorithm>

#include "common/core/check.h"

namespace telesplat::net {
namespace {

// Idempotent and safe in threads; -1 only where the system has no random numbers.
void prepare() { CHECK(sodium_init() >= 0); }

unsigned char* raw(std::byte* bytes) { return reinterpret_cast<unsigned char*>(bytes); }
const unsigned char* raw(const std::byte* bytes) { return reinterpret_cast<const unsigned char*>(bytes); }

static_assert(std::tuple_size_v<SealKey> >= crypto_generichash_KEYBYTES_MIN &&
              std::tuple_size_v<SealKey> <= crypto_generichash_KEYBYTES_MAX);
static_assert(std::tuple_size_v<Seal> >= crypto_generichash_BYTES_MIN);

}  // namespace

SealKey make_seal_key() {
  prepare();
  SealKey out;
  randombytes_buf(out.data(), out.size());
  return out;
}

Seal mac(const SealKey& key, std::span<const std::byte> bytes) {
  prepare();
  Seal out;
  CHECK(crypto_generichash(raw(out.data()), out.size(), raw(bytes.data()), bytes.size(), raw(key.data()), key.size()) ==
        0);
  return out;
}

bool same_seal(const Seal& a, const Seal& b) { return sodium_memcmp(a.data(), b.data(), a.size()) == 0; }

bool same_seal(const Seal& a, std::span<const std::byte> b) {
  return a.size() == b.size() && sodium_memcmp(a.data(), b.data(), a.size()) == 0;
}

std::optional<SealKey> seal_key_of(std::span<const std::byte> bytes) {
  SealKey out;
  if (bytes.size() != out.size()) return std::nullopt;
  std::copy(bytes.begin(), bytes.end(), out.begin());
  return out;
}

}  // namespace telesplat::net
