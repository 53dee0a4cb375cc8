#include "common/codec/mask.h"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>

#include "common/codec/range_coder.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kPeriod = 64;  // pixels, both ways, after which a pattern repeats
constexpr uint32_t kPeriodic = 1;

size_t bytes_per_row(const Mask& mask) { return (static_cast<size_t>(mask.width()) + 7) / 8; }

// Codes groups of eight pixels of a row: is any covered, are all, and if neither, which.
class GroupModel {
 public:
  // Puts a mask by coder(bit, model), or gets it into an empty one.
  template <class Coder, class AnyMask>
  void code(const Coder& coder, AnyMask& mask) {
    const size_t groups = bytes_per_row(mask), words = mask.words_per_row();
    const int last = mask.width() - 8 * static_cast<int>(groups - 1);
    const std::vector<uint64_t> none(words);
    const uint64_t *above = none.data(), *above_that = none.data();
    for (int y = 0; y < mask.height(); ++y) {
      auto* const row = mask.row(y);
      uint32_t left = 0;
      bool quiet = false;  // the rows above are empty around this word
      for (size_t group = 0; group < groups; ++group) {
        if (group % 8 == 0) quiet = is_empty_around(above, group / 8, words) && above_that[group / 8] == 0;
        const int pixels = group + 1 == groups ? last : 8;
        const uint32_t all = (1u << pixels) - 1;
        uint32_t here = byte(row, group), up_left = 0, up = 0, up_right = 0;
        // The known groups around it; pixels outside the mask count as not covered.
        if (!quiet) {
          up_left = group == 0 ? 0 : byte(above, group - 1), up = byte(above, group);
          up_right = group + 1 == groups ? 0 : byte(above, group + 1);
        }
        auto& any = any_[(left != 0) | (up != 0) << 1 | (up_right != 0) << 2 | (up_left != 0) << 3 |
                         (!quiet && byte(above_that, group) != 0) << 4];
        if (coder(here != 0, any) == 0) {
          left = 0;
          continue;
        }
        auto& full = full_[(left == 255) | (up == all) << 1 | (up_right == 255) << 2];
        if (coder(here == all, full) != 0)
          here = all;
        else
          here = some(coder, here, pixels, left, up_left >> 7 | up << 1 | (up_right & 1) << 9);
        if constexpr (!std::is_const_v<AnyMask>) row[group / 8] |= uint64_t{here} << group % 8 * 8;
        left = here;
      }
      above_that = above, above = row;
    }
  }

 private:
  static bool is_empty_around(const uint64_t* row, size_t word, size_t words) {
    return (row[word] | (word == 0 ? 0 : row[word - 1] >> 56) | (word + 1 == words ? 0 : row[word + 1] << 56)) == 0;
  }
  static uint32_t byte(const uint64_t* row, size_t group) {
    return static_cast<uint32_t>(row[group / 8] >> group % 8 * 8) & 255;
  }
  // left: the group to the left; above: the pixels above, from the one above left of the first.
  template <class Coder>
  uint32_t some(const Coder& coder, uint32_t wanted, int pixels, uint32_t left, uint32_t above) {
    uint32_t row = left >> 6, found = 0;  // the two pixels to the left; those of this group
    for (int i = 0; i < pixels; ++i) {
      uint32_t bit = 1;  // a single covered pixel in the last place needs no bit
      if (found != 0 || i + 1 < pixels)
        bit =
            coder(wanted >> i & 1, pixel_[found != 0 ? 8 : static_cast<size_t>(i)][(row & 3) | (above >> i & 7) << 2]);
      found |= bit << i;
      row = row >> 1 | bit << 1;
    }
    return found;
  }

  std::array<AdaptiveBit, 32> any_;
  std::array<AdaptiveBit, 8> full_;
  std::array<std::array<AdaptiveBit, 32>, 9> pixel_;
};

struct Scratch {
  std::vector<uint8_t> packed, periodic;
  Mask pattern, repeats, others;
};
Scratch& scratch() {
  static thread_local Scratch s;
  return s;
}

void put_plain(std::vector<uint8_t>& out, const Mask& mask) {
  Scratch& s = scratch();
  s.packed.clear();
  RangeEncoder coder(s.packed);
  GroupModel model;
  model.code(BitCoder{coder}, mask);
  coder.finish();
  put_varint(out, static_cast<uint32_t>(2 * s.packed.size()));
  out.insert(out.end(), s.packed.begin(), s.packed.end());
}

// Gets a mask into an empty one.
bool get_plain(Reader& in, Mask& mask) {
  const auto head = in.varint();
  const auto bytes = head && *head % 2 == 0 ? in.bytes(*head / 2) : std::nullopt;
  if (!bytes) return false;
  RangeDecoder coder(*bytes);
  GroupModel model;
  model.code(BitDecoder{coder}, mask);
  return coder.finished();
}

// Calls f(y, word index, the pattern's bits within the mask) for all words of the mask in which the pattern has bits.
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

// Finds pixels that are covered in two or more periods of sparse areas. Returns how many covered pixels they match.
size_t find_pattern(const Mask& mask, Mask& pattern) {
  constexpr int kFew = 12;  // bits of 64: a fuller word is a covered area, not a pattern
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
  put_varint(out, kPeriodic);
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
  constexpr size_t kMostOfPattern = kPeriod * kPeriod / 6;  // a denser pattern repeats by chance
  if (explained * 3 < covered || explained == 0 || s.pattern.count() > kMostOfPattern) return put_plain(out, mask);
  s.periodic.clear();
  put_periodic(s.periodic, mask, s);
  const size_t begin = out.size();
  if (explained * 10 < covered * 8) {  // not clear: takes the shorter one
    put_plain(out, mask);
    if (out.size() - begin <= s.periodic.size()) return;
    out.resize(begin);
  }
  out.insert(out.end(), s.periodic.begin(), s.periodic.end());
}

bool get_mask(Reader& in, Mask& mask) {
  if (in.peek() != static_cast<int>(kPeriodic)) return get_plain(in, mask);
  (void)in.u8();
  return get_periodic(in, mask, scratch());
}

}  // namespace telesplat::codec::detail
