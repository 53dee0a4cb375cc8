#include "common/codec/entropy.h"

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "common/core/check.h"

namespace telesplat::codec::detail {
namespace {

enum BlockKind : uint8_t { kConstant = 0, kStored = 1, kZstd = 2 };

// Making a context costs as much as coding a small tile, so each thread keeps its own.
ZSTD_CCtx* compressor() {
  struct Free { void operator()(ZSTD_CCtx* c) const { ZSTD_freeCCtx(c); } };
  static thread_local const std::unique_ptr<ZSTD_CCtx, Free> context(ZSTD_createCCtx());
  CHECK(context != nullptr);
  return context.get();
}
ZSTD_DCtx* decompressor() {
  struct Free { void operator()(ZSTD_DCtx* c) const { ZSTD_freeDCtx(c); } };
  static thread_local const std::unique_ptr<ZSTD_DCtx, Free> context(ZSTD_createDCtx());
  CHECK(context != nullptr);
  return context.get();
}

}  // namespace

std::optional<uint8_t> Reader::u8() {
  if (rest_.empty()) return std::nullopt;
  const uint8_t value = rest_[0];
  rest_ = rest_.subspan(1);
  return value;
}

std::optional<uint64_t> Reader::varint() {
  uint64_t value = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const auto byte = u8();
    if (!byte) break;
    value |= uint64_t{*byte & 127u} << shift;
    if (*byte < 128) return value;
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

void put_varint(std::vector<uint8_t>& out, uint64_t value) {
  for (; value >= 128; value >>= 7) out.push_back(static_cast<uint8_t>(value | 128));
  out.push_back(static_cast<uint8_t>(value));
}

void put_block(std::vector<uint8_t>& out, std::span<const uint8_t> raw) {
  if (raw.empty()) return;
  if (std::memcmp(raw.data(), raw.data() + 1, raw.size() - 1) == 0) {
    out.insert(out.end(), {kConstant, raw[0]});
    return;
  }
  static thread_local std::vector<uint8_t> packed;
  packed.resize(ZSTD_compressBound(raw.size()));
  const size_t size = ZSTD_compressCCtx(compressor(), packed.data(), packed.size(), raw.data(), raw.size(), 1);
  CHECK(!ZSTD_isError(size));
  const bool stored = size >= raw.size();
  out.push_back(stored ? kStored : kZstd);
  if (!stored) put_varint(out, size);
  const auto best = stored ? raw : std::span<const uint8_t>(packed).first(size);
  out.insert(out.end(), best.begin(), best.end());
}

bool get_block(Reader& in, std::span<uint8_t> raw) {
  if (raw.empty()) return true;
  const auto kind = in.u8();
  if (!kind) return false;
  if (*kind == kConstant) {
    const auto value = in.u8();
    if (value) std::fill(raw.begin(), raw.end(), *value);
    return value.has_value();
  }
  if (*kind == kStored) {
    const auto bytes = in.bytes(raw.size());
    if (bytes) std::copy(bytes->begin(), bytes->end(), raw.begin());
    return bytes.has_value();
  }
  if (*kind != kZstd) return false;
  const auto size = in.varint();
  const auto bytes = size ? in.bytes(*size) : std::nullopt;
  if (!bytes) return false;
  return ZSTD_decompressDCtx(decompressor(), raw.data(), raw.size(), bytes->data(), bytes->size()) == raw.size();
}

}  // namespace telesplat::codec::detail
