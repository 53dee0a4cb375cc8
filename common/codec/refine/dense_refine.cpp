#include "common/codec/refine/dense_refine.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace telesplat::codec::detail {
namespace {

constexpr int kShifts[3] = {8, 16, 0};  // green, red, blue
constexpr size_t kUnchecked = 1024;     // bits of a header between two looks at its end
constexpr int kClasses = 16;            // contexts of normals

uint32_t fold(int32_t v) { return (static_cast<uint32_t>(v) << 1) ^ static_cast<uint32_t>(v >> 31); }

// fold() of v, -down <= v <= up: beyond the nearer of both ends all numbers lie on one side.
uint32_t fold_between(int32_t v, int32_t down, int32_t up) {
  const int32_t even = std::min(down, up);
  return std::abs(v) <= even ? fold(v) : static_cast<uint32_t>(even + std::abs(v));
}
int32_t unfold_between(uint32_t z, int32_t down, int32_t up) {
  const int32_t even = std::min(down, up);
  if (z <= 2 * static_cast<uint32_t>(even)) return static_cast<int32_t>(z >> 1) ^ -static_cast<int32_t>(z & 1);
  const int32_t size = static_cast<int32_t>(z) - even;
  return down < up ? size : -size;
}

// Where the prediction lies in what is possible, both in 64ths of a code.
uint8_t class_of(int guess, int known, int reach) {
  const int place = ((guess - known) * (64 / (reach + 1)) >> 9) + kClasses / 2;
  return static_cast<uint8_t>(std::clamp(place, 0, kClasses - 1));
}

template <class F>
void for_each_row(const TileRect& rect, F f) {
  for (int y = 0; y < rect.height; ++y) f(rect.index(0, y), static_cast<size_t>(y) * static_cast<size_t>(rect.width));
}

}  // namespace

void RefinementCoder::begin(const TileRect& rect, const Mask* mask) {
  shape_.reset(static_cast<size_t>(rect.width), static_cast<size_t>(rect.height), mask);
  const size_t pixels = shape_.width * shape_.height + 64;
  if (known_depth_.size() >= pixels) return;
  for (auto* v : {&known_depth_, &exact_colours_, &known_colours_}) v->resize(pixels);
  for (auto* v : {&exact_normals_, &known_normals_}) v->resize(pixels);
}

void RefinementCoder::load_known(const image::DepthImage& known, const TileRect& rect) {
  for_each_row(rect, [&](size_t from, size_t to) {
    std::copy_n(known.depth.data() + from, rect.width, known_depth_.data() + to);
    std::copy_n(known.colour.data() + from, rect.width, known_colours_.data() + to);
    std::copy_n(known.normal.data() + from, rect.width, known_normals_.data() + to);
  });
  const uint32_t base = *std::find_if(known_depth_.begin(), known_depth_.end(), [](uint32_t d) { return d != 0; });
  depth_.reset(shape_, base);
}

void RefinementCoder::load_exact(const image::DepthImage& exact, const TileRect& rect) {
  for_each_row(rect, [&](size_t from, size_t to) {
    std::copy_n(exact.depth.data() + from, rect.width, depth_.depth.row(static_cast<ptrdiff_t>(to / shape_.width)));
    std::copy_n(exact.colour.data() + from, rect.width, exact_colours_.data() + to);
    std::copy_n(exact.normal.data() + from, rect.width, exact_normals_.data() + to);
  });
}

// Depth by where it may lie: L + U - UL, moved to the nearest place that is possible.
void RefinementCoder::fill_hole(size_t x, size_t y) {
  uint32_t* const row = depth_.depth.row(static_cast<ptrdiff_t>(y));
  const uint32_t* const above = depth_.depth.row(static_cast<ptrdiff_t>(y) - 1);
  const auto plane = static_cast<int32_t>(row[x - 1] + above[x] - above[x - 1]);
  row[x] = static_cast<uint32_t>(std::clamp(plane, 1, static_cast<int32_t>(image::kMaxDepthCode)));
}

namespace {

struct Possible {
  int32_t guess, down, up;
};
inline Possible possible(const uint32_t* row, const uint32_t* above, uint32_t known, size_t x, const Reach& reach) {
  const Reach::Codes codes = reach.around(known);
  const auto low = static_cast<int32_t>(codes.low), high = static_cast<int32_t>(codes.high);
  const auto plane = static_cast<int32_t>(row[x - 1] + above[x] - above[x - 1]);
  const int32_t guess = std::clamp(plane, low, high);
  return {guess, guess - low, high - guess};
}

// So that a row's first pixel is predicted from the two above it.
void begin_depth_row(Plane<uint32_t>& depth, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  depth.row(r)[-1] = depth.row(r - 1)[0];
}

}  // namespace

void RefinementCoder::encode_near_depth(const Reach& reach) {
  near_symbols_.reset(shape_, true);
  for (size_t y = 0; y < shape_.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    begin_depth_row(depth_.depth, y);
    const uint32_t *const row = depth_.depth.row(r), *const above = depth_.depth.row(r - 1);
    const uint32_t* const known = known_depth_.data() + y * shape_.width;
    uint32_t* const z = near_symbols_.wide.row(r);
    uint8_t* const tokens = near_symbols_.tokens.row(r);
    const auto code = [&](size_t x) {
      const Possible p = possible(row, above, known[x], x, reach);
      z[x] = fold_between(static_cast<int32_t>(row[x]) - p.guess, p.down, p.up);
      tokens[x] = static_cast<uint8_t>(token_of(z[x]));
    };
    if (shape_.full(y)) {
      for (size_t x = 0; x < shape_.width; ++x) code(x);
    } else {
      for (size_t x = 0; x < shape_.width; ++x) shape_.at(x, y) ? code(x) : fill_hole(x, y);
    }
    finish_tokens(near_symbols_, shape_, y);
  }
}

bool RefinementCoder::decode_near_row(const Reach& reach, size_t y) {
  const auto r = static_cast<ptrdiff_t>(y);
  begin_depth_row(depth_.depth, y);
  uint32_t *const row = depth_.depth.row(r), *const above = depth_.depth.row(r - 1);
  const uint32_t* const known = known_depth_.data() + y * shape_.width;
  const uint32_t* const z = near_symbols_.wide.row(r);
  bool good = true;
  for (size_t x = 0; x < shape_.width; ++x) {
    if (!shape_.at(x, y)) {
      fill_hole(x, y);
      continue;
    }
    const Possible p = possible(row, above, known[x], x, reach);
    const uint32_t most = static_cast<uint32_t>(p.down + p.up);
    good &= z[x] <= most;
    row[x] = static_cast<uint32_t>(p.guess + unfold_between(std::min(z[x], most), p.down, p.up));
  }
  return good;
}

void RefinementCoder::encode_depth(const Reach& reach, BitSink& bits) {
  const uint32_t base = depth_.depth.row(-1)[0];
  encode_near_depth(reach);
  const double near_bits = rough_bits(near_symbols_, shape_);
  // As if nothing were known gives pixels that are not covered other depths: it comes first, and again if need be.
  depth_.encode(shape_, base, false);
  near_depth_ = near_bits <= rough_bits(depth_.symbols, shape_);
  if (near_depth_ && shape_.mask != nullptr) {
    depth_.depth.fill_row(-1, base);
    encode_near_depth(reach);
  }
  bits.put(near_depth_, 1);
  if (!near_depth_) depth_.put_way(bits, false);
  add_plane(near_depth_ ? near_symbols_ : depth_.symbols);
  end_group(bits);
  depth_.extend(shape_);
}

bool RefinementCoder::decode_depth(const Reach& reach, WordSource& source) {
  near_depth_ = reader_.source.take(1) != 0;
  if (near_depth_)
    near_symbols_.reset(shape_, true);
  else if (!depth_.begin_decoding(shape_, false, reader_))
    return false;
  SymbolPlane& symbols = near_depth_ ? near_symbols_ : depth_.symbols;
  if (!decoders_[0].prepare(symbols, reader_)) return false;
  for (size_t y = 0; y < shape_.height; ++y) {
    if (!decoders_[0].get_row(symbols, shape_, y, source)) return false;
    if (near_depth_ ? !decode_near_row(reach, y) : !depth_.decode_row(shape_, y, image::kMaxDepthCode)) return false;
  }
  depth_.extend(shape_);
  return true;
}

// What is known of normals, and with it the exact ones, on the turned map in 64ths.
void RefinementCoder::load_normals(const Reach& reach, bool with_exact) {
  for (NearPlane& p : normal_) {
    p.exact.reset(shape_);
    p.known.reset(shape_.width, shape_.height);
    p.exact.symbols.has_contexts = true;
  }
  const uint16_t* const turned = turn_table(reach.pole);
  const auto load = [&](const uint16_t* codes, int16_t* a, int16_t* b) {
    for (size_t x = 0; x < shape_.width; ++x) {
      const uint16_t code = turned[codes[x]];
      a[x] = static_cast<int16_t>((code & 255) * 64), b[x] = static_cast<int16_t>((code >> 8) * 64);
    }
  };
  for (size_t y = 0; y < shape_.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    load(known_normals_.data() + y * shape_.width, normal_[0].known.row(r), normal_[1].known.row(r));
    if (with_exact)
      load(exact_normals_.data() + y * shape_.width, normal_[0].exact.values.row(r), normal_[1].exact.values.row(r));
  }
}

void RefinementCoder::begin_normals() {
  size_t first = 0;
  while (known_depth_[first] == 0) ++first;
  const auto at_first = [&](int c) {
    return normal_[c].known.row(static_cast<ptrdiff_t>(first / shape_.width))[first % shape_.width] >> 6;
  };
  make_geometry_guide(shape_, depth_, has_geometry_ ? &geometry_ : nullptr,
                      static_cast<uint16_t>(at_first(0) | at_first(1) << 8), normal_[0].exact.guide,
                      normal_[1].exact.guide);
  for (NearPlane& p : normal_) {
    p.exact.begin(shape_);
    for (size_t y = 0; y < shape_.height; ++y) {
      int16_t* const row = p.known.row(static_cast<ptrdiff_t>(y));
      const int16_t* const guide = p.exact.guide.row(static_cast<ptrdiff_t>(y));
      shape_.for_each_hole(y, [&](size_t x) { row[x] = p.exact.nearest_value(guide[x]); });
      row[-1] = row[0];
    }
  }
}

// Of one row: what is expected, into guesses_, and so the contexts.
void RefinementCoder::predict_normals(const Reach& reach, size_t c, size_t y) {
  GuidedPlane& p = normal_[c].exact;
  const auto r = static_cast<ptrdiff_t>(y);
  p.make_sums(shape_, y, c == 0 ? nullptr : &normal_[0].exact);
  const int16_t* const known = normal_[c].known.row(r);
  uint8_t* const contexts = p.symbols.contexts.row(r);
  const int32_t left = p.weights[0];
  if (guesses_.size() < shape_.width) guesses_.resize(shape_.width);
  for (size_t x = 0; x < shape_.width; ++x) {
    const int32_t guess = std::clamp((p.sums[x] + left * known[x - 1] + (1 << 12)) >> 13, 0, 254 * 64);
    guesses_[x] = guess;
    contexts[x] = class_of(guess, known[x], reach.normal);
  }
}

// How far a row is from what was expected, for the other coordinate.
void RefinementCoder::finish_normals(size_t c, size_t y) {
  GuidedPlane& p = normal_[c].exact;
  p.finish_row(shape_, y);
  const int16_t* const exact = p.values.row(static_cast<ptrdiff_t>(y));
  int16_t* const residual = p.residuals.row(static_cast<ptrdiff_t>(y));
  for (size_t x = 0; x < shape_.width; ++x) residual[x] = static_cast<int16_t>(exact[x] - guesses_[x]);
}

void RefinementCoder::encode_normals(const Reach& reach, BitSink& bits) {
  load_normals(reach, true);
  samples_.choose(shape_, std::min<size_t>(kMostSamples, shape_.total / 16));
  const Plane<int16_t>* const values[2] = {&normal_[0].exact.values, &normal_[1].exact.values};
  has_geometry_ = fit_geometry(samples_, depth_.depth, values, -static_cast<int>(shape_.width / 2),
                               -static_cast<int>(shape_.height / 2), geometry_);
  if (reach.normal == 0) return;
  bits.put(has_geometry_, 1);
  if (has_geometry_) put_geometry(bits, geometry_);
  begin_normals();
  for (NearPlane& p : normal_)
    for (size_t y = 0; y < shape_.height; ++y) p.exact.finish_row(shape_, y);
  for (size_t c = 0; c < 2; ++c) {
    GuidedPlane& p = normal_[c].exact;
    p.fit(samples_, c == 0 ? nullptr : &normal_[0].exact, &normal_[c].known);
    p.put_weights(bits);
    for (size_t y = 0; y < shape_.height; ++y) {
      const auto r = static_cast<ptrdiff_t>(y);
      predict_normals(reach, c, y);
      const int16_t *const exact = p.values.row(r), *const known = normal_[c].known.row(r);
      uint8_t *const tokens = p.symbols.tokens.row(r), *const z = p.symbols.narrow.row(r);
      for (size_t x = 0; x < shape_.width; ++x)
        z[x] = tokens[x] = static_cast<uint8_t>((exact[x] - known[x]) / 64 + reach.normal);
      finish_tokens(p.symbols, shape_, y);
      finish_normals(c, y);
    }
    add_plane(p.symbols);
  }
  end_group(bits);
}

bool RefinementCoder::decode_normals(const Reach& reach, WordSource& source) {
  if (reach.normal == 0) return true;
  load_normals(reach, false);
  has_geometry_ = reader_.source.take(1) != 0;
  if (has_geometry_ && !get_geometry(reader_, geometry_)) return false;
  begin_normals();
  for (NearPlane& p : normal_)
    if (!p.exact.get_weights(reader_) || p.exact.median) return false;
  for (size_t c = 0; c < 2; ++c)
    if (!decoders_[1 + c].prepare(normal_[c].exact.symbols, reader_)) return false;
  bool good = true;
  for (size_t y = 0; y < shape_.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    for (size_t c = 0; c < 2; ++c) {
      GuidedPlane& p = normal_[c].exact;
      predict_normals(reach, c, y);
      if (!decoders_[1 + c].get_row(p.symbols, shape_, y, source)) return false;
      int16_t* const exact = p.values.row(r);
      const int16_t* const known = normal_[c].known.row(r);
      const uint8_t* const z = p.symbols.narrow.row(r);
      for (size_t x = 0; x < shape_.width; ++x) {
        const int value = (known[x] >> 6) + z[x] - reach.normal;
        good &= !shape_.at(x, y) || (value >= 0 && value <= 254 && z[x] <= 2 * reach.normal);
        exact[x] = static_cast<int16_t>(std::clamp(value, 0, 254) * 64);
      }
      finish_normals(c, y);
    }
    const int16_t *const a = normal_[0].exact.values.row(r), *const b = normal_[1].exact.values.row(r);
    uint16_t* const out = exact_normals_.data() + y * shape_.width;
    for (size_t x = 0; x < shape_.width; ++x)
      out[x] = turn_back(static_cast<uint16_t>(a[x] >> 6 | b[x] << 2), reach.pole);
  }
  return good;
}

void RefinementCoder::encode_near_colours() {
  for (int c = 0; c < 3; ++c) {
    SymbolPlane& plane = near_channel_[c];
    for (size_t y = 0; y < shape_.height; ++y) {
      const auto r = static_cast<ptrdiff_t>(y);
      uint8_t *const z = plane.narrow.row(r), *const tokens = plane.tokens.row(r);
      const uint32_t *const exact = exact_colours_.data() + y * shape_.width, *const known = known_colours_.data() +
                                                                                             y * shape_.width;
      for (size_t x = 0; x < shape_.width; ++x) {
        const int off = static_cast<int>(exact[x] >> kShifts[c] & 255) - static_cast<int>(known[x] >> kShifts[c] & 255);
        z[x] = static_cast<uint8_t>(fold(off));
        tokens[x] = static_cast<uint8_t>(token_of(z[x]));
      }
      finish_tokens(plane, shape_, y);
    }
  }
}

void RefinementCoder::begin_near_colours() {
  for (int c = 0; c < 3; ++c) {
    near_channel_[c].reset(shape_, false);
    if (c > 0) near_channel_[c].other = &near_channel_[c - 1].tokens;
  }
}

void RefinementCoder::encode_colours(const Reach& reach, BitSink& bits) {
  if (reach.colour == 0) return;
  begin_near_colours();
  encode_near_colours();
  double near_bits = 0, other_bits = 0;
  for (const SymbolPlane& plane : near_channel_) near_bits += rough_bits(plane, shape_);
  size_t first = 0;
  while (known_depth_[first] == 0) ++first;
  RoomAxes about;
  const bool has_axes = has_geometry_ && axes_of(geometry_, about);
  colours_.encode(shape_, {exact_colours_.data(), shape_.width}, exact_colours_[first], depth_,
                  {.axes = has_axes ? &about : nullptr}, 0);
  for (size_t i = 0; i < colours_.planes(); ++i) other_bits += rough_bits(colours_.symbols(i), shape_);
  near_colours_ = near_bits <= other_bits + static_cast<double>(colours_.header_bits()) / 4;
  bits.put(near_colours_, 1);
  const size_t count = near_colours_ ? 3 : colours_.planes();
  if (!near_colours_) {
    bits.put(colours_.mode, 2);
    if (colours_.mode == ColourPlanes::kPlain) bits.put(exact_colours_[first], 24);
    colours_.put_header(bits);
  }
  for (size_t i = 0; i < count; ++i) add_plane(near_colours_ ? near_channel_[i] : colours_.symbols(i));
  end_group(bits);
}

bool RefinementCoder::decode_colours(const Reach& reach, WordSource& source) {
  if (reach.colour == 0) return true;
  near_colours_ = reader_.source.take(1) != 0;
  uint32_t base = 0;
  if (near_colours_) {
    begin_near_colours();
  } else {
    colours_.mode = static_cast<ColourPlanes::Mode>(reader_.source.take(2));
    if (colours_.mode == ColourPlanes::kPlain) base = reader_.source.take(24);
    if (!colours_.decode_header(shape_, depth_, 0, reader_)) return false;
  }
  const size_t count = near_colours_ ? 3 : colours_.planes();
  const auto plane = [&](size_t i) -> SymbolPlane& { return near_colours_ ? near_channel_[i] : colours_.symbols(i); };
  for (size_t i = 0; i < count; ++i)
    if (!decoders_[3 + i].prepare(plane(i), reader_)) return false;
  std::fill_n(exact_colours_.begin(), shape_.width * shape_.height, base);
  bool good = true;
  for (size_t y = 0; y < shape_.height; ++y) {
    for (size_t i = 0; i < count; ++i)
      if (!decoders_[3 + i].get_row(plane(i), shape_, y, source)) return false;
    uint32_t* const out = exact_colours_.data() + y * shape_.width;
    if (!near_colours_) {
      if (count != 0) colours_.decode_row(shape_, y, out);
      continue;
    }
    const uint32_t* const known = known_colours_.data() + y * shape_.width;
    for (size_t c = 0; c < 3; ++c) {
      const uint8_t* const z = near_channel_[c].narrow.row(static_cast<ptrdiff_t>(y));
      for (size_t x = 0; x < shape_.width; ++x) {
        const int value = static_cast<int>(known[x] >> kShifts[c] & 255) + ((z[x] >> 1) ^ -(z[x] & 1));
        good &= !shape_.at(x, y) || (value >= 0 && value <= 255);
        out[x] |= static_cast<uint32_t>(value & 255) << kShifts[c];
      }
    }
  }
  return good;
}

void RefinementCoder::put(std::vector<uint8_t>& out, const image::DepthImage& exact, const image::DepthImage& known,
                          const TileRect& rect, const Mask* mask, const Reach& reach) {
  begin(rect, mask);
  load_known(known, rect);
  load_exact(exact, rect);
  planes_.clear(), group_ends_.clear();
  writer_.start(kGeometryBits + 2 * GuidedPlane::kMostWeightBits + colours_.most_header_bits() +
                6 * PlaneEncoder::kMostBits + 64);
  encode_depth(reach, writer_.sink);
  encode_normals(reach, writer_.sink);
  encode_colours(reach, writer_.sink);
  const auto header = writer_.bytes();
  put_varint(out, static_cast<uint32_t>(header.size()));
  out.insert(out.end(), header.begin(), header.end());
  put_words(out);
}

// Planes of a group are coded row by row.
void RefinementCoder::add_plane(SymbolPlane& plane) { planes_.push_back(&plane); }

void RefinementCoder::end_group(BitSink& bits) {
  for (size_t i = group_ends_.empty() ? 0 : group_ends_.back(); i < planes_.size(); ++i)
    encoders_[i].prepare(*planes_[i], shape_, bits);
  group_ends_.push_back(planes_.size());
}

// Symbols in the reverse of the order in which they are decoded.
void RefinementCoder::put_words(std::vector<uint8_t>& out) {
  const size_t most = shape_.total * planes_.size() * 6 + 256;
  if (words_.size() < most) words_.resize(most);
  States states;
  states.reset(shape_);
  uint8_t* at = words_.data();
  for (size_t g = group_ends_.size(); g-- > 0;)
    for (size_t y = shape_.height; y-- > 0;)
      for (size_t i = group_ends_[g], begin = g == 0 ? 0 : group_ends_[g - 1]; i-- > begin;)
        at = encoders_[i].put_row(*planes_[i], shape_, y, states, at);
  const auto bytes = static_cast<size_t>(at - words_.data());
  const size_t lanes = states.stored(shape_, bytes != 0);
  put_varint(out, static_cast<uint32_t>(bytes / 2));
  out.push_back(static_cast<uint8_t>(lanes));
  const size_t to = out.size();
  out.resize(to + bytes + 4 * lanes);
  if (bytes != 0) std::memcpy(out.data() + to, words_.data(), bytes);
  if (lanes != 0) states.put(shape_, out.data() + to + bytes);
}

bool RefinementCoder::get(Reader& in, image::DepthImage& image, const TileRect& rect, const Mask* mask,
                          const Reach& reach) {
  begin(rect, mask);
  load_known(image, rect);
  const auto header_bytes = in.varint();
  const auto header = header_bytes ? in.bytes(*header_bytes) : std::nullopt;
  const auto words = in.varint();
  const auto lanes = in.u8();
  if (!header || !lanes) return false;
  // Kernels read beyond the words: states follow them.
  WordSource source;
  source.states.reset(shape_);
  if (*lanes != source.states.stored(shape_, *words != 0 || *lanes != 0)) return false;
  if (*words > in.left() / 2) return false;
  const auto bytes = in.bytes(size_t{*words} * 2 + size_t{*lanes} * 4);
  if (!bytes) return false;
  source.start(bytes->first(bytes->size() - size_t{*lanes} * 4), size_t{*lanes} * 4, header->data());
  source.begin = source.end - size_t{*words} * 2;
  if (!source.states.get(bytes->last(size_t{*lanes} * 4))) return false;
  reader_.start(*header, kUnchecked);
  if (!decode_depth(reach, source) || !decode_normals(reach, source) || !decode_colours(reach, source)) return false;
  if (!reader_.finished() || source.end != source.begin) return false;
  for (size_t y = 0; y < shape_.height; ++y) {
    const size_t row = y * shape_.width, to = rect.index(0, static_cast<int>(y));
    const uint32_t* const depth = depth_.depth.row(static_cast<ptrdiff_t>(y));
    for (size_t x = 0; x < shape_.width; ++x) {
      if (!shape_.at(x, y)) continue;
      image.depth[to + x] = depth[x];
      if (reach.normal != 0) image.normal[to + x] = exact_normals_[row + x];
      if (reach.colour != 0) image.colour[to + x] = exact_colours_[row + x];
    }
  }
  return source.states.at_rest();
}

}  // namespace telesplat::codec::detail
