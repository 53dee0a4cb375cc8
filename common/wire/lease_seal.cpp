#include "common/wire/lease_seal.h"

#include <sodium.h>

#include <string>

#include "common/core/check.h"
#include "common/core/machine.h"
#include "common/wire/serial.h"

namespace telesplat::wire {
namespace {

using Words = std::vector<uint32_t>;
constexpr size_t kSealBytes = kSealWords * sizeof(uint32_t);
static_assert(kLeaseKeyWords * sizeof(uint32_t) == crypto_generichash_KEYBYTES);
static_assert(kSealBytes >= crypto_generichash_BYTES_MIN);

bool ready() {
  static const bool done = sodium_init() >= 0;
  return done;
}

Words seal_of(const std::string& encoded, InstanceId sampler, std::span<const uint32_t> key) {
  CHECK(ready() && key.size() == kLeaseKeyWords);
  Words out(kSealWords);
  crypto_generichash_state state;
  crypto_generichash_init(&state, reinterpret_cast<const unsigned char*>(key.data()), key.size_bytes(), kSealBytes);
  crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(&sampler.value), sizeof sampler.value);
  crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(encoded.data()), encoded.size());
  crypto_generichash_final(&state, reinterpret_cast<unsigned char*>(out.data()), kSealBytes);
  return out;
}

// Encodes the fields of a lease that samplers do not change.
std::string fixed_part(const Lease& lease) {
  Lease fixed = lease;
  fixed.rays = 0;
  fixed.mask.clear();
  fixed.seal.clear();
  fixed.moments = {};
  return encode(fixed);
}
std::string fixed_part(const SliceLease& lease) {
  SliceLease fixed = lease;
  fixed.seal.clear();
  fixed.moments = {};
  return encode(fixed);
}

template <class L>
bool fits(const L& lease, InstanceId sampler, std::span<const uint32_t> key) {
  if (!ready() || key.size() != kLeaseKeyWords || lease.seal.size() != kSealWords) return false;
  const Words wanted = seal_of(fixed_part(lease), sampler, key);
  return sodium_memcmp(wanted.data(), lease.seal.data(), kSealBytes) == 0;
}

}  // namespace

std::vector<uint32_t> make_lease_key() {
  CHECK(ready());
  Words out(kLeaseKeyWords);
  if (simulated_world())
    for (uint32_t& word : out) word = uint32_t(random_bits());
  else
    randombytes_buf(out.data(), out.size() * sizeof out[0]);
  return out;
}

void seal(Lease& lease, InstanceId sampler, std::span<const uint32_t> key) {
  lease.seal = seal_of(fixed_part(lease), sampler, key);
}
void seal(SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key) {
  lease.seal = seal_of(fixed_part(lease), sampler, key);
}

bool is_sealed(const Lease& lease, InstanceId sampler, std::span<const uint32_t> key) {
  return fits(lease, sampler, key);
}
bool is_sealed(const SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key) {
  return fits(lease, sampler, key);
}

}  // namespace telesplat::wire
