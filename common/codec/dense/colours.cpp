#include "common/codec/dense/colours.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kShifts[3] = {8, 16, 0};      // green, red, blue
constexpr size_t kMostColourSamples = 700;  // of a tile

// Colours seen, by open addressing, and what stands for each.
class ColourTable {
 public:
  ColourTable() { std::fill_n(slots_, kSlots, Slot{}); }
  static constexpr uint32_t kNone = 0xFFFFFFFF;
  /// What stands for `colour`, or kNone.
  uint32_t find(uint32_t colour) const {
    const Slot& first = slots_[hash(colour)];
    if (first.colour == colour) [[likely]]
      return first.place;
    return slots_[place_of(colour)].place;
  }
  void enter(uint32_t colour, size_t place) { slots_[place_of(colour)] = {colour, static_cast<uint32_t>(place)}; }

 private:
  static constexpr size_t kSlots = 4096;
  struct Slot {
    uint32_t colour = kNone, place = kNone;
  };
  static size_t hash(uint32_t colour) { return (colour * 0x9E3779B1u) >> 20; }
  // Where it is, or where it should enter.
  size_t place_of(uint32_t colour) const {
    size_t at = hash(colour);
    while (slots_[at].colour != colour && slots_[at].colour != kNone) at = (at + 1) % kSlots;
    return at;
  }
  Slot slots_[kSlots];
};

int8_t difference(uint32_t a, uint32_t b) { return static_cast<int8_t>(static_cast<uint8_t>(a - b)); }

// Whether green says much of red and blue: judged by what neighbours differ by, in a few rows.
bool follows_green(const TileShape& shape, const PixelRows<uint32_t>& colours) {
  uint64_t apart = 0, together = 0;
  for (size_t y = 0; y < shape.height; y += 8)
    for (size_t x = 1; x < shape.width; x += 2) {
      if (!shape.at(x, y) || !shape.at(x - 1, y)) continue;
      const uint32_t a = colours.row(y)[x], b = colours.row(y)[x - 1];
      int d[3];
      for (int c = 0; c < 3; ++c) d[c] = difference(a >> kShifts[c], b >> kShifts[c]);
      for (int c = 1; c < 3; ++c)
        apart += static_cast<uint64_t>(std::abs(d[c])), together += static_cast<uint64_t>(std::abs(d[c] - d[0]));
    }
  return together < apart;
}

void put_height(const HeightModel& height, BitSink& bits) {
  for (const int32_t e : {height.a, height.b, height.c, height.base}) bits.put(static_cast<uint32_t>(e), 32);
  bits.put(static_cast<uint32_t>(height.low + 32768), 16);
  bits.put(static_cast<uint32_t>(height.scale), 16);
  GolombContext context;
  context.start(64);
  int before = 0, step = 0;
  for (const int16_t knot : height.knots) {
    context.put(knot - before - step, bits);
    step = knot - before, before = knot;
  }
}

bool get_height(HeightModel& height, BitReader& bits) {
  for (int32_t* e : {&height.a, &height.b, &height.c, &height.base}) *e = static_cast<int32_t>(bits.source.take(32));
  height.low = static_cast<int32_t>(bits.source.take(16)) - 32768;
  height.scale = static_cast<int32_t>(bits.source.take(16));
  GolombContext context;
  context.start(64);
  int before = 0, step = 0;
  for (int16_t& knot : height.knots) {
    const int next = before + step + context.get(bits.source);
    if (next < 0 || next > 16383 || bits.overrun()) return false;
    knot = static_cast<int16_t>(next);
    step = next - before, before = next;
  }
  return true;
}

}  // namespace

bool of_one_colour(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t base) {
  for (size_t y = 0; y < shape.height; ++y) {
    const auto [begin, end] = shape.span(y);
    const uint32_t* const row = colours.row(y);
    const uint8_t* const cover = shape.cover(y);
    uint32_t other = 0;
    if (cover == nullptr)
      for (size_t x = begin; x < end; ++x) other |= row[x] ^ base;
    else
      for (size_t x = begin; x < end; ++x)
        other |= (row[x] ^ base) & static_cast<uint32_t>(static_cast<int8_t>(cover[x]));
    if (other != 0) return false;
  }
  return true;
}

// The colours in the order in which they come, and the place of each pixel's. False where they are too many.
bool ColourPlanes::make_palette(const TileShape& shape, const PixelRows<uint32_t>& colours) {
  ColourTable table;
  palette_.clear(), first_.clear();
  index.reset(shape, GuidedPlane::kIndexBits, 254);
  bool fits = true;
  const auto enter = [&](uint32_t colour, size_t x, size_t y) {
    fits &= palette_.size() < kMostColours;
    if (!fits) return;
    table.enter(colour, palette_.size());
    palette_.push_back(colour);
    first_.push_back({static_cast<float>(x), static_cast<float>(y), 0, colour});
  };
  for (size_t y = 0; y < shape.height && fits; ++y) {
    const uint32_t* const from = colours.row(y);
    int16_t* const places = index.values.row(static_cast<ptrdiff_t>(y));
    if (!shape.full(y)) std::fill_n(places, shape.width, int16_t{0});
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x < end; ++x) {
        uint32_t place = table.find(from[x]);
        if (place == ColourTable::kNone) [[unlikely]]
          place = static_cast<uint32_t>(palette_.size()), enter(from[x], x, y);
        places[x] = static_cast<int16_t>(place);
      }
    });
  }
  return fits;
}

// By height where that explains the colours, else by brightness.
void ColourPlanes::sort_palette(const TileShape& shape, const DepthPlane& depth, const KnownAxes& known) {
  const float x0 = static_cast<float>(shape.width / 2), y0 = static_cast<float>(shape.height / 2);
  const auto code_at = [&](float x, float y) {
    return static_cast<float>(depth.depth.row(static_cast<ptrdiff_t>(y))[static_cast<size_t>(x)]);
  };
  for (HeightSample& s : first_) s.code = code_at(s.x, s.y), s.x -= x0, s.y -= y0;
  height_samples_.clear();
  for (size_t i = 0; i < samples_.places.size(); i += 2) {
    const auto p = samples_.places[i];
    const auto x = static_cast<float>(p.x), y = static_cast<float>(p.y);
    const auto place = static_cast<uint32_t>(index.values.row(p.y)[p.x]);
    height_samples_.push_back({x - x0, y - y0, code_at(x, y), palette_[place], place});
  }
  has_height_ = fit_axis(known, height_samples_, first_, height_);
  if (has_height_) return sort_by_height(shape, depth);
  std::sort(palette_.begin(), palette_.end(), [](uint32_t a, uint32_t b) {
    const auto brightness = [](uint32_t c) { return (c >> 16 & 255) + 2 * (c >> 8 & 255) + (c & 255); };
    return brightness(a) != brightness(b) ? brightness(a) < brightness(b) : a < b;
  });
}

// Every second row says at which height a colour lies, and its first pixel: few would sort colours badly that have few
// of them.
void ColourPlanes::sort_by_height(const TileShape& shape, const DepthPlane& depth) {
  constexpr size_t kTables = 4;  // so that equal colours side by side need not wait for each other
  std::vector<uint64_t> sums(kTables * palette_.size());  // pixels, and in the lower half heights
  find_heights(shape, depth);
  constexpr auto pixel_at = [](int16_t height) { return uint64_t{1} << 32 | static_cast<uint32_t>(height); };
  for (size_t i = 0; i < first_.size(); ++i) {
    const auto y = static_cast<ptrdiff_t>(first_[i].y) + static_cast<ptrdiff_t>(shape.height / 2),
               x = static_cast<ptrdiff_t>(first_[i].x) + static_cast<ptrdiff_t>(shape.width / 2);
    sums[kTables * i] = pixel_at(index.guide.row(y)[x]);
  }
  for (size_t y = 0; y < shape.height; y += 2) {
    const auto r = static_cast<ptrdiff_t>(y);
    const int16_t *const places = index.values.row(r), *const height = index.guide.row(r);
    uint64_t* const at = sums.data();
    const auto add = [&](size_t x, size_t k) {
      at[kTables * static_cast<size_t>(places[x]) + k] += pixel_at(height[x]);
    };
    shape.for_each_run(y, [&](size_t x, size_t end) {
      for (; x + kTables <= end; x += kTables)
        for (size_t k = 0; k < kTables; ++k) add(x + k, k);
      for (; x < end; ++x) add(x, 0);
    });
  }
  std::vector<ColourHeight> heights(palette_.size());
  for (size_t i = 0; i < sums.size(); ++i) {
    ColourHeight& of = heights[i / kTables];
    of.sum += static_cast<uint32_t>(sums[i]), of.pixels += static_cast<uint32_t>(sums[i] >> 32);
  }
  struct Key {
    double height;
    uint32_t colour, place;
    bool operator<(const Key& o) const { return height != o.height ? height < o.height : colour < o.colour; }
  };
  std::vector<Key> order;
  for (uint32_t i = 0; i < palette_.size(); ++i) order.push_back({heights[i].mean(), palette_[i], i});
  std::sort(order.begin(), order.end());
  std::vector<ColourHeight> sorted(order.size());
  for (size_t i = 0; i < order.size(); ++i) palette_[i] = order[i].colour, sorted[i] = heights[order[i].place];
  fit_knots(sorted, height_);
}

void ColourPlanes::find_heights(const TileShape& shape, const DepthPlane& depth) {
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.around(y);
    kernels().heights(depth.depth.row(r) + begin, end - begin,
                      static_cast<int>(begin) - static_cast<int>(shape.width / 2),
                      static_cast<int>(y) - static_cast<int>(shape.height / 2), height_, index.guide.row(r) + begin);
  }
}

// From heights: find_heights() has left them where what they stand for shall be.
void ColourPlanes::begin_index(const TileShape& shape) {
  const int last = static_cast<int>(palette_.size()) - 1;
  index.reset(shape, GuidedPlane::kIndexBits, last);  // keeps the values
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const TileShape::Span around = shape.around(y);
    if (has_height_)
      kernels().knots(height_, around.size(), index.guide.row(r) + around.begin);
    else
      std::fill_n(index.guide.row(r), shape.width, static_cast<int16_t>(last * 8));
  }
  index.begin(shape);
}

void ColourPlanes::begin_channels(const TileShape& shape) {
  for (size_t c = 0; c < 3; ++c) {
    channel[c].values.reset(shape.width, shape.height);
    channel[c].values.fill_row(-1, 0);
    channel[c].symbols.reset(shape, false);
    if (c > 0) channel[c].symbols.other = &channel[c - 1].symbols.tokens;
  }
}

// Colours beside each other become one, as long as it is near enough to all of them. Returns where each is then.
std::vector<int16_t> ColourPlanes::join_palette(int reach) {
  std::vector<int16_t> to(palette_.size());
  std::vector<uint32_t> joined;
  std::vector<size_t> begins;
  const auto channel = [](uint32_t colour, int c) { return static_cast<int>(colour >> kShifts[c] & 255); };
  for (size_t i = 0; i < palette_.size();) {
    int low[3], high[3];
    for (int c = 0; c < 3; ++c) low[c] = high[c] = channel(palette_[i], c);
    const size_t first = i;
    for (; i < palette_.size(); ++i) {
      bool near = true;
      for (int c = 0; c < 3; ++c) {
        const int v = channel(palette_[i], c);
        near &= std::max(high[c], v) - std::min(low[c], v) <= 2 * reach;
      }
      if (!near) break;
      for (int c = 0; c < 3; ++c)
        low[c] = std::min(low[c], channel(palette_[i], c)), high[c] = std::max(high[c], channel(palette_[i], c));
      to[i] = static_cast<int16_t>(joined.size());
    }
    begins.push_back(first);
    uint32_t middle = 0;
    for (int c = 0; c < 3; ++c) middle |= static_cast<uint32_t>((low[c] + high[c]) / 2) << kShifts[c];
    joined.push_back(middle);
  }
  begins.push_back(palette_.size());
  // What a height stood for: the same part of the way through its colours.
  if (has_height_)
    for (int16_t& knot : height_.knots) {
      const int old = std::clamp(knot + 8, 0, static_cast<int>(palette_.size()) * 16 - 1);  // 16ths, from its lower end
      const int16_t place = to[static_cast<size_t>(old / 16)];
      const int first = static_cast<int>(begins[static_cast<size_t>(place)]),
                end = static_cast<int>(begins[static_cast<size_t>(place) + 1]);
      knot = static_cast<int16_t>(place * 16 + (old - first * 16) / (end - first) - 8);
      knot = std::max(knot, int16_t{0});
    }
  palette_ = std::move(joined);
  return to;
}

// index.values: places in the palette before it was sorted.
void ColourPlanes::encode_palette(const TileShape& shape, int reach) {
  ColourTable table;
  for (size_t i = 0; i < palette_.size(); ++i) table.enter(palette_[i], i);
  uint16_t values[kMostColours];
  for (size_t i = 0; i < palette_.size(); ++i) values[i] = static_cast<uint16_t>(table.find(first_[i].colour) * 16);
  if (reach > 0) {
    const std::vector<int16_t> to = join_palette(reach);
    for (size_t i = 0; i < first_.size(); ++i)
      values[i] = static_cast<uint16_t>(to[static_cast<size_t>(values[i] / 16)] * 16);
  }
  begin_index(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    int16_t* const row = index.values.row(static_cast<ptrdiff_t>(y));
    const auto [begin, end] = shape.span(y);
    size_t x = begin;
    for (; x + 4 <= end; x += 4) {
      uint64_t four;
      std::memcpy(&four, row + x, 8);
      four = uint64_t{values[four & 0xFFFF]} | uint64_t{values[four >> 16 & 0xFFFF]} << 16 |
             uint64_t{values[four >> 32 & 0xFFFF]} << 32 | uint64_t{values[four >> 48]} << 48;
      std::memcpy(row + x, &four, 8);
    }
    for (; x < end; ++x) row[x] = static_cast<int16_t>(values[row[x]]);
    index.finish_row(shape, y);
  }
  index.encode(shape, samples_, nullptr);
}

void ColourPlanes::encode_channels(const TileShape& shape, const PixelRows<uint32_t>& colours) {
  begin_channels(shape);
  uint8_t indices[256];
  for (int v = 0; v < 256; ++v) indices[v] = static_cast<uint8_t>(lattice_.index(v));
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const uint32_t* const from = colours.row(y);
    for (size_t c = 0; c < 3; ++c) {
      uint8_t *const row = channel[c].values.row(r), *const above = channel[c].values.row(r - 1);
      for (size_t x = 0; x < shape.width; ++x) row[x] = indices[from[x] >> kShifts[c] & 255];
      if (c > 0 && mode == kDifferences)
        for (size_t x = 0; x < shape.width; ++x) row[x] = static_cast<uint8_t>(row[x] - indices[from[x] >> 8 & 255]);
      shape.for_each_hole(y, [&](size_t x) { row[x] = above[x]; });
      above[-1] = row[-1] = above[0];
      kernels().median_residuals(above, row, shape.width, channel[c].symbols.narrow.row(r),
                                 channel[c].symbols.tokens.row(r));
      finish_tokens(channel[c].symbols, shape, y);
    }
  }
}

// Steps of channels may be less than what a palette without height keeps.
void ColourPlanes::try_channels(const TileShape& shape, const PixelRows<uint32_t>& colours) {
  const double by_index = rough_bits(index.symbols, shape) + static_cast<double>(header_bits()) / 4;
  mode = follows_green(shape, colours) ? kDifferences : kChannels;
  encode_channels(shape, colours);
  double by_channels = 0;
  for (const Channel& c : channel) by_channels += rough_bits(c.symbols, shape);
  if (by_index <= by_channels) mode = kPalette;
}

void ColourPlanes::encode(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t base,
                          const DepthPlane& depth, const KnownAxes& known, int reach) {
  lattice_ = ColourLattice(reach);
  if (of_one_colour(shape, colours, base)) {
    mode = kPlain;
  } else if (make_palette(shape, colours)) {
    mode = kPalette;
    samples_.choose(shape, std::min<size_t>(kMostColourSamples, shape.total / 12));
    sort_palette(shape, depth, known);
    encode_palette(shape, reach);
    if (reach > 0 && !has_height_) try_channels(shape, colours);
  } else {
    mode = follows_green(shape, colours) ? kDifferences : kChannels;
    encode_channels(shape, colours);
  }
}

void ColourPlanes::put_header(BitSink& bits) const {
  if (mode != kPalette) return;
  bits.put(palette_.size() - 1, 10);
  bits.put(has_height_, 1);
  if (has_height_) put_height(height_, bits);
  uint32_t before = 0;
  GolombContext contexts[3];
  for (GolombContext& c : contexts) c.start(8);
  for (const uint32_t colour : palette_) {
    for (int c = 0; c < 3; ++c) contexts[c].put(difference(colour >> kShifts[c], before >> kShifts[c]), bits);
    before = colour;
  }
  index.put_weights(bits);
}

bool ColourPlanes::decode_header(const TileShape& shape, const DepthPlane& depth, int reach, BitReader& bits) {
  lattice_ = ColourLattice(reach);
  if (mode == kPlain) return true;
  if (mode != kPalette) {
    begin_channels(shape);
    return true;
  }
  palette_.resize(bits.source.take(10) + 1);
  has_height_ = bits.source.take(1) != 0;
  if (has_height_ && !get_height(height_, bits)) return false;
  index.reset(shape, GuidedPlane::kIndexBits, static_cast<int>(palette_.size()) - 1);
  if (has_height_) find_heights(shape, depth);
  begin_index(shape);
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

void ColourPlanes::decode_row(const TileShape& shape, size_t y, uint32_t* colours) {
  if (mode == kPalette) {
    index.decode_sums(shape, y, nullptr);
    decode_values(index, shape, y);
  }
  get_colours(shape, y, colours);
}

void ColourPlanes::get_colours(const TileShape& shape, size_t y, uint32_t* colours) {
  const auto r = static_cast<ptrdiff_t>(y);
  if (mode == kPalette) {
    const int16_t* const row = index.values.row(r);  // none is beyond the last colour: decode_values() sees to that
    const uint32_t* const palette = palette_.data();
    const auto [begin, end] = shape.span(y);
    for (size_t x = begin; x < end; ++x) colours[x] = palette[row[x] >> 4];
    return;
  }
  const uint8_t *above[3], *z[3];
  uint8_t* row[3];
  for (size_t c = 0; c < 3; ++c) {
    uint8_t* const over = channel[c].values.row(r - 1);
    row[c] = channel[c].values.row(r), above[c] = over, z[c] = channel[c].symbols.narrow.row(r);
    over[-1] = row[c][-1] = over[0];
    if (!shape.full(y)) std::copy_n(over, shape.width, row[c]);  // where nothing is covered
  }
  // Three that need not wait for each other.
  shape.for_each_run(y, [&](size_t begin, size_t end) {
    const auto first = static_cast<ptrdiff_t>(begin) - 1;
    int left[3] = {row[0][first], row[1][first], row[2][first]};
    for (size_t x = begin; x < end; ++x)
      for (size_t c = 0; c < 3; ++c) {
        const int up = above[c][x], corner = above[c][static_cast<ptrdiff_t>(x) - 1];
        const int guess = left[c] + up - std::clamp(corner, std::min(left[c], up), std::max(left[c], up));
        left[c] = (guess + ((z[c][x] >> 1) ^ -(z[c][x] & 1))) & 255;
        row[c][x] = static_cast<uint8_t>(left[c]);
      }
  });
  const uint8_t *const g = channel[0].values.row(r), *const red = channel[1].values.row(r),
                       *const blue = channel[2].values.row(r);
  const uint32_t add = mode == kDifferences ? 0xFF : 0;
  if (lattice_.step() == 1) {
    for (size_t x = 0; x < shape.width; ++x)
      colours[x] = ((red[x] + (g[x] & add)) & 255) << 16 | uint32_t{g[x]} << 8 | ((blue[x] + (g[x] & add)) & 255);
    return;
  }
  uint32_t values[256];
  for (int i = 0; i < 256; ++i) values[i] = static_cast<uint32_t>(lattice_.value(i));
  for (size_t x = 0; x < shape.width; ++x)
    colours[x] =
        values[(red[x] + (g[x] & add)) & 255] << 16 | values[g[x]] << 8 | values[(blue[x] + (g[x] & add)) & 255];
}

}  // namespace telesplat::codec::detail
