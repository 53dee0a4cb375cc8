// Encoding and decoding of messages: msgpack maps, validated before anything is allocated.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::wire {

/// One msgpack map: "v" and the fields of M.
template <class M>
std::string encode(const M& message);

/// Reads what encode() made. Refuses, naming field, value and limit: bodies over the message's size limit, bytes that are not
/// one msgpack map, other versions, missing fields, fields of another type or beyond their limit, cameras that
/// geometry::validate refuses, numbers that are not finite. Unknown fields are ignored. Bulk fields point into `body`.
template <class M>
Result<M> decode(Bytes body);

}  // namespace telesplat::wire
