#include "common/net/keys/key_pair.h"

#include <zmq.h>

#include <array>

#include "common/core/check.h"

namespace telesplat::net {
namespace {
constexpr size_t kBytes = 32, kCharacters = 40;
using Text = std::array<char, kCharacters + 1>;  // with the zero at its end
}  // namespace

KeyPair make_key_pair() {
  Text open{}, secret{};
  CHECK(zmq_curve_keypair(open.data(), secret.data()) == 0);  // ZeroMQ of Debian has CURVE
  return {open.data(), secret.data()};
}

bool is_key(std::string_view text) {
  std::array<unsigned char, kBytes> bytes{};
  // What is decoded stops at a zero.
  return text.size() == kCharacters && text.find('\0') == text.npos &&
         zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

std::string key_bytes(std::string_view text) {
  std::array<unsigned char, kBytes> bytes{};
  CHECK(text.size() == kCharacters && zmq_z85_decode(bytes.data(), std::string(text).c_str()));
  return {bytes.begin(), bytes.end()};
}

std::string public_of(const std::string& secret) {
  Text open{};
  CHECK(is_key(secret) && zmq_curve_public(open.data(), secret.c_str()) == 0);
  return open.data();
}

}  // namespace telesplat::net
