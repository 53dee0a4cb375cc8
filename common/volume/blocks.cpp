#include "common/volume/blocks.h"

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

#include "common/core/check.h"

namespace telesplat::volume {
namespace {

using codec::detail::put_varint;
using codec::detail::Reader;

// A block is varint(size << 2 | kind) and then `size` bytes.
enum BlockKind : uint32_t { kConstant = 0, kStored = 1, kZstd = 2 };

// Level 1 looks for strings; a very negative level finds next to none, which is faster, and mostly shorter, too: short
// strings in noise cost more than their Huffman codes .
constexpr int kStringsLevel = 1, kHuffmanOnlyLevel = -1000;
constexpr size_t kTooShort = 32;  // bytes: a Huffman table takes about what it saves, and 10 us

using Compressor = std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)>;
Compressor make_compressor(int level) {
  Compressor c(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  CHECK(c != nullptr);
  ZSTD_CCtx_setParameter(c.get(), ZSTD_c_compressionLevel, level);
  ZSTD_CCtx_setParameter(c.get(), ZSTD_c_experimentalParam5,
                         1);                                   // literalCompressionMode = on, also at negative levels
  ZSTD_CCtx_setParameter(c.get(), ZSTD_c_contentSizeFlag, 0);  // the decoder knows the size
  return c;
}

// Making a context costs as much as coding a small tile, so each thread keeps its own.
ZSTD_CCtx* compressor(bool strings) {
  static thread_local const Compressor with_strings = make_compressor(kStringsLevel),
                                       huffman_only = make_compressor(kHuffmanOnlyLevel);
  return strings ? with_strings.get() : huffman_only.get();
}
ZSTD_DCtx* decompressor() {
  struct Free {
    void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); }
  };
  static thread_local const std::unique_ptr<ZSTD_DCtx, Free> context(ZSTD_createDCtx());
  CHECK(context != nullptr);
  return context.get();
}

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

// More than 7 of 8 sampled bytes are the same as the one sampled before.
bool is_repetitive(std::span<const uint8_t> raw) {
  constexpr size_t kStep = 7;  // no divisor of usual row lengths
  size_t same = 0, sampled = 0;
  for (size_t i = kStep; i < raw.size(); i += kStep, ++sampled) same += raw[i] == raw[i - kStep];
  return same * 8 > sampled * 7;
}

void append(std::vector<uint8_t>& out, uint32_t kind, std::span<const uint8_t> bytes) {
  put_varint(out, static_cast<uint32_t>(bytes.size()) << 2 | kind);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

void put_zstd_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw) {
  if (raw.size() < 2) return append(out, kStored, raw);
  if (std::memcmp(raw.data(), raw.data() + 1, raw.size() - 1) == 0) return append(out, kConstant, raw.first(1));
  if (raw.size() < kTooShort) return append(out, kStored, raw);
  static thread_local std::vector<uint8_t> packed;
  packed.resize(std::max(packed.size(), ZSTD_compressBound(raw.size())));
  const size_t size =
      ZSTD_compress2(compressor(is_repetitive(raw)), packed.data(), packed.size(), raw.data(), raw.size());
  CHECK(!ZSTD_isError(size));
  if (size < raw.size())
    append(out, kZstd, std::span(packed).first(size));
  else
    append(out, kStored, raw);
}

bool get_zstd_block(Reader& in, std::span<uint8_t> raw) {
  const auto block = next_block(in);
  if (!block) return false;
  switch (block->kind) {
    case kConstant:
      if (block->bytes.size() == 1) std::fill(raw.begin(), raw.end(), block->bytes[0]);
      return block->bytes.size() == 1;
    case kStored:
      if (block->bytes.size() == raw.size()) std::copy(block->bytes.begin(), block->bytes.end(), raw.begin());
      return block->bytes.size() == raw.size();
    case kZstd:
      return ZSTD_decompressDCtx(decompressor(), raw.data(), raw.size(), block->bytes.data(), block->bytes.size()) ==
             raw.size();
    default:
      return false;
  }
}

}  // namespace telesplat::volume
