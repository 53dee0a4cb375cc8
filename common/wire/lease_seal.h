// Seals of leases: the packer takes only what its master leased, for the frame, the rectangle and the sampler that it
// was leased for. A seal is a keyed BLAKE2b hash (libsodium's crypto_generichash) of the encoded lease. The master
// makes a key when it starts, and tells it to the packer alone (Welcome::lease_key).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/wire/slice_messages.h"
#include "common/wire/tile_messages.h"

namespace telesplat::wire {

/// kLeaseKeyWords random numbers.
std::vector<uint32_t> make_lease_key();

/// Sets lease.seal for `sampler`. What the sampler may change is not in it: Lease::rays, Lease::mask, moments.
/// Precondition: key has kLeaseKeyWords numbers.
void seal(Lease& lease, InstanceId sampler, std::span<const uint32_t> key);
void seal(SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key);

/// The seal is of this lease, sampler and key. False for a key of another size than kLeaseKeyWords.
bool is_sealed(const Lease& lease, InstanceId sampler, std::span<const uint32_t> key);
bool is_sealed(const SliceLease& lease, InstanceId sampler, std::span<const uint32_t> key);

}  // namespace telesplat::wire
