#include "tools/wan_relay/socks.h"

#include <fmt/format.h>

#include <utility>

namespace telesplat::wan_relay {
namespace {

constexpr uint8_t kVersion = 5, kNoPassword = 0, kNoMethod = 0xff, kConnect = 1;
constexpr uint8_t kIpv4 = 1, kName = 3, kIpv6 = 4;

uint8_t byte(std::string_view bytes, size_t at) { return static_cast<uint8_t>(bytes[at]); }

std::string ipv6_text(std::string_view bytes) {
  std::string out;
  for (size_t i = 0; i < 16; i += 2)
    out += fmt::format("{}{:x}", i ? ":" : "", byte(bytes, i) << 8 | byte(bytes, i + 1));
  return out;
}

}  // namespace

Status SocksDialogue::take(std::string_view bytes) {
  buffer_ += bytes;
  if (!buffer_.empty() && state_ != State::kAsked && byte(buffer_, 0) != kVersion)
    return Error{fmt::format("speaks version {} of SOCKS, or something else; 5 is spoken here", byte(buffer_, 0))};
  if (state_ == State::kGreeting)
    if (const Status s = take_greeting(); !s) return s;
  return state_ == State::kRequest ? take_request() : ok_status();
}

Status SocksDialogue::take_greeting() {
  if (buffer_.size() < 2 || buffer_.size() < 2u + byte(buffer_, 1)) return ok_status();
  const size_t methods = byte(buffer_, 1);
  const bool open = buffer_.substr(2, methods).find(char(kNoPassword)) != std::string::npos;
  answer_ += {char(kVersion), char(open ? kNoPassword : kNoMethod)};
  if (!open) return Error{"wants to be asked for a password; there is none"};
  buffer_.erase(0, 2 + methods);
  state_ = State::kRequest;
  if (!buffer_.empty() && byte(buffer_, 0) != kVersion) return Error{"sent a request that is none of SOCKS 5"};
  return ok_status();
}

Status SocksDialogue::take_request() {
  if (buffer_.size() < 5) return ok_status();
  const uint8_t kind = byte(buffer_, 3);
  const size_t address = kind == kIpv4 ? 4 : kind == kIpv6 ? 16 : kind == kName ? 1u + byte(buffer_, 4) : 0;
  if (byte(buffer_, 1) != kConnect || address == 0)
    return Error{
        fmt::format("sent command {} with an address of kind {}; connections (1) to addresses of kind 1, 3 "
                    "and 4 are made here",
                    byte(buffer_, 1), kind)};
  if (buffer_.size() < 4 + address + 2) return ok_status();
  const std::string_view at = std::string_view(buffer_).substr(4, address);
  if (kind == kIpv4)
    host_ = fmt::format("{}.{}.{}.{}", byte(at, 0), byte(at, 1), byte(at, 2), byte(at, 3));
  else
    host_ = kind == kIpv6 ? ipv6_text(at) : std::string(at.substr(1));
  port_ = uint16_t(byte(buffer_, 4 + address) << 8 | byte(buffer_, 5 + address));
  if (buffer_.size() > 6 + address) return Error{"went on before it was answered"};
  state_ = State::kAsked;
  return ok_status();
}

std::string SocksDialogue::take_answer() { return std::exchange(answer_, {}); }

std::string SocksDialogue::reply(Outcome outcome) {
  return {char(kVersion), char(outcome), 0, char(kIpv4), 0, 0, 0, 0, 0, 0};
}

}  // namespace telesplat::wan_relay
