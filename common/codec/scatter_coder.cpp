#include "common/codec/scatter_coder.h"

#include <algorithm>
#include <bit>

namespace telesplat::codec::detail {
namespace {

constexpr size_t kMostPixelBits = 6 * GolombContext::kMostBits;

unsigned size_of(int residual) {
  return static_cast<unsigned>(std::bit_width(static_cast<unsigned>(std::abs(residual))));
}
int signed_byte(uint32_t difference) { return static_cast<int8_t>(static_cast<uint8_t>(difference)); }
uint32_t byte_at(uint32_t word, int i) { return word >> 8 * i & 255; }

// What is coded of a normal's second component depends on the size of its first.
unsigned beside(unsigned size) { return std::min(size, 4u); }
unsigned byte_size(unsigned size) { return std::min<unsigned>(size, ScatterContexts::kByteBits); }

// Green first, the others less what green had, as places of bytes.
constexpr int kChannels[3] = {1, 0, 2};

// Both walk a pixel's residuals alike: code(residual, context) puts the residual, or returns the one that it gets.
template <class Code>
void code_normal(ScatterContexts& contexts, const Guess& guess, uint16_t& normal, Magnitudes& out, Code code) {
  unsigned other = 0;
  uint32_t result = 0;
  for (int c = 0; c < 2; ++c) {
    const uint32_t expected = byte_at(guess.pixel.normal, c);
    auto& context = contexts.normal[c][byte_size(guess.expected.normal[c])][beside(other)];
    const int residual = code(signed_byte(byte_at(normal, c) - expected), context);
    result |= ((expected + static_cast<uint32_t>(residual)) & 255) << 8 * c;
    other = byte_size(size_of(residual));
    out.normal[c] = static_cast<uint8_t>(other);
  }
  normal = static_cast<uint16_t>(result);
}

template <class Code>
void code_colour(ScatterContexts& contexts, const Guess& guess, uint32_t& colour, Magnitudes& out, Code code) {
  unsigned before = byte_size(guess.expected.colour);
  uint32_t result = 0, green = 0;
  out.colour = 1;
  for (int c = 0; c < 3; ++c) {
    const uint32_t expected = byte_at(guess.pixel.colour, kChannels[c]) + green;
    const int residual = code(signed_byte(byte_at(colour, kChannels[c]) - expected), contexts.colour[c][before]);
    result |= ((expected + static_cast<uint32_t>(residual)) & 255) << 8 * kChannels[c];
    if (c == 0) green = static_cast<uint32_t>(residual);
    before = byte_size(size_of(residual));
    out.colour = std::max(out.colour, static_cast<uint8_t>(before));
  }
  colour = result;
}

// The same within bounds, by steps of lattices. False where there is no such step.
template <class Code>
bool code_depth(ScatterContexts& contexts, const DepthLattice& lattice, const Guess& guess, uint32_t& depth,
                Magnitudes& out, Code code) {
  const int expected = static_cast<int>(lattice.index(guess.pixel.depth));
  const int residual = code(static_cast<int>(lattice.index(depth)) - expected, contexts.depth[guess.expected.depth]);
  out.depth = static_cast<uint8_t>(std::min<unsigned>(size_of(residual), ScatterContexts::kDepthBits));
  const int index = expected + residual;
  if (index < 1 || index > static_cast<int>(lattice.last())) return false;
  depth = lattice.code(static_cast<uint32_t>(index));
  return true;
}

template <class Code>
bool code_normal(ScatterContexts& contexts, const NormalLattice& lattice, const Guess& guess, uint16_t& normal,
                 Magnitudes& out, Code code) {
  unsigned other = 0;
  int result = 0;
  for (int c = 0; c < 2; ++c) {
    const int expected = lattice.index(std::min(static_cast<int>(byte_at(guess.pixel.normal, c)), 254));
    auto& context = contexts.normal[c][byte_size(guess.expected.normal[c])][beside(other)];
    const int residual = code(lattice.index(static_cast<int>(byte_at(normal, c))) - expected, context);
    const int index = expected + residual;
    if (index < 0 || index > lattice.most()) return false;
    result |= lattice.value(index) << 8 * c;
    other = byte_size(size_of(residual));
    out.normal[c] = static_cast<uint8_t>(other);
  }
  normal = static_cast<uint16_t>(result);
  return true;
}

template <class Code>
bool code_colour(ScatterContexts& contexts, const ColourLattice& lattice, const Guess& guess, uint32_t& colour,
                 Magnitudes& out, Code code) {
  unsigned before = byte_size(guess.expected.colour);
  uint32_t result = 0;
  int green = 0;
  out.colour = 1;
  for (int c = 0; c < 3; ++c) {
    const int expected = lattice.index(static_cast<int>(byte_at(guess.pixel.colour, kChannels[c]))) + green;
    const int residual =
        code(lattice.index(static_cast<int>(byte_at(colour, kChannels[c]))) - expected, contexts.colour[c][before]);
    const int index = expected + residual;
    if (index < 0 || index > lattice.index(255)) return false;
    result |= static_cast<uint32_t>(lattice.value(index)) << 8 * kChannels[c];
    if (c == 0) green = residual;
    before = byte_size(size_of(residual));
    out.colour = std::max(out.colour, static_cast<uint8_t>(before));
  }
  colour = result;
  return true;
}

bool is_near(uint32_t a, uint32_t b, int reach) {
  int most = 0;
  for (int c = 0; c < 3; ++c)
    most = std::max(most, std::abs(static_cast<int>(byte_at(a, c)) - static_cast<int>(byte_at(b, c))));
  return most <= reach;
}

}  // namespace

void ScatterContexts::start() {
  for (uint32_t size = 0; size <= kDepthBits; ++size) depth[size].start(1u << size);
  for (auto& component : normal)
    for (uint32_t size = 0; size <= kByteBits; ++size)
      for (GolombContext& context : component[size]) context.start(1u << size);
  for (auto& channel : colour)
    for (uint32_t size = 0; size <= kByteBits; ++size) channel[size].start(1u << size);
}

void ScatterEncoder::start(size_t count, const TileBounds& bounds) {
  contexts_.start();
  bounds_ = &bounds;
  plain_.assign((count + 7) / 8, 0);
  bits_.start(count * kMostPixelBits);
  done_ = 0;
}

Magnitudes ScatterEncoder::put(Pixel& pixel, const Guess& guess) {
  Magnitudes out;
  BitSink bits = bits_.sink;
  const auto code = [&](int residual, GolombContext& context) { return context.put(residual, bits), residual; };
  if (bounds_->depth != nullptr) {
    code_depth(contexts_, *bounds_->depth, guess, pixel.depth, out, code);
  } else {
    const int depth = static_cast<int>(pixel.depth) - static_cast<int>(guess.pixel.depth);
    code(depth, contexts_.depth[guess.expected.depth]);
    out.depth = static_cast<uint8_t>(size_of(depth));
  }
  if (bounds_->normal != 0)
    code_normal(contexts_, NormalLattice(bounds_->normal), guess, pixel.normal, out, code);
  else
    code_normal(contexts_, guess, pixel.normal, out, code);
  if (is_near(pixel.colour, guess.pixel.colour, bounds_->colour)) {
    plain_[done_ / 8] |= static_cast<uint8_t>(1u << done_ % 8);
    pixel.colour = guess.pixel.colour;
  } else if (bounds_->colour != 0) {
    code_colour(contexts_, ColourLattice(bounds_->colour), guess, pixel.colour, out, code);
  } else {
    code_colour(contexts_, guess, pixel.colour, out, code);
  }
  bits_.sink = bits;
  ++done_;
  return out;
}

void ScatterEncoder::finish(std::vector<uint8_t>& out) {
  put_block(out, plain_);
  put_stored_block(out, bits_.bytes());
}

bool ScatterDecoder::start(Reader& in, size_t count, const TileBounds& bounds) {
  contexts_.start();
  bounds_ = &bounds;
  plain_.resize((count + 7) / 8);
  done_ = 0;
  if (!get_block(in, plain_)) return false;
  const auto bits = get_stored_block(in);
  if (bits) bits_.start(*bits, 2 * kMostPixelBits);
  return bits.has_value();
}

std::optional<Pixel> ScatterDecoder::get(const Guess& guess, Magnitudes& out) {
  Pixel pixel;
  out = {};
  BitSource bits = bits_.source;
  const auto code = [&](int, GolombContext& context) { return context.get(bits); };
  bool good = true;
  if (bounds_->depth != nullptr) {
    good = code_depth(contexts_, *bounds_->depth, guess, pixel.depth, out, code);
  } else {
    const int residual = code(0, contexts_.depth[guess.expected.depth]);
    const int depth = static_cast<int>(guess.pixel.depth) + residual;
    out.depth = static_cast<uint8_t>(std::min<unsigned>(size_of(residual), ScatterContexts::kDepthBits));
    pixel.depth = static_cast<uint32_t>(depth);
    good = depth >= 1 && depth <= static_cast<int>(image::kMaxDepthCode);
  }
  if (!good) return std::nullopt;
  if (bounds_->normal != 0)
    good = code_normal(contexts_, NormalLattice(bounds_->normal), guess, pixel.normal, out, code);
  else
    code_normal(contexts_, guess, pixel.normal, out, code);
  if (plain_[done_ / 8] >> done_ % 8 & 1)
    pixel.colour = guess.pixel.colour;
  else if (bounds_->colour != 0)
    good &= code_colour(contexts_, ColourLattice(bounds_->colour), guess, pixel.colour, out, code);
  else
    code_colour(contexts_, guess, pixel.colour, out, code);
  ++done_;
  bits_.source = bits;
  if (bits_.overrun() || !good) return std::nullopt;
  return pixel;
}

}  // namespace telesplat::codec::detail
