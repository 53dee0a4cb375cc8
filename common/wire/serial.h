// Encodes and decodes messages: msgpack maps, validated before memory is allocated.
#pragma once

#include <optional>
#include <string>
#include <type_traits>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::wire {
namespace detail {

template <class M, class... Listed>
consteval size_t number_in(std::type_identity<std::tuple<Listed...>>) {
  size_t number = 0;
  static_cast<void>(((std::is_same_v<M, Listed> || (++number, false)) || ...));
  return number;
}
/// The index of a message in Messages: serial.cpp finds messages by it.
template <class M>
constexpr size_t number_of() {
  constexpr size_t number = number_in<M>(std::type_identity<Messages>{});
  static_assert(number < std::tuple_size_v<Messages>, "a message must be in wire::Messages");
  return number;
}

std::string encode(size_t number, const void* message);
std::optional<Error> decode(size_t number, Bytes body, void* message);

}  // namespace detail

/// Writes one msgpack map: "v" and the fields of M. Bytes of texts that are not UTF-8 are sent as U+FFFD.
template <class M>
std::string encode(const M& message) {
  return detail::encode(detail::number_of<M>(), &message);
}

/// Reads what encode() made. Refuses, naming field, value and limit: bodies over the message's size limit, bytes that
/// are not one msgpack map, other versions, missing fields, fields of another type or beyond their limit, strings that
/// are not UTF-8, cameras that geometry::validate refuses, numbers that are not finite. Ignores unknown fields. Bulk
/// fields point into `body`.
template <class M>
Result<M> decode(Bytes body) {
  M message;
  if (auto refused = detail::decode(detail::number_of<M>(), body, &message)) return *std::move(refused);
  return message;
}

/// The version of a message's body, if it has one that differs from kProtocolVersion.
std::optional<uint64_t> other_version(Bytes body);
/// Names both versions, for a process that says hello to a master.
std::string about_versions(uint64_t other);
/// Encodes for a process of that version: these two messages have been the same since the first version, and stay.
std::string encode_for(uint64_t version, const Shutdown& message);
std::string encode_for(uint64_t version, const ControlReply& message);

}  // namespace telesplat::wire
