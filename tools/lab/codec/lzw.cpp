#include "tools/lab/codec/lzw.h"

#include <algorithm>
#include <vector>

namespace telesplat::lab {
namespace {

constexpr int kClear = 256, kFirst = 258;  // 257: the end
constexpr int kFull = 4094;                // the table is cleared when it has so many entries
constexpr int kNone = -1;

// Strings that were seen: (code of all but the last byte, last byte) -> code.
class Strings {
 public:
  Strings() : codes_(size_t{kFull + 1} * 256, kNone) {}
  int code(int prefix, uint8_t last) const { return codes_[index(prefix, last)]; }
  void add(int prefix, uint8_t last, int code) {
    used_.push_back(index(prefix, last));
    codes_[used_.back()] = code;
  }
  void clear() {
    for (const size_t i : used_) codes_[i] = kNone;
    used_.clear();
  }

 private:
  static size_t index(int prefix, uint8_t last) { return size_t(prefix) * 256 + last; }
  std::vector<int> codes_;
  std::vector<size_t> used_;
};

// Width of the code that is written before entry `next` is added: one entry sooner than need be ("early change").
int width_of(int next) { return next < 512 ? 9 : next < 1024 ? 10 : next < 2048 ? 11 : 12; }

// Differences of `channels` interleaved bytes, each row by itself.
std::vector<uint8_t> differences(std::vector<uint8_t> bytes, size_t width, size_t channels) {
  const size_t row = width * channels;
  for (size_t begin = 0; begin < bytes.size(); begin += row)
    for (size_t i = begin + row; i-- > begin + channels;) bytes[i] = uint8_t(bytes[i] - bytes[i - channels]);
  return bytes;
}

std::vector<uint8_t> bytes_of(std::span<const uint32_t> values) {
  std::vector<uint8_t> out;
  out.reserve(3 * values.size());
  for (const uint32_t v : values)
    for (int shift = 16; shift >= 0; shift -= 8) out.push_back(uint8_t(v >> shift));
  return out;
}

std::vector<uint32_t> whole_differences(std::span<const uint32_t> values, size_t width) {
  std::vector<uint32_t> out(values.begin(), values.end());
  for (size_t i = 0; i < out.size(); ++i)
    if (i % width != 0) out[i] = values[i] - values[i - 1];
  return out;
}

}  // namespace

size_t lzw_bits(std::span<const uint8_t> bytes) {
  static thread_local Strings strings;
  strings.clear();
  int next = kFirst, prefix = kNone;
  size_t bits = 9;  // kClear
  for (const uint8_t byte : bytes) {
    if (prefix == kNone) {
      prefix = byte;
      continue;
    }
    if (const int known = strings.code(prefix, byte); known != kNone) {
      prefix = known;
      continue;
    }
    bits += size_t(width_of(next));
    strings.add(prefix, byte, next++);
    prefix = byte;
    if (next < kFull) continue;
    bits += 12;  // kClear
    strings.clear();
    next = kFirst;
  }
  if (prefix != kNone) bits += size_t(width_of(next++));
  return bits + size_t(width_of(next));
}

size_t lzw_bits(const image::DepthImage& image) {
  const auto width = size_t(image.width);
  std::vector<uint8_t> normal;
  for (const uint16_t n : image.normal) normal.insert(normal.end(), {uint8_t(n), uint8_t(n >> 8)});
  return std::min(lzw_bits(differences(bytes_of(image.depth), width, 3)),
                  lzw_bits(bytes_of(whole_differences(image.depth, width)))) +
         lzw_bits(differences(bytes_of(image.colour), width, 3)) + lzw_bits(differences(std::move(normal), width, 2));
}

}  // namespace telesplat::lab
