#include "common/codec/entropy.h"

#include <algorithm>
#include <array>

namespace telesplat::codec::detail {
namespace {

// A block is varint(size << 2 | kind) and then `size` bytes.
enum BlockKind : uint32_t { kConstant = 0, kStored = 1, kCoded = 2 };

constexpr size_t kTooShort = 8;  // bytes: the coder's last ones take half of them

// How likely a bit is 0, in 2^-16: the mean of what two rates of learning say, both faster at first.
class Bit {
 public:
  uint32_t zero() const { return (uint32_t{fast_} + slow_) >> 5; }  // in 2^-12, 1 to 4094
  void learn(uint32_t bit) {
    const int target = bit == 0 ? 65535 : 0;
    const auto towards = [&](uint16_t from, int most) {
      return static_cast<uint16_t>(std::clamp(from + (target - from) / std::min(most, seen_ + 2), 32, 65503));
    };
    fast_ = towards(fast_, 20), slow_ = towards(slow_, 128);
    seen_ = static_cast<uint16_t>(seen_ + (seen_ < 128));
  }

 private:
  uint16_t fast_ = 1u << 15, slow_ = 1u << 15, seen_ = 0;
};

// The bits of a byte, from the highest, by those above and by what the byte before was.
class ByteModel {
 public:
  std::array<Bit, 256>& bits() { return bits_[before_]; }
  void next(uint32_t byte) { before_ = byte == 0 ? 0 : byte == 255 ? 1 : 2; }

 private:
  std::array<std::array<Bit, 256>, 3> bits_;
  size_t before_ = 0;
};

// Range coding (G. Martin, 1979) of bits, with carries as in I. Pavlov's LZMA.
class RangeEncoder {
 public:
  explicit RangeEncoder(std::vector<uint8_t>& out) : out_(out) {}
  void put(uint32_t bit, Bit& model) {
    const uint32_t bound = (range_ >> 12) * model.zero();
    if (bit == 0) {
      range_ = bound;
    } else {
      low_ += bound, range_ -= bound;
    }
    model.learn(bit);
    for (; range_ < 1u << 24; range_ <<= 8) shift();
  }
  void finish() {
    for (int i = 0; i < 5; ++i) shift();
  }

 private:
  void shift() {
    if (low_ < 0xFF000000u || low_ > 0xFFFFFFFFu) {
      const auto carry = static_cast<uint8_t>(low_ >> 32);
      if (any_) out_.push_back(static_cast<uint8_t>(cache_ + carry));
      for (; held_ != 0; --held_) out_.push_back(static_cast<uint8_t>(0xFF + carry));
      cache_ = static_cast<uint8_t>(low_ >> 24), any_ = true;
    } else {
      ++held_;
    }
    low_ = (low_ & 0x00FFFFFF) << 8;
  }

  std::vector<uint8_t>& out_;
  uint64_t low_ = 0;
  uint32_t range_ = ~0u;
  uint8_t cache_ = 0;
  bool any_ = false;
  size_t held_ = 0;
};

// Past the end of its bytes it reads zeros, and finished() is false.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const uint8_t> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = code_ << 8 | next();
  }
  uint32_t get(Bit& model) {
    const uint32_t bound = (range_ >> 12) * model.zero();
    const uint32_t bit = code_ >= bound;
    if (bit == 0) {
      range_ = bound;
    } else {
      code_ -= bound, range_ -= bound;
    }
    model.learn(bit);
    for (; range_ < 1u << 24; range_ <<= 8) code_ = code_ << 8 | next();
    return bit;
  }
  bool finished() const { return at_ == bytes_.size(); }

 private:
  uint8_t next() { return at_ < bytes_.size() ? bytes_[at_++] : (at_ = bytes_.size() + 1, uint8_t{0}); }

  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  uint32_t range_ = ~0u, code_ = 0;
};

struct Block {
  uint32_t kind;
  std::span<const uint8_t> bytes;
};
std::optional<Block> next_block(Reader& in) {
  const auto head = in.varint();
  const auto bytes = head ? in.bytes(*head >> 2) : std::nullopt;
  if (!bytes) return std::nullopt;
  return Block{*head & 3, *bytes};
}

void append(std::vector<uint8_t>& out, uint32_t kind, std::span<const uint8_t> bytes) {
  put_varint(out, static_cast<uint32_t>(bytes.size()) << 2 | kind);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void encode_bytes(std::span<const uint8_t> raw, std::vector<uint8_t>& out) {
  RangeEncoder coder(out);
  ByteModel model;
  for (const uint8_t byte : raw) {
    auto& bits = model.bits();
    for (uint32_t node = 1, i = 8; i-- > 0;) {
      const uint32_t bit = byte >> i & 1;
      coder.put(bit, bits[node]);
      node = node << 1 | bit;
    }
    model.next(byte);
  }
  coder.finish();
}

bool decode_bytes(std::span<const uint8_t> bytes, std::span<uint8_t> raw) {
  RangeDecoder coder(bytes);
  ByteModel model;
  for (uint8_t& byte : raw) {
    auto& bits = model.bits();
    uint32_t node = 1;
    while (node < 256) node = node << 1 | coder.get(bits[node]);
    byte = static_cast<uint8_t>(node);
    model.next(byte);
  }
  return coder.finished();
}

}  // namespace

std::optional<uint8_t> Reader::u8() {
  if (rest_.empty()) return std::nullopt;
  const uint8_t value = rest_[0];
  rest_ = rest_.subspan(1);
  return value;
}

std::optional<uint32_t> Reader::varint() {
  uint64_t value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const auto byte = u8();
    if (!byte) break;
    value |= uint64_t{*byte & 127u} << shift;
    if (*byte < 128 && value <= UINT32_MAX) return static_cast<uint32_t>(value);
    if (*byte < 128) break;
  }
  rest_ = {};
  return std::nullopt;
}

std::optional<std::span<const uint8_t>> Reader::bytes(size_t count) {
  if (count > rest_.size()) {
    rest_ = {};
    return std::nullopt;
  }
  const auto part = rest_.first(count);
  rest_ = rest_.subspan(count);
  return part;
}

void put_varint(std::vector<uint8_t>& out, uint32_t value) {
  for (; value >= 128; value >>= 7) out.push_back(static_cast<uint8_t>(value | 128));
  out.push_back(static_cast<uint8_t>(value));
}

void put_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw) {
  if (raw.size() < 2) return append(out, kStored, raw);
  if (std::memcmp(raw.data(), raw.data() + 1, raw.size() - 1) == 0) return append(out, kConstant, raw.first(1));
  if (raw.size() < kTooShort) return append(out, kStored, raw);
  static thread_local std::vector<uint8_t> packed;
  packed.clear();
  encode_bytes(raw, packed);
  if (packed.size() < raw.size())
    append(out, kCoded, packed);
  else
    append(out, kStored, raw);
}

void put_stored_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw) { append(out, kStored, raw); }

bool get_block(Reader& in, std::span<uint8_t> raw) {
  const auto block = next_block(in);
  if (!block) return false;
  switch (block->kind) {
    case kConstant:
      if (block->bytes.size() == 1) std::fill(raw.begin(), raw.end(), block->bytes[0]);
      return block->bytes.size() == 1;
    case kStored:
      if (block->bytes.size() == raw.size()) std::copy(block->bytes.begin(), block->bytes.end(), raw.begin());
      return block->bytes.size() == raw.size();
    case kCoded:
      return decode_bytes(block->bytes, raw);
    default:
      return false;
  }
}

std::optional<std::span<const uint8_t>> get_stored_block(Reader& in) {
  const auto block = next_block(in);
  if (!block || block->kind != kStored) return std::nullopt;
  return block->bytes;
}

bool skip_block(Reader& in) { return next_block(in).has_value(); }

}  // namespace telesplat::codec::detail
