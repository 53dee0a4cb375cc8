// Seals of leases: the packer takes only tiles that its master leased, for the frame, the rectangle and the sampler
// that the master leased them for. A seal is a keyed BLAKE2b hash (libsodium's crypto_generichash) of the encoded
// lease. The master makes a key when it starts, and sends it to the packer alone (Welcome::lease_key).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/wire/slice_messages.h"
#include "common/wire/tile_messages.h"

namespace telesplat::wire {

/// Returns kLeaseKeyWords random numbers.
std::vector<uint32_t> make_lease_key();

/// Sets lease.seal for `sampler`. The seal does not cover fields that the sampler may change: Lease::rays, Lease::mask,
/// moments. Precondition: key has kLeaseKeyWords numbers.
void seal(Lease& lease, InstanceId sampler, std::span<const uint32_t> key);
void seal(SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key);

/// True if the seal fits this lease, sampler and key. False for a key of another size than kLeaseKeyWords.
bool is_sealed(const Lease& lease, InstanceId sampler, std::span<const uint32_t> key);
bool is_sealed(const SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key);

}  // namespace telesplat::wire
