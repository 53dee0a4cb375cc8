#include "common/codec/surfel_codec.h"

#include <array>

#include "common/codec/range_coder.h"
#include "common/core/check.h"

namespace telesplat::codec {
namespace {

using detail::AdaptiveBit;

constexpr int kLevels = 8;
// Bits of a stream's numbers: count of leaves, a leaf's key and its number.
constexpr unsigned kCountBits = 17, kKeyBits = 30, kFirstBits = 24;

// Frequencies of a byte, bit by bit, the highest first.
using ByteModel = std::array<AdaptiveBit, 256>;

struct Models {
  std::array<ByteModel, kLevels> children;
  std::array<ByteModel, 2> normal;
  std::array<ByteModel, 3> colour;
};

// Codes a byte with either direction's coder, and returns it.
uint8_t code_byte(const auto& coder, uint8_t value, ByteModel& model) {
  uint32_t at = 1;
  for (int i = 7; i >= 0; --i) at = at << 1 | coder(value >> i & 1, model[at]);
  return static_cast<uint8_t>(at);
}

// Spreads eight bits, with two zeros between them; and back.
uint32_t spread(uint32_t v) {
  v = (v | v << 8) & 0x00f00f;
  v = (v | v << 4) & 0x0c30c3;
  return (v | v << 2) & 0x249249;
}
uint8_t gathered(uint32_t v) {
  v &= 0x249249;
  v = (v | v >> 2) & 0x0c30c3;
  v = (v | v >> 4) & 0x00f00f;
  return static_cast<uint8_t>(v | v >> 8);
}

// Codes what is not position: differences from the point before, blue and red after what green has told.
void code_look(const auto& coder, Models& models, const LeafSurfel& before, LeafSurfel& s) {
  const auto part = [&](uint32_t value, uint32_t guess, ByteModel& model) {
    return static_cast<uint8_t>(code_byte(coder, static_cast<uint8_t>(value - guess), model) + guess);
  };
  const uint32_t x = part(s.normal & 255, before.normal & 255, models.normal[0]);
  const uint32_t y = part(s.normal >> 8, before.normal >> 8, models.normal[1]);
  s.normal = static_cast<uint16_t>(x | y << 8);
  const auto channel = [](const LeafSurfel& of, int shift) { return of.colour >> shift & 255; };
  const uint32_t g = part(channel(s, 8), channel(before, 8), models.colour[1]), step = g - channel(before, 8);
  const uint32_t r = part(channel(s, 16), channel(before, 16) + step, models.colour[0]);
  const uint32_t b = part(channel(s, 0), channel(before, 0) + step, models.colour[2]);
  s.colour = r << 16 | g << 8 | b;
}

void encode_node(const detail::BitCoder& coder, Models& models, std::span<const uint32_t> places, int level) {
  const int shift = 3 * (kLevels - 1 - level);
  std::array<size_t, 9> begin{};
  uint8_t occupied = 0;
  for (const uint32_t place : places) {
    const uint32_t child = place >> shift & 7;
    ++begin[child + 1];
    occupied = static_cast<uint8_t>(occupied | 1u << child);
  }
  code_byte(coder, occupied, models.children[static_cast<size_t>(level)]);
  if (level + 1 == kLevels) return;
  for (size_t c = 0; c < 8; ++c) {
    begin[c + 1] += begin[c];
    if (begin[c + 1] > begin[c])
      encode_node(coder, models, places.subspan(begin[c], begin[c + 1] - begin[c]), level + 1);
  }
}

// False: damaged, or more than `most` places.
bool decode_node(const detail::BitDecoder& coder, Models& models, uint32_t prefix, int level, size_t most,
                 std::vector<uint32_t>& out) {
  const uint8_t occupied = code_byte(coder, 0, models.children[static_cast<size_t>(level)]);
  if (occupied == 0) return false;
  for (uint32_t c = 0; c < 8; ++c) {
    if ((occupied >> c & 1) == 0) continue;
    if (level + 1 == kLevels) {
      if (out.size() >= most) return false;
      out.push_back(prefix << 3 | c);
    } else if (!decode_node(coder, models, prefix << 3 | c, level + 1, most, out)) {
      return false;
    }
  }
  return true;
}

}  // namespace

uint32_t LeafSurfel::place() const { return spread(x) | spread(y) << 1 | spread(z) << 2; }

std::vector<uint8_t> encode_surfels(std::span<const SurfelLeaf> leaves) {
  CHECK(leaves.size() <= kMaxSurfelLeaves);
  std::vector<uint8_t> out;
  detail::RangeEncoder encoder(out);
  const detail::BitCoder coder{encoder};
  Models models;
  std::vector<uint32_t> places;
  LeafSurfel before;
  coder.raw(static_cast<uint32_t>(leaves.size()), kCountBits);
  for (const SurfelLeaf& leaf : leaves) {
    coder.raw(leaf.key, kKeyBits), coder.raw(leaf.first, kFirstBits);
    places.clear();
    for (const LeafSurfel& s : leaf.surfels) places.push_back(s.place());
    encode_node(coder, models, places, 0);
    for (const LeafSurfel& s : leaf.surfels) {
      LeafSurfel coded = s;
      code_look(coder, models, before, coded);
      before = s;
    }
  }
  encoder.finish();
  return out;
}

Result<std::vector<SurfelLeaf>> decode_surfels(std::span<const uint8_t> bytes) {
  detail::RangeDecoder decoder(bytes);
  const detail::BitDecoder coder{decoder};
  Models models;
  std::vector<SurfelLeaf> out;
  std::vector<uint32_t> places;
  LeafSurfel before;
  size_t left = kMaxCodedSurfels;
  const uint32_t count = coder.raw(0, kCountBits);
  if (count > kMaxSurfelLeaves) return Error{"surfels: too many leaves"};
  for (uint32_t n = 0; n < count; ++n) {
    SurfelLeaf leaf;
    leaf.key = coder.raw(0, kKeyBits), leaf.first = coder.raw(0, kFirstBits);
    places.clear();
    if (!decode_node(coder, models, 0, 0, left, places)) return Error{"surfels: a damaged or too large leaf"};
    left -= places.size();
    leaf.surfels.reserve(places.size());
    for (const uint32_t place : places) {
      LeafSurfel s{gathered(place), gathered(place >> 1), gathered(place >> 2)};
      code_look(coder, models, before, s);
      leaf.surfels.push_back(before = s);
    }
    out.push_back(std::move(leaf));
  }
  return out;
}

}  // namespace telesplat::codec
