#include "common/codec/dense/colours.h"

#include <algorithm>
#include <cmath>
#include <compare>

#include "common/codec/golomb.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kShifts[3] = {8, 16, 0};  // green, red, blue
constexpr unsigned kRampShiftBits = 5;
constexpr int kMostKnot = 16383;
constexpr int kByte = GuidedPlane::kByteBits, kIndex = GuidedPlane::kIndexBits;

// Indices of colours in a palette, by open addressing.
class ColourTable {
 public:
  ColourTable() { std::fill_n(slots_, kSlots, Slot{}); }
  static constexpr uint32_t kNone = 0xFFFFFFFF;
  /// The index of `colour`, which the caller sets; kNone if the colour is new.
  uint32_t& operator[](uint32_t colour) {
    size_t at = (colour * 0x9E3779B1u) >> 20;
    while (slots_[at].colour != colour && slots_[at].colour != kNone) at = (at + 1) % kSlots;
    slots_[at].colour = colour;
    return slots_[at].place;
  }

 private:
  static constexpr size_t kSlots = 4096;
  struct Slot {
    uint32_t colour = kNone, place = kNone;
  };
  Slot slots_[kSlots];
};

uint32_t brightness(uint32_t c) { return (c >> 16 & 255) + 2 * (c >> 8 & 255) + (c & 255); }

// Codes a palette's colours: each channel as the difference to the colour before, modulo 256. code(difference, context)
// -> difference.
template <class Code>
void for_each_colour(std::vector<uint32_t>& palette, Code code) {
  GolombContext contexts[3];
  for (GolombContext& c : contexts) c.start(8);
  uint32_t before = 0;
  for (uint32_t& colour : palette) {
    uint32_t next = 0;
    for (int c = 0; c < 3; ++c) {
      const uint32_t last = before >> kShifts[c];
      const auto off = static_cast<int8_t>(static_cast<uint8_t>((colour >> kShifts[c]) - last));
      next |= ((static_cast<uint32_t>(code(off, contexts[c])) + last) & 255) << kShifts[c];
    }
    before = colour = next;
  }
}

// Codes the knots of a ramp, each as its distance from the line through the two before it. code(difference, context) ->
// difference. Returns false if a knot is out of range.
template <class Code>
bool for_each_knot(std::array<int16_t, kKnots>& knots, Code code) {
  GolombContext context;
  context.start(64);
  int before = 0, step = 0;
  for (int16_t& knot : knots) {
    const int next = before + step + code(knot - before - step, context);
    if (next < 0 || next > kMostKnot) return false;
    knot = static_cast<int16_t>(next);
    step = next - before, before = next;
  }
  return true;
}

// A range of neighbouring colours that one colour replaces: no channel is further than `by` from its middle.
struct Joined {
  int low[3] = {255, 255, 255}, high[3] = {};
  bool take(uint32_t colour, int by) {
    Joined next = *this;
    for (int c = 0; c < 3; ++c) {
      const int v = static_cast<int>(colour >> kShifts[c] & 255);
      next.low[c] = std::min(low[c], v), next.high[c] = std::max(high[c], v);
      if (next.high[c] - next.low[c] > 2 * by) return false;
    }
    *this = next;
    return true;
  }
  uint32_t middle() const {
    uint32_t out = 0;
    for (int c = 0; c < 3; ++c) out |= static_cast<uint32_t>((low[c] + high[c]) / 2) << kShifts[c];
    return out;
  }
};

}  // namespace

bool has_one_colour(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t colour) {
  uint32_t other = 0;
  for (size_t y = 0; y < shape.height && other == 0; ++y)
    shape.for_each_run(y, [&, row = colours.row(y)](size_t x, size_t end) {
      for (; x < end; ++x) other |= row[x] ^ colour;
    });
  return other == 0;
}

// Lists the colours in the order of their first pixels, and sets each pixel's index. False: more than kMostColours.
bool ColourPlanes::make_palette(const TileShape& shape, const PixelRows<uint32_t>& colours) {
  ColourTable table;
  palette_.clear();
  plane_[0].reset(shape, kIndex, kMostColours - 1);
  for (size_t y = 0; y < shape.height && palette_.size() <= kMostColours; ++y)
    shape.for_each_run(y, [&, from = colours.row(y)](size_t x, size_t end) {
      int16_t* const to = plane_[0].values.row(static_cast<ptrdiff_t>(y));
      for (; x < end && palette_.size() <= kMostColours; ++x) {
        uint32_t& place = table[from[x]];
        if (place == ColourTable::kNone) place = static_cast<uint32_t>(palette_.size()), palette_.push_back(from[x]);
        to[x] = static_cast<int16_t>(place);
      }
    });
  return palette_.size() <= kMostColours;
}

void ColourPlanes::find_heights(const TileShape& shape, const DepthPlane& depth) {
  const HeightScale by{static_cast<double>(ramp_->a), std::ldexp(1.0, ramp_->shift), static_cast<double>(ramp_->low)};
  const double x0 = static_cast<double>(shape.width / 2), y0 = static_cast<double>(shape.height / 2);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const double row = static_cast<double>(ramp_->b) * (static_cast<double>(y) - y0) + static_cast<double>(ramp_->c);
    heights(depth.depth.row(r), shape.width, row - by.step * x0, by, plane_[0].guide.row(r));
  }
}

// Sorts by height if a ramp explains the colours, else by brightness.
void ColourPlanes::sort_palette(const TileShape& shape, const DepthPlane& depth, const RoomAxes* axes) {
  GuidedPlane& index = plane_[0];
  const size_t colours = palette_.size();
  std::vector<RampSample> samples;
  const auto x0 = static_cast<int>(shape.width / 2), y0 = static_cast<int>(shape.height / 2);
  for (const auto p : samples_.places)
    samples.push_back({static_cast<double>(p.x - x0), static_cast<double>(p.y - y0),
                       static_cast<double>(depth.depth.row(p.y)[p.x]),
                       palette_[static_cast<size_t>(index.values.row(p.y)[p.x])]});
  ramp_.reset();
  if (axes != nullptr) ramp_ = fit_ramp(*axes, samples, static_cast<int>(shape.width), static_cast<int>(shape.height));
  std::vector<double> keys(colours), counts(colours);
  for (size_t i = 0; i < colours; ++i) keys[i] = brightness(palette_[i]);
  if (ramp_) {
    std::fill(keys.begin(), keys.end(), 0.0);
    find_heights(shape, depth);
    for (size_t y = 0; y < shape.height; ++y)
      shape.for_each_run(y, [&, r = static_cast<ptrdiff_t>(y)](size_t x, size_t end) {
        const int16_t *const place = index.values.row(r), *const height = index.guide.row(r);
        for (; x < end; ++x) keys[static_cast<size_t>(place[x])] += height[x], ++counts[static_cast<size_t>(place[x])];
      });
    for (size_t i = 0; i < colours; ++i) keys[i] /= counts[i];
  }
  struct Entry {
    double key;
    uint32_t colour, place;
    auto operator<=>(const Entry&) const = default;
  };
  std::vector<Entry> order;
  for (uint32_t i = 0; i < colours; ++i) order.push_back({keys[i], palette_[i], i});
  std::sort(order.begin(), order.end());
  std::vector<int16_t> rank(colours);
  Joined joined;
  palette_.clear();
  for (const Entry& e : order) {
    if (palette_.empty() || !joined.take(e.colour, lattice_.step() / 2))
      joined = {}, (void)joined.take(e.colour, 0), palette_.push_back(0);
    palette_.back() = joined.middle();
    rank[e.place] = static_cast<int16_t>((palette_.size() - 1) << kIndex);
  }
  for (size_t y = 0; y < shape.height; ++y)
    shape.for_each_run(y, [&, row = index.values.row(static_cast<ptrdiff_t>(y))](size_t x, size_t end) {
      for (; x < end; ++x) row[x] = rank[static_cast<size_t>(row[x])];
    });
  // A knot's value is interpolated between the colours whose mean heights lie around it.
  for (size_t k = 0, i = 0; k < kKnots && ramp_; ++k) {
    const auto height = static_cast<double>(256 * k);
    while (i < colours && order[i].key < height) ++i;
    const Entry &next = order[std::min(i, colours - 1)], &last = order[i == 0 ? 0 : i - 1];
    const double part = next.key > last.key ? (height - last.key) / (next.key - last.key) : 0;
    knots_[k] = static_cast<int16_t>(std::lround(rank[last.place] + part * (rank[next.place] - rank[last.place])));
  }
}

// Sets the guide from the heights that find_heights() left in it; without a ramp, to the palette's middle.
void ColourPlanes::begin_index(const TileShape& shape) {
  GuidedPlane& index = plane_[0];
  index.most = static_cast<int>(palette_.size()) - 1;
  for (size_t y = 0; y < shape.height; ++y) {
    int16_t* const row = index.guide.row(static_cast<ptrdiff_t>(y));
    if (ramp_)
      values_of_heights(knots_, shape.width, row);
    else
      std::fill_n(row, shape.width, static_cast<int16_t>(index.most * 8));
  }
  index.begin(shape);
}

// Sets the guide to the first pixel's colour.
void ColourPlanes::begin_channels(const TileShape& shape) {
  for (size_t i = 0; i < 3; ++i) {
    GuidedPlane& p = plane_[i];
    p.reset(shape, kByte, lattice_.index(255));
    const int first = lattice_.index(static_cast<int>(base_ >> kShifts[i] & 255)) << kByte;
    for (size_t y = 0; y < shape.height; ++y)
      std::fill_n(p.guide.row(static_cast<ptrdiff_t>(y)), shape.width, static_cast<int16_t>(first));
    p.begin(shape);
    if (i > 0) p.symbols.other = &plane_[i - 1].symbols.tokens;
  }
}

void ColourPlanes::encode(const TileShape& shape, const PixelRows<uint32_t>& colours, uint32_t base,
                          const DepthPlane& depth, const RoomAxes* axes, int reach) {
  lattice_ = ColourLattice(reach), base_ = base;
  mode = kPlain;
  if (has_one_colour(shape, colours, base)) return;
  samples_.choose(shape, std::min<size_t>(kMostSamples, shape.total / 12));
  if (make_palette(shape, colours)) {
    mode = kPalette;
    sort_palette(shape, depth, axes);
    begin_index(shape);
  } else {
    mode = kChannels;
    begin_channels(shape);
    for (size_t c = 0; c < 3; ++c)
      for (size_t y = 0; y < shape.height; ++y) {
        int16_t* const row = plane_[c].values.row(static_cast<ptrdiff_t>(y));
        const uint32_t* const from = colours.row(y);
        for (size_t x = 0; x < shape.width; ++x)
          row[x] = static_cast<int16_t>(lattice_.index(static_cast<int>(from[x] >> kShifts[c] & 255)) << kByte);
      }
  }
  for (size_t i = 0; i < planes(); ++i) {
    const GuidedPlane* const before = i > 0 ? &plane_[i - 1] : nullptr;
    for (size_t y = 0; y < shape.height; ++y) plane_[i].finish_row(shape, y);
    plane_[i].fit(samples_, before);
    plane_[i].encode(shape, before);
  }
}

void ColourPlanes::put_header(BitSink& bits) const {
  if (mode == kPalette) {
    bits.put(ramp_.has_value(), 1);
    if (ramp_) {
      bits.put(static_cast<uint64_t>(ramp_->shift), kRampShiftBits);
      for (const int32_t e : {ramp_->a, ramp_->b, ramp_->c, ramp_->low}) bits.put(static_cast<uint32_t>(e), 32);
      std::array<int16_t, kKnots> copy = knots_;
      (void)for_each_knot(copy, [&](int off, GolombContext& context) { return context.put(off, bits), off; });
    }
    bits.put(palette_.size() - 1, 10);
    std::vector<uint32_t> copy = palette_;
    for_each_colour(copy, [&](int off, GolombContext& context) { return context.put(off, bits), off; });
  }
  for (size_t i = 0; i < planes(); ++i) plane_[i].put_weights(bits);
}

bool ColourPlanes::decode_header(const TileShape& shape, uint32_t base, const DepthPlane& depth, int reach,
                                 BitReader& bits) {
  lattice_ = ColourLattice(reach), base_ = base;
  if (mode == kChannels) begin_channels(shape);
  if (mode == kPalette) {
    plane_[0].reset(shape, kIndex, kMostColours - 1);
    ramp_.reset();
    if (bits.source.take(1) != 0) {
      ramp_.emplace().shift = static_cast<int>(bits.source.take(kRampShiftBits));
      for (int32_t* e : {&ramp_->a, &ramp_->b, &ramp_->c, &ramp_->low}) *e = static_cast<int32_t>(bits.source.take(32));
      if (!for_each_knot(knots_, [&](int, GolombContext& context) {
            return bits.overrun() ? -(1 << 20) : context.get(bits.source);
          }))
        return false;
      find_heights(shape, depth);
    }
    palette_.assign(bits.source.take(10) + 1, 0);
    for_each_colour(palette_,
                    [&](int, GolombContext& context) { return bits.overrun() ? 0 : context.get(bits.source); });
  }
  if (mode == kPalette) begin_index(shape);
  for (size_t i = 0; i < planes(); ++i)
    if (!plane_[i].get_weights(bits)) return false;
  return !bits.overrun();
}

void ColourPlanes::decode_row(const TileShape& shape, size_t y, uint32_t* colours) {
  if (mode == kPlain) return std::fill_n(colours, shape.width, base_), void();
  for (size_t i = 0; i < planes(); ++i) {
    plane_[i].decode_sums(shape, y, i > 0 ? &plane_[i - 1] : nullptr);
    decode_values(plane_[i], shape, y);
  }
  const auto values = [&](size_t i) { return plane_[i].values.row(static_cast<ptrdiff_t>(y)); };
  if (mode == kPalette) {
    const int16_t* const row = values(0);
    for (size_t x = 0; x < shape.width; ++x) colours[x] = palette_[static_cast<size_t>(row[x] >> kIndex)];
    return;
  }
  const int16_t *const green = values(0), *const red = values(1), *const blue = values(2);
  const auto channel = [&](int16_t v) { return static_cast<uint32_t>(lattice_.value(v >> kByte)); };
  for (size_t x = 0; x < shape.width; ++x)
    colours[x] = channel(red[x]) << 16 | channel(green[x]) << 8 | channel(blue[x]);
}

}  // namespace telesplat::codec::detail
