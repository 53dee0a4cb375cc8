// Building blocks of masks and sparse tiles: fields, raw bits, and bytes coded by adaptive frequencies of their bits.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

namespace telesplat::codec::detail {

/// Reads fields and sub-spans, never past the end; after the first that is missing, every read fails.
class Reader {
 public:
  explicit Reader(std::span<const uint8_t> bytes) : rest_(bytes) {}
  std::optional<uint8_t> u8();
  int peek() const { return rest_.empty() ? -1 : rest_[0]; }  ///< the next byte; -1 at the end
  std::optional<uint32_t> varint();                           ///< LEB128 of at most 32 bits
  std::optional<std::span<const uint8_t>> bytes(size_t count);
  size_t left() const { return rest_.size(); }

 private:
  std::span<const uint8_t> rest_;
};

void put_varint(std::vector<uint8_t>& out, uint32_t value);

/// Appends `raw` as one self-delimiting block: constant, stored or coded by adaptive bits, the shortest of the three.
void put_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);
/// Appends `raw` as a stored block: for bits known to be random.
void put_stored_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw);

/// Fills all of `raw` from the next block. False: the block is damaged or holds another number of bytes.
[[nodiscard]] bool get_block(Reader& in, std::span<uint8_t> raw);
/// The content of a stored block, in place; nothing if the block is damaged or of another kind.
std::optional<std::span<const uint8_t>> get_stored_block(Reader& in);
/// Passes over any block. False: it is cut off.
[[nodiscard]] bool skip_block(Reader& in);

/// Packs numbers, least significant bit first, into a buffer that must have 16 bytes to spare. Loops copy it into a
/// local variable and back, so that it stays in registers.
struct BitSink {
  uint8_t* at = nullptr;
  uint64_t pending = 0;
  unsigned filled = 0;

  /// Precondition: value < 2^count, count <= 56.
  void put(uint64_t value, unsigned count) {
    pending |= value << filled;
    filled += count;
    std::memcpy(at, &pending, 8);  // whole words; the next write overlaps the unfinished byte
    at += filled >> 3;
    pending >>= filled & ~7u;
    filled &= 7;
  }
};

/// A BitSink and its buffer.
class BitWriter {
 public:
  /// Discards earlier bits; until the next call at most `max_bits` bits may follow.
  void start(size_t max_bits) {
    if (buffer_.size() < max_bits / 8 + 16) buffer_.resize(max_bits / 8 + 16);
    sink = {buffer_.data()};
  }
  std::span<const uint8_t> bytes() const {
    return {buffer_.data(), size_t(sink.at - buffer_.data()) + (sink.filled != 0)};
  }

  BitSink sink;

 private:
  std::vector<uint8_t> buffer_;
};

/// The inverse of BitSink; 16 bytes after the data must be readable.
struct BitSource {
  const uint8_t* data = nullptr;
  size_t position = 0;  ///< in bits

  /// Precondition: count <= 32.
  uint32_t take(unsigned count) {
    uint64_t word;
    std::memcpy(&word, data + (position >> 3), 8);
    word >>= position & 7;
    position += count;
    return static_cast<uint32_t>(word & ((uint64_t{1} << count) - 1));
  }
  /// The number of ones at the front of the next bits, up to 57; takes none of them.
  unsigned ones() const {
    uint64_t word;
    std::memcpy(&word, data + (position >> 3), 8);
    return static_cast<unsigned>(std::countr_one(word >> (position & 7)));
  }
};

/// A BitSource and its buffer. Reading past the end gives zeros for a while; overrun() reports it.
class BitReader {
 public:
  /// Copies `bytes`. Between two calls of overrun() at most `max_bits_unchecked` bits may be taken.
  void start(std::span<const uint8_t> bytes, size_t max_bits_unchecked) {
    const size_t padded = bytes.size() + max_bits_unchecked / 8 + 16;
    if (buffer_.size() < padded) buffer_.resize(padded);
    if (!bytes.empty()) std::memcpy(buffer_.data(), bytes.data(), bytes.size());
    std::memset(buffer_.data() + bytes.size(), 0, padded - bytes.size());
    source = {buffer_.data()};
    end_ = bytes.size() * 8;
  }
  [[nodiscard]] bool overrun() const { return source.position > end_; }
  /// True if all bits except the padding of the last byte were taken.
  [[nodiscard]] bool finished() const { return source.position <= end_ && end_ - source.position < 8; }

  BitSource source;

 private:
  std::vector<uint8_t> buffer_;
  size_t end_ = 0;
};

static_assert(std::endian::native == std::endian::little, "the streams are little-endian and are read in place");

}  // namespace telesplat::codec::detail
