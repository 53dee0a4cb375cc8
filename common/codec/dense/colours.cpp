#include "common/codec/dense/colours.h"

#include <algorithm>
#include <cstdlib>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kShifts[3] = {8, 16, 0};  // green, red, blue

// Colours seen, by open addressing.
class ColourTable {
 public:
  ColourTable() { slots_.fill({kNone, 0}); }
  // The place of `colour`, which is entered if it is new.
  uint32_t& operator[](uint32_t colour) {
    size_t at = (colour * 0x9E3779B1u) >> 22;
    while (slots_[at].first != colour && slots_[at].first != kNone) at = (at + 1) % slots_.size();
    if (slots_[at].first == kNone) slots_[at] = {colour, kNone}, ++count_;
    return slots_[at].second;
  }
  size_t count() const { return count_; }
  static constexpr uint32_t kNone = 0xFFFFFFFF;

 private:
  std::array<std::pair<uint32_t, uint32_t>, 1024> slots_;
  size_t count_ = 0;
};

int distance(uint32_t a, uint32_t b) {
  int sum = 0;
  for (const int shift : kShifts) {
    const int d = int(a >> shift & 255) - int(b >> shift & 255);
    sum += d * d;
  }
  return sum;
}

int8_t difference(uint32_t a, uint32_t b) { return static_cast<int8_t>(static_cast<uint8_t>(a - b)); }

bool all_same(const TileShape& shape, const std::vector<uint32_t>& colours, uint32_t base) {
  for (size_t y = 0; y < shape.height; ++y) {
    const uint32_t* const row = colours.data() + y * shape.width;
    uint32_t other = 0;
    if (shape.full(y))
      for (size_t x = 0; x < shape.width; ++x) other |= row[x] ^ base;
    else
      for_each_set(shape.mask->row(static_cast<int>(y)), shape.mask->words_per_row(),
                   [&](size_t x) { other |= row[x] ^ base; });
    if (other != 0) return false;
  }
  return true;
}

// Whether green says much of red and blue: judged by what neighbours differ by, in a few rows.
bool follows_green(const TileShape& shape, const std::vector<uint32_t>& colours) {
  uint64_t apart = 0, together = 0;
  for (size_t y = 0; y < shape.height; y += 8)
    for (size_t x = 1; x < shape.width; x += 2) {
      if (!shape.at(x, y) || !shape.at(x - 1, y)) continue;
      const uint32_t a = colours[y * shape.width + x], b = colours[y * shape.width + x - 1];
      int d[3];
      for (int c = 0; c < 3; ++c) d[c] = difference(a >> kShifts[c], b >> kShifts[c]);
      for (int c = 1; c < 3; ++c)
        apart += static_cast<uint64_t>(std::abs(d[c])), together += static_cast<uint64_t>(std::abs(d[c] - d[0]));
    }
  return together < apart;
}

}  // namespace

bool ColourPlanes::make_palette(const TileShape& shape, const std::vector<uint32_t>& colours) {
  ColourTable table;
  palette_.clear();
  uint32_t last = ColourTable::kNone;
  for (size_t y = 0; y < shape.height; ++y)
    for (size_t x = 0; x < shape.width; ++x) {
      const uint32_t colour = colours[y * shape.width + x];
      if (colour == last || !shape.at(x, y)) continue;
      last = colour;
      uint32_t& place = table[colour];
      if (place != ColourTable::kNone) continue;
      if (palette_.size() == kMostColours) return false;
      place = 0, palette_.push_back(colour);
    }
  return true;
}

// Each colour beside the one most like it, from one end of the ramp.
void ColourPlanes::sort_palette() {
  std::sort(palette_.begin(), palette_.end());
  size_t next = 0;
  for (size_t i = 1; i < palette_.size(); ++i)
    if (distance(palette_[i], palette_[0]) > distance(palette_[next], palette_[0])) next = i;
  for (size_t done = 0; done < palette_.size(); ++done) {
    std::swap(palette_[done], palette_[next]);
    next = done + 1;
    for (size_t i = done + 2; i < palette_.size(); ++i)
      if (distance(palette_[i], palette_[done]) < distance(palette_[next], palette_[done])) next = i;
  }
}

void ColourPlanes::begin_planes(const TileShape& shape) {
  if (mode == kPalette) {
    index.reset(shape);
    for (size_t y = 0; y < shape.height; ++y)
      std::fill_n(index.guide.row(static_cast<ptrdiff_t>(y)), shape.width, int16_t{127 * 64});
    index.begin(shape);
    return;
  }
  for (size_t c = 0; c < 3; ++c) {
    channel[c].values.reset(shape.width, shape.height);
    channel[c].values.fill_row(-1, 0);
    channel[c].symbols.reset(shape, false);
    if (c > 0) channel[c].symbols.other = &channel[c - 1].symbols.tokens;
  }
}

void ColourPlanes::encode_palette(const TileShape& shape, const std::vector<uint32_t>& colours) {
  sort_palette();
  ColourTable table;
  for (uint32_t i = 0; i < palette_.size(); ++i) table[palette_[i]] = i;
  samples_.choose(shape, 1100);
  begin_planes(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    int16_t* const row = index.values.row(static_cast<ptrdiff_t>(y));
    uint32_t last = palette_[0];
    auto value = static_cast<int16_t>(0);
    for (size_t x = 0; x < shape.width; ++x) {
      const uint32_t colour = colours[y * shape.width + x];
      if (colour != last && shape.at(x, y)) last = colour, value = static_cast<int16_t>(table[colour] * 64);
      row[x] = value;
    }
    index.finish_row(shape, y);
  }
  index.encode(shape, samples_, nullptr);
}

void ColourPlanes::encode_channels(const TileShape& shape, const std::vector<uint32_t>& colours) {
  begin_planes(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const uint32_t* const from = colours.data() + y * shape.width;
    for (size_t c = 0; c < 3; ++c) {
      uint8_t *const row = channel[c].values.row(r), *const above = channel[c].values.row(r - 1);
      for (size_t x = 0; x < shape.width; ++x) row[x] = static_cast<uint8_t>(from[x] >> kShifts[c]);
      if (c > 0 && mode == kDifferences)
        for (size_t x = 0; x < shape.width; ++x) row[x] = static_cast<uint8_t>(row[x] - (from[x] >> 8));
      shape.for_each_hole(y, [&](size_t x) { row[x] = above[x]; });
      above[-1] = row[-1] = above[0];
      kernels().median_residuals(above, row, shape.width, channel[c].symbols.narrow.row(r),
                                 channel[c].symbols.tokens.row(r));
      finish_tokens(channel[c].symbols, shape, y);
    }
  }
}

void ColourPlanes::encode(const TileShape& shape, const std::vector<uint32_t>& colours, uint32_t base) {
  if (all_same(shape, colours, base)) {
    mode = kPlain;
  } else if (make_palette(shape, colours)) {
    mode = kPalette;
    encode_palette(shape, colours);
  } else {
    mode = follows_green(shape, colours) ? kDifferences : kChannels;
    encode_channels(shape, colours);
  }
}

void ColourPlanes::put_header(BitSink& bits) const {
  if (mode != kPalette) return;
  bits.put(palette_.size() - 1, 8);
  uint32_t before = 0;
  GolombContext contexts[3];
  for (GolombContext& c : contexts) c.start(8);
  for (const uint32_t colour : palette_) {
    for (int c = 0; c < 3; ++c) contexts[c].put(difference(colour >> kShifts[c], before >> kShifts[c]), bits);
    before = colour;
  }
  index.put_weights(bits);
}

bool ColourPlanes::decode_header(const TileShape& shape, BitReader& bits) {
  if (mode == kPlain) return true;
  begin_planes(shape);
  if (mode != kPalette) return true;
  palette_.resize(bits.source.take(8) + 1);
  uint32_t before = 0;
  GolombContext contexts[3];
  for (GolombContext& c : contexts) c.start(8);
  for (uint32_t& colour : palette_) {
    colour = 0;
    for (int c = 0; c < 3; ++c)
      colour |= ((static_cast<uint32_t>(contexts[c].get(bits.source)) + (before >> kShifts[c])) & 255) << kShifts[c];
    before = colour;
    if (bits.overrun()) return false;
  }
  return index.get_weights(bits);
}

bool ColourPlanes::decode_row(const TileShape& shape, size_t y, uint32_t* colours) {
  const auto r = static_cast<ptrdiff_t>(y);
  if (mode == kPalette) {
    index.decode_sums(shape, y, nullptr);
    decode_values(index, shape, y);
    const int16_t* const row = index.values.row(r);
    int most = 0;
    for (size_t x = 0; x < shape.width; ++x) {
      const int i = row[x] >> 6;
      if (shape.at(x, y)) most = std::max(most, i);
      colours[x] = palette_[std::min(static_cast<size_t>(i), palette_.size() - 1)];
    }
    return static_cast<size_t>(most) < palette_.size();
  }
  for (size_t c = 0; c < 3; ++c) {
    uint8_t *const row = channel[c].values.row(r), *const above = channel[c].values.row(r - 1);
    const uint8_t* const z = channel[c].symbols.narrow.row(r);
    above[-1] = row[-1] = above[0];
    int left = row[-1], corner = left;
    for (size_t x = 0; x < shape.width; ++x) {
      const int up = above[x], low = std::min(left, up), high = std::max(left, up);
      const int guess = left + up - std::clamp(corner, low, high);
      corner = up;
      left = shape.at(x, y) ? (guess + ((z[x] >> 1) ^ -(z[x] & 1))) & 255 : up;
      row[x] = static_cast<uint8_t>(left);
    }
  }
  const uint8_t *const g = channel[0].values.row(r), *const red = channel[1].values.row(r),
                      *const blue = channel[2].values.row(r);
  const uint32_t add = mode == kDifferences ? 0xFF : 0;
  for (size_t x = 0; x < shape.width; ++x)
    colours[x] = ((red[x] + (g[x] & add)) & 255) << 16 | uint32_t{g[x]} << 8 | ((blue[x] + (g[x] & add)) & 255);
  return true;
}

}  // namespace telesplat::codec::detail
