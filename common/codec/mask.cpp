#include "common/codec/mask.h"

#include <algorithm>

#include "common/codec/dense/kernels.h"
#include "common/codec/tokens.h"

namespace telesplat::codec::detail {
namespace {

// kRuns: lengths of the alternating runs of empty and covered pixels, rows joined: few pixels, or long runs.
// kBytes: eight pixels a byte. kBytesAbove: the same, exclusive or with the row above, for outlines that run downwards.
// kPeriodic: a pattern of 64 x 64 pixels that repeats, which of its pixels are covered where, and the other covered
// pixels: three masks of the other codings. Validation rays are picked by such a pattern (blue noise).
enum Coding : uint8_t { kRuns = 0, kBytes = 1, kBytesAbove = 2, kPeriodic = 3 };
constexpr int kPeriod = 64;

size_t bytes_per_row(const Mask& mask) { return (static_cast<size_t>(mask.width()) + 7) / 8; }

// Lengths of runs in scan order, beginning with an empty one that may have length 0; the last run is left out.
void run_lengths(const Mask& mask, std::vector<uint32_t>& lengths) {
  lengths.clear();
  uint64_t last = 0;
  size_t begin = 0;
  for (int y = 0; y < mask.height(); ++y)
    for (size_t w = 0; w < mask.words_per_row(); ++w) {
      const size_t first = static_cast<size_t>(y) * mask.width() + w * 64,
                   bits = std::min<size_t>(64, mask.width() - w * 64);
      const uint64_t word = mask.row(y)[w];
      uint64_t changes = word ^ (word << 1 | last);
      if (bits < 64) changes &= (uint64_t{1} << bits) - 1;
      for (; changes != 0; changes &= changes - 1) {
        const size_t at = first + static_cast<size_t>(std::countr_zero(changes));
        lengths.push_back(static_cast<uint32_t>(at - begin));
        begin = at;
      }
      last = word >> (bits - 1) & 1;
    }
}

void set_bits(Mask& mask, size_t begin, size_t end) {
  const size_t width = static_cast<size_t>(mask.width());
  while (begin < end) {
    const size_t y = begin / width, x = begin % width, take = std::min(end - begin, std::min(width - x, 64 - x % 64));
    const uint64_t ones = take == 64 ? ~uint64_t{0} : ((uint64_t{1} << take) - 1);
    mask.row(static_cast<int>(y))[x / 64] |= ones << x % 64;
    begin += take;
  }
}

struct Scratch {
  std::vector<uint32_t> lengths;
  std::vector<uint8_t> tokens[2], bytes, packed;
  BitWriter writer;
  BitReader reader;
  Mask pattern, repeats, others;
  std::vector<uint8_t> periodic;
};
Scratch& scratch() {
  static thread_local Scratch s;
  return s;
}

void put_runs(std::vector<uint8_t>& out, const std::vector<uint32_t>& lengths, Scratch& s) {
  for (auto& tokens : s.tokens) tokens.clear();
  s.writer.start(lengths.size() * NumberToken::kMaxBits);
  for (size_t i = 0; i < lengths.size(); ++i) {
    uint8_t token;
    NumberToken::put(lengths[i], &token, s.writer.sink);
    s.tokens[i & 1].push_back(token);
  }
  put_varint(out, static_cast<uint32_t>(lengths.size()));
  for (auto& tokens : s.tokens) put_block(out, tokens);
  put_stored_block(out, s.writer.bytes());
}

bool get_runs(Reader& in, Mask& mask, Scratch& s) {
  const size_t pixels = static_cast<size_t>(mask.width()) * static_cast<size_t>(mask.height());
  const auto count = in.varint();
  if (!count || *count > pixels) return false;
  for (size_t parity = 0; parity < 2; ++parity) {
    s.tokens[parity].resize((*count + 1 - parity) / 2);
    if (!get_block(in, s.tokens[parity])) return false;
  }
  const auto bits = get_stored_block(in);
  if (!bits) return false;
  s.reader.start(*bits, 64);
  size_t at = 0;
  for (size_t i = 0; i < *count; ++i) {
    const uint8_t token = s.tokens[i & 1][i / 2];
    if (token >= NumberToken::kCount) return false;
    const size_t end = at + NumberToken::get(token, s.reader.source);
    if (end >= pixels || (end == at && i != 0) || s.reader.overrun()) return false;
    if (i & 1) set_bits(mask, at, end);
    at = end;
  }
  if (*count & 1) set_bits(mask, at, pixels);
  return s.reader.finished();
}

void put_bytes(std::vector<uint8_t>& out, const Mask& mask, bool above, Scratch& s) {
  const size_t row_bytes = bytes_per_row(mask);
  s.bytes.resize(row_bytes * static_cast<size_t>(mask.height()));
  for (int y = 0; y < mask.height(); ++y) std::memcpy(s.bytes.data() + row_bytes * y, mask.row(y), row_bytes);
  if (above)
    for (size_t i = s.bytes.size(); i-- > row_bytes;) s.bytes[i] ^= s.bytes[i - row_bytes];
  put_block(out, s.bytes);
}

bool get_bytes(Reader& in, Mask& mask, bool above, Scratch& s) {
  const size_t row_bytes = bytes_per_row(mask);
  s.bytes.resize(row_bytes * static_cast<size_t>(mask.height()));
  if (!get_block(in, s.bytes)) return false;
  if (above)
    for (size_t i = row_bytes; i < s.bytes.size(); ++i) s.bytes[i] ^= s.bytes[i - row_bytes];
  const uint8_t padding = mask.width() % 8 == 0 ? 0 : static_cast<uint8_t>(0xFF << mask.width() % 8);
  for (int y = 0; y < mask.height(); ++y) {
    std::memcpy(mask.row(y), s.bytes.data() + row_bytes * y, row_bytes);
    if (s.bytes[row_bytes * (y + 1) - 1] & padding) return false;
  }
  return true;
}

}  // namespace

void covered_bits(const uint32_t* depth, size_t count, uint64_t* words) { kernels().covered_bits(depth, count, words); }

namespace {

void put_plain(std::vector<uint8_t>& out, const Mask& mask) {
  // A run takes a byte or so, a byte of pixels at least a bit and few more where it is the usual one. Bench
  // codec/patch*.
  Scratch& s = scratch();
  run_lengths(mask, s.lengths);
  const size_t pixels = static_cast<size_t>(mask.width()) * static_cast<size_t>(mask.height());
  const size_t begin = out.size(), runs = s.lengths.size();
  if (runs < pixels / 10) {
    out.push_back(kRuns);
    put_runs(out, s.lengths, s);
    if (runs <= pixels / 512) return;
  }
  size_t plain = 0, above = 0;  // changes of pixels within rows, and of those changes from row to row
  for (int y = 1; y < mask.height(); ++y)
    for (size_t w = 0; w < mask.words_per_row(); ++w) {
      const uint64_t here = mask.row(y)[w], changed = here ^ mask.row(y - 1)[w];
      plain += static_cast<size_t>(std::popcount(here ^ here << 1));
      above += static_cast<size_t>(std::popcount(changed ^ changed << 1));
    }
  s.packed.assign(1, above < plain ? kBytesAbove : kBytes);
  put_bytes(s.packed, mask, above < plain, s);
  if (out.size() != begin && out.size() - begin <= s.packed.size()) return;
  out.resize(begin);
  out.insert(out.end(), s.packed.begin(), s.packed.end());
}

bool get_plain(Reader& in, Mask& mask) {
  const auto coding = in.u8();
  if (!coding) return false;
  switch (*coding) {
    case kRuns:
      return get_runs(in, mask, scratch());
    case kBytes:
    case kBytesAbove:
      return get_bytes(in, mask, *coding == kBytesAbove, scratch());
    default:
      return false;
  }
}

// Calls f(y, word index, pattern's bits inside of the mask) for all words of the mask that the pattern has bits in.
template <class F>
void for_each_repeat(const Mask& mask, const Mask& pattern, F f) {
  const size_t words = mask.words_per_row(), last = static_cast<size_t>(mask.width()) % 64;
  for (int y = 0; y < mask.height(); ++y)
    for (size_t w = 0; w < words; ++w) {
      uint64_t bits = *pattern.row(y % kPeriod);
      if (w + 1 == words && last != 0) bits &= (uint64_t{1} << last) - 1;
      if (bits != 0) f(y, w, bits);
    }
}

// What is covered in two periods or more, where few pixels are. Returns how many covered pixels it explains.
size_t find_pattern(const Mask& mask, Mask& pattern) {
  constexpr int kFew = 12;  // of 64: more are no pattern, but a place where all pixels are covered
  pattern.reset(kPeriod, kPeriod);
  uint64_t once[kPeriod] = {};
  for (int y = 0; y < mask.height(); ++y)
    for (size_t w = 0; w < mask.words_per_row(); ++w) {
      const uint64_t word = mask.row(y)[w];
      if (std::popcount(word) > kFew) continue;
      *pattern.row(y % kPeriod) |= once[y % kPeriod] & word;
      once[y % kPeriod] |= word;
    }
  size_t explained = 0;
  for_each_repeat(mask, pattern, [&](int y, size_t w, uint64_t bits) {
    explained += static_cast<size_t>(std::popcount(mask.row(y)[w] & bits));
  });
  return explained;
}

void put_periodic(std::vector<uint8_t>& out, const Mask& mask, Scratch& s) {
  size_t places = 0;
  for_each_repeat(mask, s.pattern,
                  [&](int, size_t, uint64_t bits) { places += static_cast<size_t>(std::popcount(bits)); });
  s.repeats.reset(static_cast<int>(places), 1);
  s.others = mask;
  int at = 0;
  for_each_repeat(mask, s.pattern, [&](int y, size_t w, uint64_t bits) {
    s.others.row(y)[w] &= ~bits;
    for (; bits != 0; bits &= bits - 1, ++at)
      if (mask.row(y)[w] & bits & -bits) s.repeats.set(at, 0);
  });
  out.push_back(kPeriodic);
  for (const Mask* part : {&s.pattern, &s.repeats, &s.others}) put_plain(out, *part);
}

bool get_periodic(Reader& in, Mask& mask, Scratch& s) {
  s.pattern.reset(kPeriod, kPeriod);
  if (!get_plain(in, s.pattern)) return false;
  size_t places = 0;
  for_each_repeat(mask, s.pattern,
                  [&](int, size_t, uint64_t bits) { places += static_cast<size_t>(std::popcount(bits)); });
  if (places == 0) return false;
  s.repeats.reset(static_cast<int>(places), 1);
  if (!get_plain(in, s.repeats) || !get_plain(in, mask)) return false;
  int at = 0;
  for_each_repeat(mask, s.pattern, [&](int y, size_t w, uint64_t bits) {
    for (; bits != 0; bits &= bits - 1, ++at)
      if (s.repeats.at(at, 0)) mask.row(y)[w] |= bits & -bits;
  });
  return true;
}

}  // namespace

void put_mask(std::vector<uint8_t>& out, const Mask& mask) {
  Scratch& s = scratch();
  const size_t covered = mask.count();
  const bool repeats = covered >= 64 && (mask.width() > kPeriod || mask.height() > kPeriod);
  const size_t explained = repeats ? find_pattern(mask, s.pattern) : 0;
  constexpr size_t kMostOfPattern = kPeriod * kPeriod / 6;  // what is denser repeats by chance
  if (explained * 3 < covered || explained == 0 || s.pattern.count() > kMostOfPattern) return put_plain(out, mask);
  s.periodic.clear();
  put_periodic(s.periodic, mask, s);
  const size_t begin = out.size();
  if (explained * 10 < covered * 8) {  // not clear: the shorter one
    put_plain(out, mask);
    if (out.size() - begin <= s.periodic.size()) return;
    out.resize(begin);
  }
  out.insert(out.end(), s.periodic.begin(), s.periodic.end());
}

bool get_mask(Reader& in, Mask& mask) {
  if (in.peek() != kPeriodic) return get_plain(in, mask);
  (void)in.u8();
  return get_periodic(in, mask, scratch());
}

}  // namespace telesplat::codec::detail
