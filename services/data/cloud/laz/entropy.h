// Inside services/data/cloud/laz: the entropy decoder of LAZ files. Sources: A. Said, "Introduction to Arithmetic
// Coding - Theory and Practice", HPL-2004-76, 2004; M. Isenburg, "LASzip: lossless compression of LiDAR data", 2013.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace telesplat::data::laz {

/// Thrown where bytes end too early, or no encoder writes them.
struct Damaged {};

/// Frequencies of symbols, which adapt to those that were decoded. Memory is taken by the first one.
class SymbolModel {
 public:
  explicit SymbolModel(uint32_t symbols = 256) : symbols_(symbols) {}

 private:
  friend class Decoder;
  void begin();
  void update();

  uint32_t symbols_, shift_ = 0, total_ = 0, cycle_ = 0, left_ = 0;
  // For each symbol, and an end, the sum of the frequencies below it, as parts of kOne; the counts of symbols; a table
  // from equal parts of kOne, and two beyond it, which rounding reaches, to the last symbol that begins at or below.
  std::vector<uint16_t> numbers_;
};

/// The same for bits.
class BitModel {
  friend class Decoder;
  void update();
  uint32_t zero_ = 1 << 12, zeros_ = 1, total_ = 2, cycle_ = 4, left_ = 4;
};

/// Decodes one stream of bytes. All functions throw Damaged.
class Decoder {
 public:
  Decoder() = default;
  explicit Decoder(std::string_view bytes);
  bool has_bytes() const { return end_ != nullptr; }

  uint32_t symbol(SymbolModel& model);
  uint32_t bit(BitModel& model);
  /// Reads at most 32 bits that are not modelled.
  uint32_t bits(uint32_t count);

 private:
  uint32_t plain(uint32_t count);
  void refill() {
    do {
      if (at_ == end_) throw Damaged();
      value_ = value_ << 8 | uint8_t(*at_++);
    } while ((length_ <<= 8) < 1 << 24);
  }

  const char *at_ = nullptr, *end_ = nullptr;
  uint32_t value_ = 0, length_ = ~uint32_t{0};
};

/// Decodes whole numbers as differences from predictions, modulo 2^bits; their lengths have a model in each context.
class Numbers {
 public:
  explicit Numbers(uint32_t bits = 32, uint32_t contexts = 1);
  uint32_t next(Decoder& decoder, uint32_t predicted, uint32_t context = 0);
  /// Bits that the last difference had.
  uint32_t difference_bits() const { return difference_bits_; }

 private:
  uint32_t mask_, difference_bits_ = 0;
  std::vector<SymbolModel> lengths_;
  BitModel sign_;
  std::vector<SymbolModel> differences_;  // by their length
};

/// Middle of five numbers; each new one replaces the largest or the smallest.
class Median {
 public:
  int32_t get() const { return sorted_[2]; }
  void add(int32_t value);

 private:
  std::array<int32_t, 5> sorted_{};
  bool drop_largest_ = true;
};

inline uint32_t Decoder::symbol(SymbolModel& model) {
  if (model.numbers_.empty()) model.begin();
  const uint32_t symbols = model.symbols_, whole = length_;
  uint16_t *begins = model.numbers_.data(), *counts = begins + symbols + 1, *table = counts + symbols;
  length_ >>= 15;
  const uint32_t at = value_ / length_;
  uint32_t found = table[at >> model.shift_];
  while (begins[found + 1] <= at) ++found;
  const uint32_t begin = begins[found] * length_;
  length_ = (found + 1 < symbols ? begins[found + 1] * length_ : whole) - begin;
  value_ -= begin;
  if (length_ < 1 << 24) refill();
  ++counts[found];
  if (--model.left_ == 0) model.update();
  return found;
}

}  // namespace telesplat::data::laz
