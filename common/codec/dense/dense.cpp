#include "common/codec/dense/dense.h"

#include <algorithm>

namespace telesplat::codec::detail {
namespace {

constexpr size_t kUnchecked = 1024;  // bits of a header read between two checks of its end
constexpr uint8_t kMoved = 4;        // flag in the byte of the colour mode: states follow the words

template <class T>
PixelRows<T> rows_of(const std::vector<T>& plane, const TileRect& rect) {
  return {plane.data() + rect.first, rect.stride};
}

}  // namespace

SymbolPlane& DenseCoder::plane(size_t i) {
  return i == 0 ? depth_.symbols : i < 3 ? normals_.plane[i - 1].symbols : colours_.symbols(i - 3);
}

// Returns the number of planes of the parts before `part`.
size_t DenseCoder::planes_until(size_t part) const {
  return part == 0 ? 0 : part == 1 ? 1 : part == 2 ? 3 : 3 + colours_.planes();
}

// Appends a part's header as a block of its own: the writer's bits, and the tables of the part's planes.
void DenseCoder::put_header(std::vector<uint8_t>& out, size_t part) {
  for (size_t i = planes_until(part); i < planes_until(part + 1); ++i)
    encoders_[i].prepare(plane(i), shape_, writer_.sink);
  const auto bytes = writer_.bytes();
  put_varint(out, static_cast<uint32_t>(bytes.size()));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void DenseCoder::put(std::vector<uint8_t>& out, const image::DepthImage& image, const DenseTile& tile,
                     const RoomAxes* axes) {
  const auto& [rect, mask, base, bounds] = tile;
  shape_.reset(static_cast<size_t>(rect.width), static_cast<size_t>(rect.height), mask);
  depth_.reset(shape_, base.depth);
  normals_.reset(shape_, bounds.normal);
  for (size_t y = 0; y < shape_.height; ++y)
    std::copy_n(image.depth.data() + rect.index(0, static_cast<int>(y)), shape_.width,
                depth_.depth.row(static_cast<ptrdiff_t>(y)));
  const PixelRows<uint32_t> colours = rows_of(image.colour, rect);
  const bool one_colour = bounds.normal != 0 && has_one_colour(shape_, colours, base.colour);
  std::vector<uint8_t> headers;
  if (bounds.depth != nullptr) depth_.to_indices(shape_, *bounds.depth);
  depth_.encode(shape_, bounds.depth != nullptr);
  writer_.start(DepthPlane::kWayBits + PlaneEncoder::kMostBits);
  writer_.sink.put(depth_.way, DepthPlane::kWayBits);
  put_header(headers, 0);
  if (bounds.depth != nullptr) depth_.to_codes(shape_, *bounds.depth);
  depth_.extend(shape_);
  writer_.start(NormalPlanes::kMostBits + 2 * PlaneEncoder::kMostBits);
  normals_.encode(shape_, rows_of(image.normal, rect), depth_, base.normal, one_colour, axes);
  normals_.put_header(writer_.sink);
  put_header(headers, 1);
  colours_.encode(shape_, colours, base.colour, depth_, axes, bounds.colour);
  writer_.start(ColourPlanes::kMostHeaderBits + 3 * PlaneEncoder::kMostBits);
  colours_.put_header(writer_.sink);
  put_header(headers, 2);
  const size_t mode = out.size();
  out.push_back(colours_.mode);
  out.insert(out.end(), headers.begin(), headers.end());
  if (put_words(out)) out[mode] |= kMoved;
}

// Puts symbols in the reverse of the order of decoding. Returns true if states follow.
bool DenseCoder::put_words(std::vector<uint8_t>& out) {
  const size_t symbols = shape_.total * planes_until(kPartCount);
  words_.resize(std::max(words_.size(), symbols * kMostSymbolBytes + 2));
  SymbolEncoder coder;
  coder.start(symbols, words_.data());
  size_t ends[kPartCount + 1] = {};
  for (size_t part = kPartCount; part-- > 0;) {
    for (size_t y = shape_.height; y-- > 0;)
      for (size_t i = planes_until(part + 1); i-- > planes_until(part);)
        encoders_[i].put_row(plane(i), shape_, y, coder);
    ends[part] = static_cast<size_t>(coder.end() - words_.data());
  }
  for (size_t part = 0; part < kPartCount; ++part)
    put_varint(out, static_cast<uint32_t>(ends[part] - ends[part + 1]) / 2);
  out.insert(out.end(), words_.data(), coder.end());
  if (coder.at_rest()) return false;
  uint8_t states[kStateBytes];
  coder.put_states(states);
  out.insert(out.end(), states, states + kStateBytes);
  return true;
}

std::optional<DenseCoder::Parts> DenseCoder::get_parts(Reader& in) {
  Parts parts;
  const auto mode = in.u8();
  if (!mode || *mode > (ColourPlanes::kChannels | kMoved) || (*mode & ~kMoved) > ColourPlanes::kChannels)
    return std::nullopt;
  parts.colour_mode = static_cast<ColourPlanes::Mode>(*mode & ~kMoved);
  uint64_t words = 0;
  for (auto& header : parts.headers) {
    const auto size = in.varint();
    const auto bytes = size ? in.bytes(*size) : std::nullopt;
    if (!bytes) return std::nullopt;
    header = *bytes;
  }
  for (size_t& size : parts.word_bytes) {
    const auto count = in.varint();
    if (!count) return std::nullopt;
    size = size_t{*count} * 2, words += size;
  }
  if (words > in.left()) return std::nullopt;
  const auto bytes = in.bytes(words), states = in.bytes((*mode & kMoved) != 0 ? kStateBytes : 0);
  if (!states) return std::nullopt;
  parts.words = *bytes, parts.states = *states;
  return parts;
}

bool DenseCoder::get(Reader& in, image::DepthImage& image, const DenseTile& tile) {
  const auto& [rect, mask, base, bounds] = tile;
  shape_.reset(static_cast<size_t>(rect.width), static_cast<size_t>(rect.height), mask);
  const auto parts = get_parts(in);
  if (!parts || !source_.start(parts->states.empty() ? nullptr : parts->states.data())) return false;
  source_.end = parts->words.data() + parts->words.size();
  if (!get_depth(*parts, image, rect, base, bounds.depth)) return false;
  begin_part(*parts, 1);
  normals_.reset(shape_, bounds.normal);
  if (!normals_.decode_header(shape_, depth_, base.normal, reader_) || !get_symbols(1)) return false;
  begin_part(*parts, 2);
  colours_.mode = parts->colour_mode;
  if (!colours_.decode_header(shape_, base.colour, depth_, bounds.colour, reader_) || !get_symbols(2)) return false;
  if (!source_.at_rest()) return false;
  get_values(image, rect);
  return true;
}

void DenseCoder::begin_part(const Parts& parts, size_t part) {
  reader_.start(parts.headers[part], kUnchecked);
  source_.begin = source_.end - parts.word_bytes[part];
}

bool DenseCoder::get_depth(const Parts& parts, image::DepthImage& image, const TileRect& rect, const Pixel& base,
                           const DepthLattice* lattice) {
  begin_part(parts, 0);
  depth_.reset(shape_, base.depth);
  if (!depth_.begin_decoding(shape_, reader_)) return false;
  if (!decoders_[0].prepare(depth_.symbols, reader_) || !reader_.finished()) return false;
  const uint32_t most = lattice != nullptr ? lattice->last() : image::kMaxDepthCode;
  for (size_t y = 0; y < shape_.height; ++y)
    if (!decoders_[0].get_row(depth_.symbols, shape_, y, source_) || !depth_.decode_row(shape_, y, most)) return false;
  if (lattice != nullptr) depth_.to_codes(shape_, *lattice);
  for (size_t y = 0; y < shape_.height; ++y) {
    uint32_t* const row = image.depth.data() + rect.index(0, static_cast<int>(y));
    std::copy_n(depth_.depth.row(static_cast<ptrdiff_t>(y)), shape_.width, row);
    clear_gaps(y, row);
  }
  depth_.extend(shape_);
  return source_.end == source_.begin;
}

// Takes all symbols of a part, row by row; get_values() makes values of them later.
bool DenseCoder::get_symbols(size_t part) {
  const size_t begin = planes_until(part), end = planes_until(part + 1);
  for (size_t i = begin; i < end; ++i)
    if (!decoders_[i].prepare(plane(i), reader_)) return false;
  if (!reader_.finished()) return false;
  for (size_t y = 0; y < shape_.height; ++y)
    for (size_t i = begin; i < end; ++i)
      if (!decoders_[i].get_row(plane(i), shape_, y, source_)) return false;
  return source_.end == source_.begin;
}

// Makes normals and colours from their symbols.
void DenseCoder::get_values(image::DepthImage& image, const TileRect& rect) {
  GuidedPlane &a = normals_.plane[0], &b = normals_.plane[1];
  for (size_t y = 0; y < shape_.height; ++y) {
    uint16_t* const normals = image.normal.data() + rect.index(0, static_cast<int>(y));
    uint32_t* const colours = image.colour.data() + rect.index(0, static_cast<int>(y));
    a.decode_sums(shape_, y, nullptr), b.decode_sums(shape_, y, &a);
    decode_values(a, b, shape_, y);
    normals_.get_codes(shape_, y, normals);
    colours_.decode_row(shape_, y, colours);
    clear_gaps(y, normals), clear_gaps(y, colours);
  }
}

template <class T>
void DenseCoder::clear_gaps(size_t y, T* row) const {
  if (!shape_.full(y))
    shape_.for_each_gap(y, [&](size_t begin, size_t end) { std::fill(row + begin, row + end, T{0}); });
}

bool DenseCoder::skip(Reader& in, StreamInfo& info) {
  const size_t before = in.left();
  const auto parts = get_parts(in);
  if (!parts) return false;
  const size_t normals = parts->headers[1].size() + parts->word_bytes[1],
               colours = parts->headers[2].size() + parts->word_bytes[2];
  info.normal_bytes += normals, info.colour_bytes += colours;
  info.depth_bytes += before - in.left() - normals - colours;  // with the shared bytes: states, sizes
  return true;
}

}  // namespace telesplat::codec::detail
