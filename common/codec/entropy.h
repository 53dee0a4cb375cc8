// The entropy stage: byte streams through zstd's Huffman coder, and raw bits beside them.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace telesplat::codec::detail {

/// Reads fields and sub-spans, never past the end; once something is missing every later read fails too.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : rest_(bytes) {}
  std::optional<uint8_t> u8();
  std::optional<uint32_t> varint();  ///< LEB128 of at most 32 bits
  std::optional<std::span<const uint8_t>> bytes(size_t count);
  size_t left() const { return rest_.size(); }

 private:
  std::span<const uint8_t> rest_;
};

void put_varint(std::vector<uint8_t>& out, uint32_t value);

/// Appends `raw` as one self-delimiting block: constant, stored or zstd, whichever is shorter.
void put_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);
/// Appends `raw` as a stored block: for bits known to be random.
void put_stored_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);

/// Fills all of `raw` from the block at the reader's place; false where the block is damaged or holds another number of bytes.
[[nodiscard]] bool get_block(Reader& in, std::span<uint8_t> raw);
/// The content of a stored block, in place; nothing where the block is damaged or of another kind.
std::optional<std::span<const uint8_t>> get_stored_block(Reader& in);
/// Passes over any block; nothing where it is damaged, else the bytes it takes in the stream.
std::optional<size_t> skip_block(Reader& in);

/// Packs numbers of up to 32 bits, least significant bit first.
class BitWriter {
 public:
  /// Forgets what was written; until the next call at most `max_bits` bits follow.
  void start(size_t max_bits) {
    if (buffer_.size() < max_bits / 8 + 16) buffer_.resize(max_bits / 8 + 16);
    at_ = buffer_.data(), pending_ = 0, filled_ = 0;
  }
  /// Precondition: value < 2^count, count <= 32.
  void put(uint64_t value, unsigned count) {
    pending_ |= value << filled_;
    filled_ += count;
    std::memcpy(at_, &pending_, 8);  // whole words; the next write overlaps the unfinished byte
    at_ += filled_ >> 3;
    pending_ >>= filled_ & ~7u;
    filled_ &= 7;
  }
  std::span<const uint8_t> bytes() const { return {buffer_.data(), size_t(at_ - buffer_.data()) + (filled_ != 0)}; }

 private:
  std::vector<uint8_t> buffer_;
  uint8_t* at_ = nullptr;
  uint64_t pending_ = 0;
  unsigned filled_ = 0;
};

/// The other direction. Reading past the end gives zeros for a while, and is found by overrun().
class BitReader {
 public:
  /// Copies `bytes`. Between two calls of overrun() at most `max_bits_unchecked` bits may be taken.
  void start(std::span<const uint8_t> bytes, size_t max_bits_unchecked) {
    const size_t padded = bytes.size() + max_bits_unchecked / 8 + 16;
    if (buffer_.size() < padded) buffer_.resize(padded);
    if (!bytes.empty()) std::memcpy(buffer_.data(), bytes.data(), bytes.size());
    std::memset(buffer_.data() + bytes.size(), 0, padded - bytes.size());
    position_ = 0, end_ = bytes.size() * 8;
  }
  /// Precondition: count <= 32.
  uint32_t take(unsigned count) {
    uint64_t word;
    std::memcpy(&word, buffer_.data() + (position_ >> 3), 8);
    word >>= position_ & 7;
    position_ += count;
    return static_cast<uint32_t>(word & ((uint64_t{1} << count) - 1));
  }
  [[nodiscard]] bool overrun() const { return position_ > end_; }
  /// True when all bits but the padding of the last byte were taken.
  [[nodiscard]] bool finished() const { return position_ <= end_ && end_ - position_ < 8; }

 private:
  std::vector<uint8_t> buffer_;
  size_t position_ = 0, end_ = 0;
};

static_assert(std::endian::native == std::endian::little, "the streams are little-endian and are read in place");

}  // namespace telesplat::codec::detail
