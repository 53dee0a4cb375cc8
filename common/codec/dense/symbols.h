// Planes of symbols of one dense tile, and their way to bytes and back: contexts, tables, the coder's words.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/plane.h"
#include "common/codec/dense/tables.h"
#include "common/codec/mask.h"

namespace telesplat::codec::detail {

/// Which pixels of a tile are coded.
struct TileShape {
  size_t width = 0, height = 0;
  const Mask* mask = nullptr;     ///< null: all pixels are covered
  std::vector<uint32_t> covered;  ///< pixels of each row
  Plane<uint8_t> cover_bytes;     ///< 255 where a pixel is covered, else 0; unless all are
  size_t total = 0;
  struct Run {
    uint32_t begin, end;
  };
  /// Columns [begin, end) of a row.
  struct Span {
    size_t begin, end;
    size_t size() const { return end - begin; }
  };
  std::vector<Run> runs;                  ///< of rows that are not full
  std::vector<uint32_t> first_run;        ///< of each row, and of none after the last
  std::vector<Span> spans, spans_around;  ///< of each row, if there is a mask

  void reset(size_t tile_width, size_t tile_height, const Mask* tile_mask);
  void add_runs(const uint64_t* words);  ///< of the next row
  void find_spans();
  bool full(size_t y) const { return covered[y] == width; }
  /// From the first pixel of row y that is covered to the last one; `begin` is a multiple of 64.
  Span span(size_t y) const { return mask == nullptr ? Span{0, width} : spans[y]; }
  /// All that pixels of row y and of two rows above and below are predicted from. What rows hold elsewhere is of no
  /// consequence: of guides, and of what is made of them.
  Span around(size_t y) const { return mask == nullptr ? Span{0, width} : spans_around[y]; }
  /// As kernels take it: null where all of row y is covered.
  const uint8_t* cover(size_t y) const { return full(y) ? nullptr : cover_bytes.row(static_cast<ptrdiff_t>(y)); }
  /// The mask's bits of row y, which is not full.
  const uint64_t* words(size_t y) const { return mask->row(static_cast<int>(y)); }
  bool at(size_t x, size_t y) const { return mask == nullptr || mask->at(static_cast<int>(x), static_cast<int>(y)); }
  /// Calls f(begin, end) for the runs of pixels of row y that are covered.
  template <class F>
  void for_each_run(size_t y, F f) const {
    if (full(y)) return f(size_t{0}, width);
    for (size_t i = first_run[y]; i < first_run[y + 1]; ++i) f(size_t{runs[i].begin}, size_t{runs[i].end});
  }
  /// Calls f(x) for the pixels of row y that are not covered.
  template <class F>
  void for_each_hole(size_t y, F f) const {
    if (full(y)) return;
    const uint64_t* const words = mask->row(static_cast<int>(y));
    for (size_t w = 0; w * 64 < width; ++w) {
      uint64_t holes = ~words[w];
      if (width - w * 64 < 64) holes &= (uint64_t{1} << (width - w * 64)) - 1;
      for_each_set(&holes, 1, [&](size_t bit) { f(w * 64 + bit); });
    }
  }
};

/// Symbols of one plane: tokens, their contexts, and the numbers that they stand for.
struct SymbolPlane {
  /// wide: numbers below 2^24, else below 256.
  void reset(const TileShape& shape, bool wide, unsigned first = 0);

  Plane<uint8_t> tokens, contexts, narrow;
  Plane<uint8_t> kinds;  ///< of tokens of planes (`first` is kHits): their contexts follow from those above
  Plane<uint32_t> wide;
  bool is_wide = false;
  unsigned first = 0, alphabet = 0;
  const Plane<uint8_t>* other = nullptr;  ///< tokens of the same pixels that are known before
  bool has_contexts = false;              ///< `contexts` hold what its owner says, instead of what tokens around say
  ContextScale scale;
};

/// Gives pixels that are not covered the tokens above them, and borders those beside them.
void finish_tokens(SymbolPlane& plane, const TileShape& shape, size_t y);

/// About what the symbols of every fourth row take in bits, without contexts.
double rough_bits(const SymbolPlane& plane, const TileShape& shape);

/// The states of one tile's coder.
struct States {
  alignas(64) uint32_t of[kMostStates];
  size_t count = kLanes;  ///< that take turns

  void reset(const TileShape& shape);
  /// How many are written after a tile's words, if there are any words.
  size_t stored(const TileShape& shape, bool any_words) const;
  void put(const TileShape& shape, uint8_t* out) const;
  /// What put() wrote, after reset(). False where a state is out of range.
  [[nodiscard]] bool get(std::span<const uint8_t> bytes);
  bool at_rest() const;  ///< as reset() leaves them
};

/// Of one plane: chooses contexts and tables, and puts them into `bits`.
class PlaneEncoder {
 public:
  void prepare(SymbolPlane& plane, const TileShape& shape, BitSink& bits);
  uint8_t* put_row(const SymbolPlane& plane, const TileShape& shape, size_t y, States& states, uint8_t* out);
  static constexpr size_t kMostBits = 32 + kMostLevelBits;

 private:
  void choose_scale(SymbolPlane& plane, const TileShape& shape);
  void count(SymbolPlane& plane, const TileShape& shape);
  TokenLevels levels_;
  TokenCounts counts_{};
  /// Of counts_. They lie apart by no multiple of 4 KB: stores to one would look like those to another.
  uint16_t parts_[4][kContexts * kSymbols + 96];
  Plane<uint16_t> symbols_;          ///< contexts * kSymbols + tokens, without holes
  std::vector<EncodeEntry> tables_;  ///< of contexts before they are merged
  std::vector<uint16_t> joined_;     ///< a row of them with holes
  std::vector<uint8_t> packed_narrow_;
  std::vector<uint32_t> packed_wide_;
};

/// Words and states from which all planes of a tile are decoded.
struct WordSource {
  const uint8_t *begin = nullptr, *end = nullptr;
  const uint8_t* readable = nullptr;  ///< at or before `begin`: from there on memory may be read
  States states;

  /// words: all that there are, of which `begin` is set for each part. after: bytes that follow them in memory, and
  /// before: where the memory that they lie in begins. Kernels read 64 bytes beyond `end`: where there are fewer, words
  /// are copied.
  void start(std::span<const uint8_t> words, size_t after, const uint8_t* before);

 private:
  std::vector<uint8_t> copy_;
};

class PlaneDecoder {
 public:
  [[nodiscard]] bool prepare(SymbolPlane& plane, BitReader& bits);
  /// Row y of the plane's tokens and numbers, those before being known. False where words are missing.
  [[nodiscard]] bool get_row(SymbolPlane& plane, const TileShape& shape, size_t y, WordSource& source);

 private:
  TokenLevels levels_;
  std::vector<uint32_t> tables_;
  std::vector<uint8_t> packed_contexts_, packed_tokens_, packed_narrow_;
  std::vector<uint32_t> packed_wide_;
};

}  // namespace telesplat::codec::detail
