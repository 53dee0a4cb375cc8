// Planes of symbols of one dense tile, and their way to bytes and back: contexts, tables, the coder's words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/dense/kernels.h"
#include "common/codec/dense/plane.h"
#include "common/codec/dense/tables.h"
#include "common/codec/mask.h"

namespace telesplat::codec::detail {

/// The covered pixels of a tile: only they are coded.
struct TileShape {
  size_t width = 0, height = 0;
  const Mask* mask = nullptr;     ///< null: all pixels are covered
  std::vector<uint32_t> covered;  ///< pixels of each row
  size_t total = 0;
  struct Run {
    uint32_t begin, end;
  };
  std::vector<Run> runs;            ///< runs of covered pixels, in rows that are not full
  std::vector<uint32_t> first_run;  ///< index of each row's first run; one more entry marks the end

  void reset(size_t tile_width, size_t tile_height, const Mask* tile_mask);
  bool full(size_t y) const { return covered[y] == width; }
  bool at(size_t x, size_t y) const { return mask == nullptr || mask->at(static_cast<int>(x), static_cast<int>(y)); }
  /// Calls f(begin, end) for each run of covered pixels of row y.
  template <class F>
  void for_each_run(size_t y, F f) const {
    if (full(y)) return f(size_t{0}, width);
    for (size_t i = first_run[y]; i < first_run[y + 1]; ++i) f(size_t{runs[i].begin}, size_t{runs[i].end});
  }
  /// Calls f for the same runs, from the last one to the first.
  template <class F>
  void for_each_run_back(size_t y, F f) const {
    if (full(y)) return f(size_t{0}, width);
    for (size_t i = first_run[y + 1]; i-- > first_run[y];) f(size_t{runs[i].begin}, size_t{runs[i].end});
  }
  /// Calls f(begin, end) for the runs of pixels between them.
  template <class F>
  void for_each_gap(size_t y, F f) const {
    size_t from = 0;
    for_each_run(y, [&](size_t begin, size_t end) {
      if (from < begin) f(from, begin);
      from = end;
    });
    if (from < width) f(from, width);
  }

 private:
  void add_runs(const uint64_t* words);
};

/// Symbols of one plane: tokens, their contexts, and the numbers that they represent.
struct SymbolPlane {
  /// bytes: numbers are below 256, else below 2^24. Tokens below `first_number` are hits, without a number.
  void reset(const TileShape& shape, bool bytes, unsigned first_number = 0);

  Plane<uint8_t> tokens, contexts;
  Plane<uint8_t> kinds;  ///< kinds of tokens of planes (`first` is kHits): they choose the contexts of the row below
  Plane<uint32_t> z;     ///< numbers
  unsigned first = 0, alphabet = 0;
  const Plane<uint8_t>* other = nullptr;  ///< tokens of the same pixels in a plane known before
  ContextScale scale;
};

/// Sets pixels that are not covered to the tokens above them, and borders to their neighbours.
void finish_tokens(SymbolPlane& plane, const TileShape& shape, size_t y);

/// Chooses contexts and tables of one plane, and puts them into `bits`.
class PlaneEncoder {
 public:
  void prepare(SymbolPlane& plane, const TileShape& shape, BitSink& bits);
  /// Puts the row's symbols, the last one first.
  void put_row(const SymbolPlane& plane, const TileShape& shape, size_t y, SymbolEncoder& out) const;
  static constexpr size_t kMostBits = 32 + kMostLevelBits;

 private:
  TokenLevels levels_;
  TokenCounts counts_{};
  std::vector<EncodeEntry> tables_;
};

class PlaneDecoder {
 public:
  [[nodiscard]] bool prepare(SymbolPlane& plane, BitReader& bits);
  /// Decodes row y of the plane; earlier rows must be known. False: words are missing.
  [[nodiscard]] bool get_row(SymbolPlane& plane, const TileShape& shape, size_t y, SymbolDecoder& source) const;

 private:
  TokenLevels levels_;
  std::vector<uint32_t> tables_;
};

/// Returns the finest classes that nearly all of `total` sums fit into. sums[v]: number of sums of value v.
ContextScale scale_of(std::span<const uint32_t> sums, uint32_t total);
inline constexpr unsigned kBiasBits = 13, kShiftBits = 4;
inline constexpr int kMostShift = 14;

}  // namespace telesplat::codec::detail
