// CURVE keys as text: Z85, 40 characters.
#pragma once

#include <string>
#include <string_view>

namespace telesplat::net {

struct KeyPair {
  std::string open;    ///< the public key: others know its owner by it
  std::string secret;  ///< only its owner has it
};

KeyPair make_key_pair();

/// Whether it is one of 32 bytes, as text.
bool is_key(std::string_view text);
/// The 32 bytes that it stands for; is_key(text) must be true.
std::string key_bytes(std::string_view text);
/// The public key that belongs to a secret one; is_key(secret) must be true.
std::string public_of(const std::string& secret);

}  // namespace telesplat::net
