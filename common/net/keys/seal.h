// Seals: keyed hashes (BLAKE2b of libsodium), by which a process sees that bytes come from one that knows the key.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace telesplat::net {

using SealKey = std::array<std::byte, 32>;
using Seal = std::array<std::byte, 16>;

/// A random key.
SealKey make_seal_key();

/// The seal of `bytes`, of any length, under `key`. Whoever does not know the key cannot make it.
Seal mac(const SealKey& key, std::span<const std::byte> bytes);

/// The time this takes does not tell where they differ.
bool same_seal(const Seal& a, const Seal& b);
/// The same of bytes that a peer sent: false, too, if they are not as long as a seal.
bool same_seal(const Seal& a, std::span<const std::byte> b);

/// Of bytes that a peer sent. Nothing: they are not as long as a key.
std::optional<SealKey> seal_key_of(std::span<const std::byte> bytes);

}  // namespace telesplat::net
