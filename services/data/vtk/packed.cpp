#include "services/data/vtk/files.h"

#include <fmt/format.h>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "common/parallel/in_parallel.h"

namespace telesplat::data::vtk {
namespace {

constexpr uint32_t kBad = 1u << 24;
constexpr std::array<uint32_t, 256> kSixBits = [] {
  std::array<uint32_t, 256> out{};
  out.fill(kBad);
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (size_t i = 0; i < kDigits.size(); ++i) out[static_cast<unsigned char>(kDigits[i])] = uint32_t(i);
  return out;
}();

uint32_t six_bits(char c) { return kSixBits[static_cast<unsigned char>(c)]; }

// Returns the best ratio of a compressor, to 1.
uint64_t best_packing(Packing packing) {
  return packing == Packing::kLzma ? 10'000 : packing == Packing::kLz4 ? 256 : 1032;
}

bool unpack_block(Packing packing, std::span<const std::byte> from, std::span<std::byte> to) {
  if (packing == Packing::kZlib) {
    uLongf size = to.size();
    return uncompress(reinterpret_cast<Bytef*>(to.data()), &size, reinterpret_cast<const Bytef*>(from.data()),
                      from.size()) == Z_OK &&
           size == to.size();
  }
  if (packing == Packing::kLz4)
    return from.size() < INT32_MAX && to.size() < INT32_MAX &&
           LZ4_decompress_safe(reinterpret_cast<const char*>(from.data()), reinterpret_cast<char*>(to.data()),
                               int(from.size()), int(to.size())) == int(to.size());
  uint64_t memory = uint64_t{256} << 20;
  size_t read = 0, written = 0;
  return lzma_stream_buffer_decode(&memory, 0, nullptr, reinterpret_cast<const uint8_t*>(from.data()), &read,
                                   from.size(), reinterpret_cast<uint8_t*>(to.data()), &written,
                                   to.size()) == LZMA_OK &&
         written == to.size();
}

bool read_number(EncodedBytes& in, size_t bytes, bool big_endian, uint64_t& out) {
  std::byte b[8];
  if (!in.read(b, bytes)) return false;
  out = 0;
  for (size_t i = 0; i < bytes; ++i) out |= uint64_t(b[big_endian ? bytes - 1 - i : i]) << (8 * i);
  return true;
}

// A header of packed data.
struct Blocks {
  uint64_t count = 0, bytes = 0, last_bytes = 0, total = 0, packed_total = 0;
  std::vector<uint64_t> packed;  // size of each block
};

Blocks read_blocks(EncodedBytes& in, Packing packing, size_t header_bytes, bool big_endian, const std::string& what) {
  Blocks out;
  const auto next = [&](uint64_t& number) { return read_number(in, header_bytes, big_endian, number); };
  if (!next(out.count)) refuse("{} is cut off before its data", what);
  if (out.count == 0) return out;
  const uint64_t there = in.most_left();
  if (!next(out.bytes) || !next(out.last_bytes) || out.count > there / header_bytes)
    refuse("{} claims {} blocks in {} bytes", what, out.count, there);
  if (out.last_bytes == 0) out.last_bytes = out.bytes;
  for (uint64_t i = 0; i < out.count; ++i) {
    uint64_t packed = 0;
    if (!next(packed) || packed > there || out.packed_total + packed > there)
      refuse("{} is cut off: block {} of {} is not there", what, i, out.count);
    out.packed.push_back(packed);
    out.packed_total += packed;
  }
  const uint64_t most = (out.packed_total + 64) * best_packing(packing);
  if (out.last_bytes > out.bytes || out.last_bytes > most ||
      (out.count > 1 && out.count - 1 > most / std::max<uint64_t>(out.bytes, 1)))
    refuse("{} claims {} blocks of {} bytes, packed to {}", what, out.count, out.bytes, out.packed_total);
  out.total = (out.count - 1) * out.bytes + out.last_bytes;
  return out;
}

}  // namespace

bool EncodedBytes::read_group() {
  group_at_ = group_size_ = 0;
  uint32_t bits = 0;
  int digits = 0, padding = 0;
  while (digits + padding < 4 && at_ < text_.size()) {
    const char c = text_[at_++];
    if (static_cast<unsigned char>(c) <= ' ') continue;
    if (c == '=' ? digits < 2 : padding > 0 || six_bits(c) == kBad) return false;
    bits = bits << 6 | (c == '=' ? 0 : six_bits(c));
    c == '=' ? ++padding : ++digits;
  }
  if (digits + padding != 4) return false;
  for (int i = 0; i < 3; ++i) group_[i] = std::byte(bits >> (16 - 8 * i));
  group_size_ = 3 - padding;
  return true;
}

bool EncodedBytes::read(std::byte* to, size_t bytes) {
  if (!base64_) {
    const auto raw = in_place(bytes);
    if (raw && bytes > 0) std::memcpy(to, raw->data(), bytes);
    return raw.has_value();
  }
  while (bytes > 0) {
    if (group_at_ < group_size_) {
      *to++ = group_[group_at_++], --bytes;
      continue;
    }
    while (bytes >= 3 && text_.size() - at_ >= 4) {
      const uint32_t a = six_bits(text_[at_]), b = six_bits(text_[at_ + 1]), c = six_bits(text_[at_ + 2]),
                     d = six_bits(text_[at_ + 3]);
      if ((a | b | c | d) & kBad) break;
      const uint32_t bits = a << 18 | b << 12 | c << 6 | d;
      to[0] = std::byte(bits >> 16), to[1] = std::byte(bits >> 8), to[2] = std::byte(bits);
      to += 3, bytes -= 3, at_ += 4;
    }
    if (bytes > 0 && !read_group()) return false;
  }
  return true;
}

std::optional<std::span<const std::byte>> EncodedBytes::in_place(size_t bytes) {
  if (base64_ || bytes > text_.size() - at_) return std::nullopt;
  at_ += bytes;
  return std::span(reinterpret_cast<const std::byte*>(text_.data()) + at_ - bytes, bytes);
}

std::optional<Packing> packing_of(std::string_view name) {
  if (name.empty()) return Packing::kNone;
  if (name == "vtkZLibDataCompressor") return Packing::kZlib;
  if (name == "vtkLZ4DataCompressor") return Packing::kLz4;
  if (name == "vtkLZMADataCompressor") return Packing::kLzma;
  return std::nullopt;
}

Bytes read_plain(EncodedBytes& in, size_t header_bytes, bool big_endian, const std::string& what) {
  uint64_t count = 0;
  Bytes out;
  if (!read_number(in, header_bytes, big_endian, count)) refuse("{} is cut off before its data", what);
  bool there = count <= in.most_left();
  if (there && in.base64()) {
    out.owned.resize(count);
    there = in.read(out.owned.data(), count);
  } else if (const auto raw = in.in_place(count)) {
    out.in_file = *raw;
  } else {
    there = false;
  }
  if (!there) refuse("{} is cut off or damaged: it claims {} bytes", what, count);
  return out;
}

Bytes unpack(EncodedBytes& in, Packing packing, size_t header_bytes, bool big_endian, const std::string& what) {
  const auto blocks = read_blocks(in, packing, header_bytes, big_endian, what);
  Bytes out;
  if (blocks.count == 0) return out;
  std::vector<std::byte> decoded;
  std::span<const std::byte> packed;
  if (in.base64()) {
    decoded.resize(blocks.packed_total);
    if (!in.read(decoded.data(), decoded.size())) refuse("{} is cut off or no base64", what);
    packed = decoded;
  } else if (const auto raw = in.in_place(blocks.packed_total)) {
    packed = *raw;
  } else {
    refuse("{} is cut off: {} packed bytes are not there", what, blocks.packed_total);
  }
  std::vector<size_t> begins{0};
  for (const uint64_t bytes : blocks.packed) begins.push_back(begins.back() + bytes);
  out.owned.resize(blocks.total);
  std::atomic<bool> sound{true};
  in_parallel(size_t{0}, size_t(blocks.count), [&](size_t i) {
    const size_t bytes = i + 1 == blocks.count ? blocks.last_bytes : blocks.bytes;
    const auto to = std::span(out.owned).subspan(i * blocks.bytes, bytes);
    if (sound && !unpack_block(packing, packed.subspan(begins[i], begins[i + 1] - begins[i]), to)) sound = false;
  });
  if (!sound) refuse("{}: its compressed data are damaged", what);
  return out;
}

}  // namespace telesplat::data::vtk
