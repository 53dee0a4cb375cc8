#include "common/codec/sparse/scatter_coder.h"

#include <algorithm>
#include <bit>
#include <iterator>

namespace telesplat::codec::detail {
namespace {

constexpr size_t kMostPixelBits = 3 * GolombContext::kMostBits;

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

// The same within bounds, by steps of lattices. False where there is no such step.
template <class Code>
bool code_depth(ScatterContexts& contexts, const DepthLattice& lattice, const Guess& guess, uint32_t& depth,
                Magnitudes& out, Code code) {
  const int expected = static_cast<int>(lattice.index(guess.pixel.depth));
  const int residual =
      code(static_cast<int>(lattice.index(depth)) - expected, contexts.depth[guess.expected.depth][guess.distance]);
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

bool is_near(uint32_t a, uint32_t b, int reach) {
  int most = 0;
  for (int c = 0; c < 3; ++c)
    most = std::max(most, std::abs(static_cast<int>(byte_at(a, c)) - static_cast<int>(byte_at(b, c))));
  return most <= reach;
}

// How far blue and red of `colour` are from what is expected of them where green is `green` more than predicted: 0..3.
size_t farness(uint32_t colour, uint32_t predicted, int green) {
  int sum = 0;
  for (const int channel : {kChannels[1], kChannels[2]})
    sum += std::abs(static_cast<int>(byte_at(colour, channel)) -
                    std::clamp(static_cast<int>(byte_at(predicted, channel)) + green, 0, 255));
  return sum == 0 ? 0 : sum < 6 ? 1 : sum < 20 ? 2 : 3;
}

size_t sign_of(int residual) { return residual < 0 ? 0 : residual == 0 ? 1 : 2; }

// What a pixel's colour is predicted to be, and by which models it is coded.
struct ColourGuess {
  uint32_t colour;
  AdaptiveBit* plain;
  SignedModel* green;
};
ColourGuess guess_colour(ScatterContexts& contexts, const Guess& guess, const Ramp* ramp, int height) {
  if (ramp != nullptr)
    if (const Ramp::Said said = ramp->at(height); said.gap != Ramp::kNothing)
      return {said.colour, &contexts.plain_ramp[said.gap], &contexts.ramp[said.gap]};
  return {guess.pixel.colour, &contexts.plain[guess.plain_colour],
          &contexts.colour[0][byte_size(guess.expected.colour)]};
}

// `pixel` has its depth; its colour becomes what is decoded. False where there is no such step.
template <class Coder>
bool code_colour(ScatterContexts& contexts, int reach, const Guess& guess, Ramp* ramp, int x, int y, Pixel& pixel,
                 Magnitudes& out, const Coder& coder) {
  const int height = ramp != nullptr ? ramp->height(x, y, pixel.depth) : 0;
  const auto [predicted, plain, model_of_green] = guess_colour(contexts, guess, ramp, height);
  const uint32_t colour = pixel.colour;
  uint32_t result = predicted;
  bool good = true;
  if (coder(!is_near(colour, predicted, reach), *plain) != 0) {
    const ColourLattice lattice(reach);
    const auto index = [&](uint32_t word, int c) {
      return lattice.index(static_cast<int>(byte_at(word, kChannels[c])));
    };
    result = 0;
    int residual[3];
    const auto code_channel = [&, base = predicted](int c, SignedModel& model, size_t sign) {
      const int expected = index(base, c) + (c == 0 ? 0 : residual[0]), most = lattice.index(255);
      residual[c] = model.code(coder, index(colour, c) - expected, sign);
      const int step = expected + residual[c];
      good &= step >= 0 && step <= most;
      result |= static_cast<uint32_t>(lattice.value(std::clamp(step, 0, most))) << 8 * kChannels[c];
    };
    code_channel(0, *model_of_green, 1);
    const auto green = static_cast<int>(byte_at(result, kChannels[0]));
    const int32_t last = contexts.last_of_green[static_cast<size_t>(green)];
    const auto known = static_cast<uint32_t>(last);
    if (last >= 0 &&
        coder(!is_near(colour, known, reach),
              contexts.again[farness(known, predicted, green - static_cast<int>(byte_at(predicted, kChannels[0])))]) ==
            0) {
      result = known;
      for (int c = 1; c < 3; ++c) residual[c] = index(known, c) - index(predicted, c) - residual[0];
    } else {
      for (int c = 1; c < 3; ++c)
        code_channel(c, contexts.colour[c][byte_size(size_of(residual[c - 1]))], sign_of(residual[c - 1]));
    }
    out.colour = 1;
    for (const int r : residual) out.colour = std::max(out.colour, static_cast<uint8_t>(byte_size(size_of(r))));
  }
  contexts.last_of_green[byte_at(result, kChannels[0])] = static_cast<int32_t>(result);
  if (ramp != nullptr) ramp->add(height, result);
  pixel.colour = result;
  return good;
}

}  // namespace

void ScatterContexts::start() {
  for (uint32_t size = 0; size <= kDepthBits; ++size)
    for (GolombContext& context : depth[size]) context.start(1u << size);
  for (auto& component : normal)
    for (uint32_t size = 0; size <= kByteBits; ++size)
      for (GolombContext& context : component[size]) context.start(1u << size);
  std::fill(std::begin(plain), std::end(plain), AdaptiveBit());
  std::fill(std::begin(plain_ramp), std::end(plain_ramp), AdaptiveBit());
  std::fill(std::begin(ramp), std::end(ramp), SignedModel());
  std::fill(std::begin(again), std::end(again), AdaptiveBit());
  for (auto& channel : colour) std::fill(std::begin(channel), std::end(channel), SignedModel());
  last_of_green.fill(-1);
}

void ScatterEncoder::start(size_t count, const TileBounds& bounds, Ramp* ramp) {
  contexts_.start();
  bounds_ = &bounds;
  ramp_ = ramp;
  colours_.clear();
  colour_coder_ = RangeEncoder(colours_);
  bits_.start(count * kMostPixelBits);
}

Magnitudes ScatterEncoder::put(int x, int y, Pixel& pixel, const Guess& guess) {
  Magnitudes out;
  BitSink bits = bits_.sink;
  const auto code = [&](int residual, GolombContext& context) { return context.put(residual, bits), residual; };
  if (bounds_->depth != nullptr) {
    code_depth(contexts_, *bounds_->depth, guess, pixel.depth, out, code);
  } else {
    const int depth = static_cast<int>(pixel.depth) - static_cast<int>(guess.pixel.depth);
    code(depth, contexts_.depth[guess.expected.depth][guess.distance]);
    out.depth = static_cast<uint8_t>(size_of(depth));
  }
  if (bounds_->normal != 0)
    code_normal(contexts_, NormalLattice(bounds_->normal), guess, pixel.normal, out, code);
  else
    code_normal(contexts_, guess, pixel.normal, out, code);
  bits_.sink = bits;
  code_colour(contexts_, bounds_->colour, guess, ramp_, x, y, pixel, out, BitCoder{colour_coder_});
  return out;
}

void ScatterEncoder::finish(std::vector<uint8_t>& out) {
  colour_coder_.finish();
  put_stored_block(out, colours_);
  put_stored_block(out, bits_.bytes());
}

bool ScatterDecoder::start(Reader& in, const TileBounds& bounds, Ramp* ramp) {
  contexts_.start();
  bounds_ = &bounds;
  ramp_ = ramp;
  const auto colours = get_stored_block(in), bits = get_stored_block(in);
  if (!colours || !bits) return false;
  colour_coder_ = RangeDecoder(*colours);
  bits_.start(*bits, 2 * kMostPixelBits);
  return true;
}

std::optional<Pixel> ScatterDecoder::get(int x, int y, const Guess& guess, Magnitudes& out) {
  Pixel pixel;
  out = {};
  BitSource bits = bits_.source;
  const auto code = [&](int, GolombContext& context) { return context.get(bits); };
  bool good = true;
  if (bounds_->depth != nullptr) {
    good = code_depth(contexts_, *bounds_->depth, guess, pixel.depth, out, code);
  } else {
    const int residual = code(0, contexts_.depth[guess.expected.depth][guess.distance]);
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
  good &= code_colour(contexts_, bounds_->colour, guess, ramp_, x, y, pixel, out, BitDecoder{colour_coder_});
  bits_.source = bits;
  if (bits_.overrun() || !good) return std::nullopt;
  return pixel;
}

}  // namespace telesplat::codec::detail
