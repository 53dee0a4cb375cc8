#include "services/data/cloud/laz/items.h"

#include <algorithm>

namespace telesplat::data::laz {

void Places::next_plan(Decoder& decoder, size_t context, bool single, int32_t& x, int32_t& y) {
  const auto add_step = [&](Numbers& numbers, uint32_t in, Median& median, int32_t& to) {
    const auto step = int32_t(numbers.next(decoder, uint32_t(median.get()), in));
    median.add(step);
    to = int32_t(uint32_t(to) + uint32_t(step));
  };
  add_step(dx_, single, x_steps_[context], x);
  add_step(dy_, single | (std::min<uint32_t>(dx_.difference_bits(), 20) & ~1u), y_steps_[context], y);
}

int32_t Places::next_height(Decoder& decoder, size_t level, bool single) {
  const uint32_t bits = std::min<uint32_t>((dx_.difference_bits() + dy_.difference_bits()) / 2, 18) & ~1u;
  return heights_[level] = int32_t(z_.next(decoder, uint32_t(heights_[level]), single | bits));
}

uint64_t Times::begin_sequence(Decoder& decoder) {
  const uint64_t high = numbers_.next(decoder, uint32_t(sequences_[now_].time >> 32), 8);
  now_ = newest_ = (newest_ + 1) % 4;
  sequences_[now_] = {high << 32 | decoder.bits(32)};
  return sequences_[now_].time;
}

uint64_t Times::next(Decoder& decoder) {
  // Symbols where the last step was 0: the same time, a step, a new sequence, one of the others. Elsewhere: the step
  // times 0 to 500, or times -1 to -10; then the same. Layers have no symbol for the same time.
  enum { kMost = 500, kSame = 511, kNew = 512 };
  for (;;) {
    Sequence& s = sequences_[now_];
    if (s.step == 0) {
      const uint32_t symbol = decoder.symbol(no_step_) + layered_;
      if (symbol == 0) return s.time;
      if (symbol == 2) return begin_sequence(decoder);
      if (symbol == 1) {
        s.step = int32_t(numbers_.next(decoder, 0, 0)), s.extremes = 0;
        return s.time += uint64_t(int64_t(s.step));
      }
      now_ = (now_ + symbol - 2) % 4;
      continue;
    }
    uint32_t symbol = decoder.symbol(steps_);
    if (symbol >= kSame) symbol += layered_;
    if (symbol == kSame) return s.time;
    if (symbol == kNew) return begin_sequence(decoder);
    if (symbol > kNew) {
      now_ = (now_ + symbol - kNew) % 4;
      continue;
    }
    const uint32_t context = symbol == 0       ? 7
                             : symbol == 1     ? 1
                             : symbol < 10     ? 2
                             : symbol < kMost  ? 3
                             : symbol == kMost ? 4
                             : symbol < 510    ? 5
                                               : 6;
    const uint32_t times = symbol <= kMost ? symbol : kMost - symbol;
    const auto step = int32_t(numbers_.next(decoder, times * uint32_t(s.step), context));
    if (symbol == 1) s.extremes = 0;
    if ((context == 7 || context == 4 || context == 6) && ++s.extremes > 3) s.step = step, s.extremes = 0;
    return s.time += uint64_t(int64_t(step));
  }
}

Colours::Rgb Colours::next(Decoder& decoder, const Rgb& last) {
  const uint32_t changed = decoder.symbol(changed_);
  Rgb out{};
  // Decodes a byte of a colour, the lower one first; returns its step.
  const auto take = [&](uint32_t colour, uint32_t byte, int step) {
    const uint32_t n = 2 * colour + byte;
    const int was = last[colour] >> 8 * byte & 255;
    int now = was;
    if (changed >> n & 1) now = uint8_t(decoder.symbol(bytes_[n]) + uint32_t(std::clamp(was + step, 0, 255)));
    out[colour] = uint16_t(out[colour] | now << 8 * byte);
    return now - was;
  };
  const int red[] = {take(0, 0, 0), take(0, 1, 0)};
  if (!(changed & 64)) return {out[0], out[0], out[0]};
  for (const uint32_t byte : {0u, 1u}) {
    const int green = take(1, byte, red[byte]);
    take(2, byte, (red[byte] + green) / 2);
  }
  return out;
}

}  // namespace telesplat::data::laz
