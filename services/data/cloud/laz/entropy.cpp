#include "services/data/cloud/laz/entropy.h"

#include <algorithm>

namespace telesplat::data::laz {

// Frequencies of symbols and of bits are parts of this; so are sums of their counts, before these are halved.
static constexpr uint32_t kOne = 1 << 15, kOneOfBits = 1 << 13;

void SymbolModel::begin() {
  uint32_t table_bits = 3;
  while (symbols_ > uint32_t{1} << table_bits) ++table_bits;
  shift_ = 15 - table_bits;
  numbers_.assign(2 * symbols_ + (size_t{1} << table_bits) + 3, 1);
  cycle_ = symbols_;
  update();
  left_ = cycle_ = (symbols_ + 6) / 2;
}

void SymbolModel::update() {
  uint16_t *begins = numbers_.data(), *counts = begins + symbols_ + 1, *table = counts + symbols_,
           *end = begins + numbers_.size();
  if ((total_ += cycle_) > kOne) {
    total_ = 0;
    for (uint32_t i = 0; i < symbols_; ++i) total_ += counts[i] = uint16_t((counts[i] + 1) / 2);
  }
  const uint32_t scale = (uint32_t{1} << 31) / total_;
  uint32_t sum = 0;
  for (uint32_t i = 0; i < symbols_; ++i) begins[i] = uint16_t(scale * sum >> 16), sum += counts[i];
  begins[symbols_] = ~uint16_t{0};
  uint32_t symbol = 0;
  for (uint32_t part = 0; table + part < end; ++part) {
    while (symbol + 1 < symbols_ && begins[symbol + 1] <= part << shift_) ++symbol;
    table[part] = uint16_t(symbol);
  }
  left_ = cycle_ = std::min(5 * cycle_ / 4, (symbols_ + 6) * 8);
}

void BitModel::update() {
  if ((total_ += cycle_) > kOneOfBits) {
    total_ = (total_ + 1) / 2, zeros_ = (zeros_ + 1) / 2;
    if (zeros_ == total_) ++total_;
  }
  zero_ = zeros_ * ((uint32_t{1} << 31) / total_) >> 18;
  left_ = cycle_ = std::min<uint32_t>(5 * cycle_ / 4, 64);
}

Decoder::Decoder(std::string_view bytes) : at_(bytes.data()), end_(at_ + bytes.size()) {
  if (bytes.size() < 4) throw Damaged();
  for (int i = 0; i < 4; ++i) value_ = value_ << 8 | uint8_t(*at_++);
  if (value_ >= length_) throw Damaged();  // below it now, it stays below it
}

uint32_t Decoder::bit(BitModel& model) {
  const uint32_t zero = model.zero_ * (length_ >> 13);
  const bool one = value_ >= zero;
  if (one)
    value_ -= zero, length_ -= zero;
  else
    length_ = zero, ++model.zeros_;
  if (length_ < 1 << 24) refill();
  if (--model.left_ == 0) model.update();
  return one;
}

uint32_t Decoder::plain(uint32_t count) {
  length_ >>= count;
  const uint32_t out = value_ / length_;
  value_ -= out * length_;
  if (length_ < 1 << 24) refill();
  return out & ((uint32_t{1} << count) - 1);
}

uint32_t Decoder::bits(uint32_t count) {
  if (count <= 19) return plain(count);
  const uint32_t low = plain(16);
  return low | plain(count - 16) << 16;
}

Numbers::Numbers(uint32_t bits, uint32_t contexts)
    : mask_(bits == 32 ? ~uint32_t{0} : (uint32_t{1} << bits) - 1), lengths_(contexts, SymbolModel(bits + 1)) {
  for (uint32_t n = 0; n <= bits; ++n) differences_.emplace_back(uint32_t{1} << std::min<uint32_t>(n, 8));
}

uint32_t Numbers::next(Decoder& decoder, uint32_t predicted, uint32_t context) {
  const uint32_t length = difference_bits_ = decoder.symbol(lengths_[context]);
  if (length == 0) return (predicted + decoder.bit(sign_)) & mask_;
  if (length == 32) return predicted + (uint32_t{1} << 31);
  uint32_t value = decoder.symbol(differences_[length]);
  if (length > 8) value = value << (length - 8) | decoder.bits(length - 8);
  // The upper half stands for 2^(length-1) + 1 to 2^length, the lower one for the same below 1.
  value += value >> (length - 1) ? 1 : uint32_t{1} - (uint32_t{1} << length);
  return (predicted + value) & mask_;
}

void Median::add(int32_t value) {
  if (drop_largest_) {
    drop_largest_ = value < sorted_[2];
    size_t i = 4;
    for (; i > 0 && value < sorted_[i - 1]; --i) sorted_[i] = sorted_[i - 1];
    sorted_[i] = value;
  } else {
    drop_largest_ = value <= sorted_[2];
    size_t i = 0;
    for (; i < 4 && sorted_[i + 1] < value; ++i) sorted_[i] = sorted_[i + 1];
    sorted_[i] = value;
  }
}

}  // namespace telesplat::data::laz
