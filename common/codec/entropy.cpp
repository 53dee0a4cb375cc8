#include "common/codec/entropy.h"

#include <algorithm>
#include <array>

#include "common/codec/range_coder.h"

namespace telesplat::codec::detail {
namespace {

// A block is varint(size << 2 | kind) and then `size` bytes.
enum BlockKind : uint32_t { kConstant = 0, kStored = 1, kCoded = 2 };

constexpr size_t kTooShort = 4;  // bytes: shorter data are not coded

// Models the bits of a byte, from the highest, by the higher bits and by the kind of the byte before.
class ByteModel {
 public:
  std::array<AdaptiveBit, 256>& bits() { return bits_[before_]; }
  void next(uint32_t byte) { before_ = byte == 0 ? 0 : byte == 255 ? 1 : 2; }

 private:
  std::array<std::array<AdaptiveBit, 256>, 3> bits_;
  size_t before_ = 0;
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
