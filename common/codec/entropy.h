// Byte streams to fewer bytes: the entropy stage of the depth codec, on zstd.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace telesplat::codec::detail {

/// Reads little-endian fields and sub-spans, never past the end; once something is missing every later read fails too.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : rest_(bytes) {}
  std::optional<uint8_t> u8();
  std::optional<uint64_t> varint();  ///< LEB128, at most 5 bytes
  std::optional<std::span<const uint8_t>> bytes(size_t count);
  size_t left() const { return rest_.size(); }

 private:
  std::span<const uint8_t> rest_;
};

void put_varint(std::vector<uint8_t>& out, uint64_t value);

/// Appends `raw` as one self-delimiting block: constant, stored or zstd, whichever is shortest. Nothing for an empty span.
void put_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);

/// Fills all of `raw` from the block at the reader's place; false where the block is damaged or holds another count of bytes.
[[nodiscard]] bool get_block(Reader& in, std::span<uint8_t> raw);

}  // namespace telesplat::codec::detail
