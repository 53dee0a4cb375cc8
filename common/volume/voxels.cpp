// Coded form:
//   u8 'V', u8 flags (1: normals, 2: levels above 255), varint k_begin, varint slices,
//   and groups of slices until all are there:
//     varint slices of the group
//     block  runs of every row, low bytes; block  high bytes
//     varint size, block  gaps before the runs (varints; of a row's later runs less 1: runs do not touch)
//     varint size, block  lengths of the runs less 1 (varints)
//     block  levels, low bytes; [block  high bytes]      differences from the predicted ones, zigzag
//     [block  normals, x; block  normals, y]             differences from the predicted ones
// Blocks go through zstd. A voxel is predicted from its neighbours to the left and above, as far as there
// are any (figures in tests/bench/volume_data_bench.cpp).
#include "common/volume/voxels.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

#include "common/codec/entropy.h"
#include "common/core/check.h"

namespace telesplat::volume {
namespace {

using codec::detail::put_varint;
using codec::detail::Reader;
using BytePlane = std::vector<uint8_t>;

constexpr uint8_t kMark = 'V';
constexpr uint8_t kLit = 1, kWide = 2;
constexpr size_t kGroupVoxels = 1u << 15;  // smaller groups would spend a noticeable part on Huffman tables

// A block is varint(size << 2 | kind) and then `size` bytes.
enum BlockKind : uint32_t { kConstant = 0, kStored = 1, kZstd = 2 };

// Level 1 looks for strings. A very negative level finds nearly none, which is faster and mostly shorter, too: short
// strings in noise cost more than their Huffman codes.
constexpr int kStringsLevel = 1, kHuffmanOnlyLevel = -1000;
constexpr size_t kTooShort = 32;  // bytes: a Huffman table takes about as many as it saves, and 10 us

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

// True if more than 7 of 8 sampled bytes equal the one sampled before.
bool is_repetitive(std::span<const uint8_t> raw) {
  constexpr size_t kStep = 7;  // not a divisor of usual row lengths
  size_t same = 0, sampled = 0;
  for (size_t i = kStep; i < raw.size(); i += kStep, ++sampled) same += raw[i] == raw[i - kStep];
  return same * 8 > sampled * 7;
}

void append(std::vector<uint8_t>& out, uint32_t kind, std::span<const uint8_t> bytes) {
  put_varint(out, static_cast<uint32_t>(bytes.size()) << 2 | kind);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

// Appends `raw` as one self-delimiting block: constant, stored or zstd, the shortest. Looks for repeated strings only
// if one byte value is so frequent that a Huffman code, at least a bit long, would waste much on it.
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

// Fills all of `raw` from the next block. False: the block is damaged or holds another number of bytes.
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

uint16_t zigzag(int difference) { return uint16_t((difference << 1) ^ (difference >> 31)); }
int unzigzag(uint16_t code) { return int(code >> 1) ^ -int(code & 1); }

struct Sample {
  uint16_t level = 0, normal = kNoNormal;
};

// Predicts a voxel from its neighbours: the one to the left, if present, and the one in the row before.
class Predictor {
 public:
  explicit Predictor(int size_x) : above_(size_t(size_x)) {}

  void begin_group() { std::fill(above_.begin(), above_.end(), Above{}), row_ = 1, start_ = {}; }
  void begin_row() { ++row_; }
  void begin_run() { left_ = start_, at_start_ = true; }
  Sample predict(size_t i) const {
    const Above& up = above_[i];
    Sample out = left_;
    if (up.row + 1 != row_) return out;
    if (at_start_) return up.sample;
    out.level = uint16_t((left_.level + up.sample.level) >> 1);
    if (left_.normal == kNoNormal || up.sample.normal == kNoNormal) {
      if (left_.normal == kNoNormal) out.normal = up.sample.normal;
      return out;
    }
    // Takes the mean of both coordinates, a byte each, at once.
    const uint32_t a = left_.normal, b = up.sample.normal;
    out.normal = uint16_t((a & b) + (((a ^ b) & 0xfefe) >> 1));
    return out;
  }
  void put(size_t i, const Sample& sample) {
    if (at_start_) start_ = sample, at_start_ = false;
    above_[i] = {row_, sample};
    left_ = sample;
  }

 private:
  struct Above {
    uint32_t row = 0;
    Sample sample;
  };
  std::vector<Above> above_;
  uint32_t row_ = 1;
  Sample left_, start_;  // start_: first sample of the run before; surfaces begin with similar levels
  bool at_start_ = true;
};

void put_sized_block(std::vector<uint8_t>& out, const BytePlane& plane) {
  put_varint(out, uint32_t(plane.size()));
  put_zstd_block(out, plane);
}

// Occupancy and samples of the rows [begin, end) of a set.
class GroupEncoder {
 public:
  GroupEncoder(const Voxels& voxels, int size_x, bool wide)
      : voxels_(voxels), lit_(!voxels.normal.empty()), wide_(wide), predictor_(size_x) {}

  void encode(size_t begin, size_t end, std::vector<uint8_t>& out) {
    const size_t first = voxels_.rows[begin], count = voxels_.rows[end] - first;
    counts_low_.clear(), counts_high_.clear(), gaps_.clear(), lengths_.clear();
    for (BytePlane* plane : {&level_low_, &level_high_, &x_, &y_}) plane->resize(count);
    predictor_.begin_group();
    size_t n = first;
    for (size_t r = begin; r < end; ++r) {
      predictor_.begin_row();
      uint32_t runs = 0, next = 0;
      for (const size_t row_end = voxels_.rows[r + 1]; n < row_end; ++runs) {
        const size_t run_begin = n;
        put_varint(gaps_, voxels_.i[n] - next);
        predictor_.begin_run();
        do put(n - first, n);
        while (++n < row_end && voxels_.i[n] == voxels_.i[n - 1] + 1);
        put_varint(lengths_, uint32_t(n - run_begin - 1));
        next = voxels_.i[n - 1] + 2u;
      }
      counts_low_.push_back(uint8_t(runs)), counts_high_.push_back(uint8_t(runs >> 8));
    }
    put_zstd_block(out, counts_low_);
    put_zstd_block(out, counts_high_);
    put_sized_block(out, gaps_);
    put_sized_block(out, lengths_);
    put_zstd_block(out, level_low_);
    if (wide_) put_zstd_block(out, level_high_);
    if (lit_) put_zstd_block(out, x_), put_zstd_block(out, y_);
  }

 private:
  void put(size_t at, size_t n) {
    const size_t i = voxels_.i[n];
    const Sample sample{voxels_.level[n], lit_ ? voxels_.normal[n] : kNoNormal};
    const Sample expected = predictor_.predict(i);
    const uint16_t level = zigzag(sample.level - expected.level);
    if (wide_)
      level_low_[at] = uint8_t(level), level_high_[at] = uint8_t(level >> 8);
    else
      level_low_[at] = uint8_t(zigzag(int8_t(sample.level - expected.level)));
    x_[at] = uint8_t(sample.normal - expected.normal);
    y_[at] = uint8_t((sample.normal >> 8) - (expected.normal >> 8));
    predictor_.put(i, sample);
  }

  const Voxels& voxels_;
  const bool lit_, wide_;
  Predictor predictor_;
  BytePlane counts_low_, counts_high_, gaps_, lengths_, level_low_, level_high_, x_, y_;
};

// Appends the rows of a group to a set. False: damaged.
class GroupDecoder {
 public:
  GroupDecoder(Voxels& voxels, int size_x, int level_count, bool lit, bool wide)
      : voxels_(voxels),
        size_x_(size_t(size_x)),
        level_count_(level_count),
        lit_(lit),
        wide_(wide),
        predictor_(size_x) {}

  bool decode(Reader& in, size_t rows) {
    counts_low_.resize(rows), counts_high_.resize(rows);
    if (!get_zstd_block(in, counts_low_) || !get_zstd_block(in, counts_high_)) return false;
    uint64_t runs = 0;
    for (size_t r = 0; r < rows; ++r) runs += count(r);
    if (runs > kMaxVoxelsCoded || !get_varints(in, runs, gaps_) || !get_varints(in, runs, lengths_)) return false;
    uint64_t voxels = runs;
    for (const uint16_t length : lengths_) voxels += length;
    const size_t first = voxels_.i.size();
    if (first + voxels > kMaxVoxelsCoded || !place_runs(rows)) return false;

    for (BytePlane* plane : {&level_low_, &level_high_, &x_, &y_}) plane->resize(size_t(voxels));
    if (!get_zstd_block(in, level_low_) || (wide_ && !get_zstd_block(in, level_high_))) return false;
    if (lit_ && (!get_zstd_block(in, x_) || !get_zstd_block(in, y_))) return false;
    voxels_.i.resize(first + size_t(voxels));
    voxels_.level.resize(first + size_t(voxels));
    if (lit_) voxels_.normal.resize(first + size_t(voxels));
    return fill(rows, first);
  }

 private:
  uint32_t count(size_t row) const { return counts_low_[row] | uint32_t{counts_high_[row]} << 8; }

  // Reads how_many numbers below 2^14.
  bool get_varints(Reader& in, uint64_t how_many, std::vector<uint16_t>& out) {
    const auto bytes = in.varint();
    if (!bytes || *bytes < how_many || *bytes > 2 * how_many) return false;
    packed_.resize(*bytes);
    if (!get_zstd_block(in, packed_)) return false;
    out.resize(size_t(how_many));
    size_t at = 0;
    for (uint16_t& value : out) {
      if (at == packed_.size()) return false;
      value = packed_[at++];
      if (value < 128) continue;
      if (at == packed_.size() || packed_[at] >= 128) return false;
      value = uint16_t((value & 127) | packed_[at++] << 7);
    }
    return at == packed_.size();
  }

  // Converts gaps to the runs' begins. False: a run reaches beyond its row.
  bool place_runs(size_t rows) {
    size_t run = 0;
    for (size_t r = 0; r < rows; ++r) {
      size_t next = 0;
      for (uint32_t n = count(r); n-- > 0; ++run) {
        const size_t begin = next + gaps_[run], end = begin + lengths_[run] + 1;
        if (end > size_x_) return false;
        gaps_[run] = uint16_t(begin);
        next = end + 1;
      }
    }
    return true;
  }

  bool fill(size_t rows, size_t first) {
    predictor_.begin_group();
    size_t run = 0, n = 0;
    unsigned highest = 0;
    for (size_t r = 0; r < rows; ++r) {
      predictor_.begin_row();
      for (uint32_t left = count(r); left-- > 0; ++run) {
        predictor_.begin_run();
        size_t i = gaps_[run];
        for (const size_t end = i + lengths_[run] + 1; i < end; ++i, ++n) {
          const Sample expected = predictor_.predict(i);
          const uint16_t coded = uint16_t(level_low_[n] | (wide_ ? level_high_[n] << 8 : 0));
          const int level = expected.level + unzigzag(coded);
          Sample sample;
          sample.level = wide_ ? uint16_t(level) : uint16_t(level & 255);
          if (lit_)
            sample.normal = uint16_t(uint8_t(expected.normal + x_[n]) | uint8_t((expected.normal >> 8) + y_[n]) << 8);
          highest = std::max<unsigned>(highest, sample.level);
          voxels_.i[first + n] = uint16_t(i);
          voxels_.level[first + n] = sample.level;
          if (lit_) voxels_.normal[first + n] = sample.normal;
          predictor_.put(i, sample);
        }
      }
      voxels_.rows.push_back(uint32_t(first + n));
    }
    return int(highest) < level_count_ || n == 0;
  }

  Voxels& voxels_;
  const size_t size_x_;
  const int level_count_;
  const bool lit_, wide_;
  Predictor predictor_;
  BytePlane counts_low_, counts_high_, packed_, level_low_, level_high_, x_, y_;
  std::vector<uint16_t> gaps_, lengths_;
};

}  // namespace

void LevelSet::add(const LevelSet& others) {
  for (size_t n = 0; n < bits_.size(); ++n) bits_[n] |= others.bits_[n];
}

bool LevelSet::empty() const {
  return std::all_of(bits_.begin(), bits_.end(), [](uint8_t byte) { return byte == 0; });
}

bool LevelSet::contains(const LevelSet& others) const {
  for (size_t n = 0; n < bits_.size(); ++n)
    if (others.bits_[n] & ~bits_[n]) return false;
  return true;
}

Result<LevelSet> LevelSet::from_bytes(std::span<const uint8_t> bytes) {
  LevelSet out;
  if (bytes.size() != out.bits_.size())
    return Error{fmt::format("a set of levels of {} bytes, not {}", bytes.size(), out.bits_.size())};
  std::copy(bytes.begin(), bytes.end(), out.bits_.begin());
  return out;
}

std::vector<uint8_t> encode_voxels(const Voxels& voxels, int size_x, int size_y) {
  const size_t slices = size_t(voxels.k_end - voxels.k_begin), rows_a_slice = size_t(size_y);
  CHECK(voxels.rows.size() == slices * rows_a_slice + 1 && voxels.rows.back() == voxels.size());
  CHECK(voxels.size() <= kMaxVoxelsCoded);
  const bool lit = !voxels.normal.empty();
  const bool wide = std::any_of(voxels.level.begin(), voxels.level.end(), [](uint16_t level) { return level > 255; });
  std::vector<uint8_t> out{kMark, uint8_t((lit ? kLit : 0) | (wide ? kWide : 0))};
  put_varint(out, uint32_t(voxels.k_begin));
  put_varint(out, uint32_t(slices));
  GroupEncoder encoder(voxels, size_x, wide);
  for (size_t begin = 0; begin < slices;) {
    size_t end = begin + 1;
    const size_t first = voxels.rows[begin * rows_a_slice];
    while (end < slices && voxels.rows[end * rows_a_slice] - first < kGroupVoxels) ++end;
    put_varint(out, uint32_t(end - begin));
    encoder.encode(begin * rows_a_slice, end * rows_a_slice, out);
    begin = end;
  }
  return out;
}

Result<Voxels> decode_voxels(std::span<const uint8_t> bytes, int size_x, int size_y, int k_begin, int k_end,
                             int level_count) {
  Reader in(bytes);
  const auto mark = in.u8(), flags = in.u8();
  const auto begin = in.varint(), slices = in.varint();
  if (!slices || *mark != kMark || (*flags & ~(kLit | kWide)))
    return Error{fmt::format("voxels: {} bytes that are no voxels", bytes.size())};
  if (*begin < uint32_t(k_begin) || uint64_t{*begin} + *slices > uint64_t(k_end))
    return Error{
        fmt::format("voxels: {} slices from {} on, but {} to {} were asked for", *slices, *begin, k_begin, k_end)};
  Voxels out;
  out.k_begin = int(*begin), out.k_end = int(*begin + *slices);
  out.rows.push_back(0);
  GroupDecoder decoder(out, size_x, level_count, *flags & kLit, *flags & kWide);
  for (uint32_t done = 0; done < *slices;) {
    const auto group = in.varint();
    if (!group || *group == 0 || *group > *slices - done || !decoder.decode(in, size_t{*group} * size_t(size_y)))
      return Error{fmt::format("voxels: damaged in the group from slice {} on ({} bytes, {} left)", *begin + done,
                               bytes.size(), in.left())};
    done += *group;
  }
  if (in.left() != 0) return Error{fmt::format("voxels: {} bytes too many after the last slice", in.left())};
  return out;
}

Voxels merge(const Voxels& a, const Voxels& b) {
  CHECK(a.k_begin == b.k_begin && a.k_end == b.k_end && a.rows.size() == b.rows.size());
  CHECK(a.size() == 0 || b.size() == 0 || a.normal.empty() == b.normal.empty());
  const bool lit = !a.normal.empty() || !b.normal.empty();
  Voxels out;
  out.k_begin = a.k_begin, out.k_end = a.k_end;
  out.rows.resize(a.rows.size());
  const size_t count = a.size() + b.size();
  CHECK(count <= UINT32_MAX);
  out.i.resize(count), out.level.resize(count);
  if (lit) out.normal.resize(count);
  size_t m = 0, n = 0, at = 0;
  const auto take = [&](const Voxels& from, size_t& next) {
    out.i[at] = from.i[next], out.level[at] = from.level[next];
    if (lit) out.normal[at] = from.normal[next];
    ++next, ++at;
  };
  for (size_t r = 0; r + 1 < a.rows.size(); ++r) {
    const size_t a_end = a.rows[r + 1], b_end = b.rows[r + 1];
    while (m < a_end && n < b_end) a.i[m] < b.i[n] ? take(a, m) : take(b, n);
    while (m < a_end) take(a, m);
    while (n < b_end) take(b, n);
    out.rows[r + 1] = uint32_t(at);
  }
  return out;
}

}  // namespace telesplat::volume
