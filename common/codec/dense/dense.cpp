#include "common/codec/dense/dense.h"

#include <algorithm>
#include <cstring>

namespace telesplat::codec::detail {
namespace {

constexpr int kNarrow = 16;          // pixels: tiles that are not as wide are coded as one row
constexpr size_t kUnchecked = 1024;  // bits of a header between two looks at its end

// A header's bits as a block of their own.
void put_bits(std::vector<uint8_t>& out, const BitWriter& writer) {
  const auto bytes = writer.bytes();
  put_varint(out, static_cast<uint32_t>(bytes.size()));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::optional<std::span<const uint8_t>> get_bits(Reader& in) {
  const auto size = in.varint();
  return size ? in.bytes(*size) : std::nullopt;
}

// f(flat index of the first pixel, row of the shape, column, count) for the rows of `rect`.
template <class F>
void for_each_segment(const TileRect& rect, const TileShape& shape, F f) {
  for (int y = 0; y < rect.height; ++y) {
    const size_t flat = static_cast<size_t>(y) * static_cast<size_t>(rect.width);
    f(rect.index(0, y), flat / shape.width, flat % shape.width, static_cast<size_t>(rect.width));
  }
}

// As masks have rows of whole words, one of another width is made anew.
void join_rows(const Mask& mask, Mask& line) {
  line.reset(mask.width() * mask.height(), 1);
  for (int y = 0; y < mask.height(); ++y)
    for_each_set(mask.row(y), mask.words_per_row(),
                 [&](size_t x) { line.set(y * mask.width() + static_cast<int>(x), 0); });
}

}  // namespace

void DenseCoder::begin(const TileRect& rect, const Mask* mask) {
  if (rect.width >= kNarrow) {
    shape_.reset(static_cast<size_t>(rect.width), static_cast<size_t>(rect.height), mask);
  } else {
    if (mask != nullptr) join_rows(*mask, line_mask_);
    shape_.reset(static_cast<size_t>(rect.width) * static_cast<size_t>(rect.height), 1,
                 mask != nullptr ? &line_mask_ : nullptr);
  }
}

void DenseCoder::load_depth(const image::DepthImage& image, const TileRect& rect) {
  for_each_segment(rect, shape_, [&](size_t from, size_t row, size_t column, size_t count) {
    std::copy_n(image.depth.data() + from, count, depth_.depth.row(static_cast<ptrdiff_t>(row)) + column);
  });
}

// Of the image itself, unless rows were joined.
template <class T>
PixelRows<T> DenseCoder::rows_of(const std::vector<T>& plane, const TileRect& rect, std::vector<T>& copy) const {
  if (rect.width >= kNarrow) return {plane.data() + rect.first, rect.stride};
  if (copy.size() < shape_.width) copy.resize(shape_.width);
  for_each_segment(rect, shape_, [&](size_t from, size_t, size_t column, size_t count) {
    std::copy_n(plane.data() + from, count, copy.data() + column);
  });
  return {copy.data(), shape_.width};
}

void DenseCoder::put(std::vector<uint8_t>& out, const image::DepthImage& image, const TileRect& rect, const Mask* mask,
                     const Pixel& base, const TileBounds& bounds, const RoomAxes* axes) {
  begin(rect, mask);
  depth_.reset(shape_, base.depth);
  normals_.reset(shape_, bounds.normal);
  load_depth(image, rect);
  const PixelRows<uint32_t> colours = rows_of(image.colour, rect, colour_rows_);
  if (bounds.depth != nullptr) depth_.to_indices(shape_, *bounds.depth);
  std::vector<uint8_t> headers;
  writer_.start(PlaneEncoder::kMostBits);
  depth_.encode(shape_, base.depth, bounds.depth != nullptr);
  depth_.put_way(writer_.sink, bounds.depth != nullptr);
  encoders_[0].prepare(depth_.symbols, shape_, writer_.sink);
  put_bits(headers, writer_);
  if (bounds.depth != nullptr) depth_.to_codes(shape_, *bounds.depth);
  depth_.extend(shape_);

  writer_.start(NormalPlanes::kMostBits + 2 * PlaneEncoder::kMostBits);
  normals_.encode(shape_, rows_of(image.normal, rect, normal_rows_), depth_, base.normal,
                  bounds.normal != 0 && of_one_colour(shape_, colours, base.colour),
                  rect.width >= kNarrow ? axes : nullptr, writer_.sink);
  for (size_t i = 0; i < 2; ++i) encoders_[1 + i].prepare(normals_.plane[i].symbols, shape_, writer_.sink);
  put_bits(headers, writer_);

  // Rows that were joined are no rows of the picture.
  KnownAxes known{.axes = rect.width >= kNarrow ? axes : nullptr, .exact = true};
  RoomAxes about;
  if (known.axes == nullptr && normals_.geometry() != nullptr && axes_of(*normals_.geometry(), about))
    known = {.axes = &about, .exact = false};
  colours_.encode(shape_, colours, base.colour, depth_, known, bounds.colour);
  writer_.start(colours_.most_header_bits() + 3 * PlaneEncoder::kMostBits);
  colours_.put_header(writer_.sink);
  for (size_t i = 0; i < colours_.planes(); ++i) encoders_[3 + i].prepare(colours_.symbols(i), shape_, writer_.sink);
  put_bits(headers, writer_);
  out.push_back(colours_.mode);
  out.insert(out.end(), headers.begin(), headers.end());
  put_words(out);
}

// Symbols in the reverse of the order in which they are decoded.
void DenseCoder::put_words(std::vector<uint8_t>& out) {
  const size_t planes = 3 + colours_.planes();
  if (words_.size() < shape_.total * planes * 6 + 256) words_.resize(shape_.total * planes * 6 + 256);
  States states;
  states.reset(shape_);
  uint8_t* at = words_.data();
  const uint8_t* ends[kPartCount];
  for (size_t y = shape_.height; y-- > 0;)
    for (size_t i = colours_.planes(); i-- > 0;)
      at = encoders_[3 + i].put_row(colours_.symbols(i), shape_, y, states, at);
  ends[2] = at;
  for (size_t y = shape_.height; y-- > 0;)
    for (size_t i = 2; i-- > 0;) at = encoders_[1 + i].put_row(normals_.plane[i].symbols, shape_, y, states, at);
  ends[1] = at;
  for (size_t y = shape_.height; y-- > 0;) at = encoders_[0].put_row(depth_.symbols, shape_, y, states, at);
  ends[0] = at;
  put_varint(out, static_cast<uint32_t>(ends[0] - ends[1]) / 2);
  put_varint(out, static_cast<uint32_t>(ends[1] - ends[2]) / 2);
  put_varint(out, static_cast<uint32_t>(ends[2] - words_.data()) / 2);
  // Where there are words states follow them: kernels read beyond a word's end.
  const size_t lanes = states.stored(shape_, at != words_.data());
  out.push_back(static_cast<uint8_t>(lanes));
  const size_t end = out.size();
  out.resize(end + static_cast<size_t>(at - words_.data()) + 4 * lanes);
  std::memcpy(out.data() + end, words_.data(), static_cast<size_t>(at - words_.data()));
  if (lanes != 0) states.put(shape_, out.data() + out.size() - 4 * lanes);
}

std::optional<DenseCoder::Parts> DenseCoder::get_parts(Reader& in) {
  Parts parts;
  const auto mode = in.u8();
  if (!mode || *mode > ColourPlanes::kDifferences) return std::nullopt;
  parts.colour_mode = static_cast<ColourPlanes::Mode>(*mode);
  uint64_t words = 0;
  for (auto& header : parts.headers) {
    const auto bytes = get_bits(in);
    if (!bytes) return std::nullopt;
    header = *bytes;
  }
  for (size_t& size : parts.word_bytes) {
    const auto count = in.varint();
    if (!count) return std::nullopt;
    size = size_t{*count} * 2, words += size;
  }
  const auto lanes = in.u8();
  if (!lanes || *lanes > kMostStates) return std::nullopt;
  if (words > in.left()) return std::nullopt;
  const auto bytes = in.bytes(words + size_t{*lanes} * 4);
  if (!bytes) return std::nullopt;
  parts.words = bytes->first(words), parts.states = bytes->subspan(words);
  return parts;
}

bool DenseCoder::get(Reader& in, image::DepthImage& image, const TileRect& rect, const Mask* mask, const Pixel& base,
                     const TileBounds& bounds) {
  begin(rect, mask);
  const auto parts = get_parts(in);
  if (!parts) return false;
  States& states = source_.states;
  states.reset(shape_);
  if (parts->states.size() != 4 * states.stored(shape_, !parts->words.empty() || !parts->states.empty())) return false;
  if (!states.get(parts->states)) return false;
  source_.start(parts->words, parts->states.size(), parts->headers[0].data());
  if (!get_depth(*parts, image, rect, base, bounds.depth) || !get_normals(*parts, base, bounds.normal) ||
      !get_colours(*parts, bounds.colour) || !states.at_rest())
    return false;
  get_values(image, rect, base);
  return true;
}

void DenseCoder::begin_part(const Parts& parts, size_t part) {
  reader_.start(parts.headers[part], kUnchecked);
  source_.begin = source_.end - parts.word_bytes[part];
}

// Where a row of values may be made for store(): the image itself, unless rows were joined.
template <class T>
T* DenseCoder::row_for(std::vector<T>& out, const TileRect& rect, size_t y, std::vector<T>& scratch) const {
  if (rect.width >= kNarrow) return out.data() + rect.index(0, static_cast<int>(y));
  if (scratch.size() < shape_.width) scratch.resize(shape_.width);
  return scratch.data();
}

// row -> image; pixels that are not covered become 0.
template <class T>
void DenseCoder::store(const T* row, size_t y, std::vector<T>& out, const TileRect& rect) const {
  const size_t width = static_cast<size_t>(rect.width);
  for (size_t begin = 0; begin < shape_.width; begin += width) {
    const size_t flat = y * shape_.width + begin;
    T* const to = out.data() + rect.index(0, static_cast<int>(flat / width));
    if (shape_.full(y)) {
      if (to != row + begin) std::copy_n(row + begin, width, to);
      continue;
    }
    const uint8_t* const cover = shape_.cover(y) + begin;
    if constexpr (sizeof(T) == 4)
      kernels().cut_wide(cover, row + begin, width, to);
    else
      kernels().cut_short(cover, row + begin, width, to);
  }
}

bool DenseCoder::get_depth(const Parts& parts, image::DepthImage& image, const TileRect& rect, const Pixel& base,
                           const DepthLattice* lattice) {
  begin_part(parts, 0);
  depth_.reset(shape_, base.depth);
  if (!depth_.begin_decoding(shape_, lattice != nullptr, reader_)) return false;
  if (!decoders_[0].prepare(depth_.symbols, reader_) || !reader_.finished()) return false;
  const uint32_t most = lattice != nullptr ? lattice->last() : image::kMaxDepthCode;
  for (size_t y = 0; y < shape_.height; ++y)
    if (!decoders_[0].get_row(depth_.symbols, shape_, y, source_) || !depth_.decode_row(shape_, y, most)) return false;
  if (lattice != nullptr) depth_.to_codes(shape_, *lattice);
  for (size_t y = 0; y < shape_.height; ++y) store(depth_.depth.row(static_cast<ptrdiff_t>(y)), y, image.depth, rect);
  depth_.extend(shape_);
  return source_.end == source_.begin;
}

bool DenseCoder::get_normals(const Parts& parts, const Pixel& base, int reach) {
  begin_part(parts, 1);
  normals_.reset(shape_, reach);
  return normals_.decode_header(shape_, depth_, base.normal, reader_) &&
         get_symbols(1, 2, [&](size_t i) { return &normals_.plane[i].symbols; });
}

bool DenseCoder::get_colours(const Parts& parts, int reach) {
  begin_part(parts, 2);
  colours_.mode = parts.colour_mode;
  return colours_.decode_header(shape_, depth_, reach, reader_) &&
         get_symbols(3, colours_.planes(), [&](size_t i) { return &colours_.symbols(i); });
}

// All symbols of a part, row by row; what they stand for is found afterwards.
template <class Planes>
bool DenseCoder::get_symbols(size_t first, size_t count, Planes plane) {
  for (size_t i = 0; i < count; ++i)
    if (!decoders_[first + i].prepare(*plane(i), reader_)) return false;
  if (!reader_.finished()) return false;
  for (size_t y = 0; y < shape_.height; ++y)
    for (size_t i = 0; i < count; ++i)
      if (!decoders_[first + i].get_row(*plane(i), shape_, y, source_)) return false;
  return source_.end == source_.begin;
}

// Normals and colours from their symbols.
void DenseCoder::get_values(image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  GuidedPlane &a = normals_.plane[0], &b = normals_.plane[1];
  for (size_t y = 0; y < shape_.height; ++y) {
    uint16_t* const normals = row_for(image.normal, rect, y, normal_rows_);
    uint32_t* const colours = row_for(image.colour, rect, y, colour_rows_);
    normals_.decode_sums(shape_, y);
    if (colours_.mode == ColourPlanes::kPalette) {
      colours_.index.decode_sums(shape_, y, nullptr);
      decode_values(a, b, colours_.index, shape_, y);
      colours_.get_colours(shape_, y, colours);
    } else {
      decode_values(a, b, shape_, y);
      if (colours_.planes() != 0)
        colours_.decode_row(shape_, y, colours);
      else
        std::fill_n(colours, shape_.width, base.colour);
    }
    normals_.get_codes(shape_, y, normals);
    store(normals, y, image.normal, rect);
    store(colours, y, image.colour, rect);
  }
}

bool DenseCoder::skip(Reader& in, StreamInfo& info) {
  const size_t before = in.left();
  const auto parts = get_parts(in);
  if (!parts) return false;
  const size_t normals = parts->headers[1].size() + parts->word_bytes[1],
               colours = parts->headers[2].size() + parts->word_bytes[2];
  info.normal_bytes += normals, info.colour_bytes += colours;
  info.depth_bytes += before - in.left() - normals - colours;  // with what belongs to all: states, sizes
  return true;
}

}  // namespace telesplat::codec::detail
