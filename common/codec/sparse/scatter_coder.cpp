#include "common/codec/sparse/scatter_coder.h"

#include <algorithm>
#include <bit>
#include <iterator>

namespace telesplat::codec::detail {
namespace {

unsigned size_of(int residual) {
  return static_cast<unsigned>(std::bit_width(static_cast<unsigned>(std::abs(residual))));
}
uint32_t byte_at(uint32_t word, int i) { return word >> 8 * i & 255; }
unsigned byte_size(unsigned size) { return std::min<unsigned>(size, ScatterContexts::kByteBits); }

// Green first, then red and blue less green's residual: bytes of a colour.
constexpr int kChannels[3] = {1, 0, 2};

// Predicts the spread of a number around its prediction, in units of log8() and error_log().
struct SpreadContext {
  int error[3], spread[3], slope;  // figures of the neighbours
  int distance, few;
  int before[2] = {0, 0};  // errors of this pixel's depth, and of its normal's first byte
};

SpreadContext context_of(const Guess& guess, const TileBounds& bounds) {
  const Magnitudes& e = guess.expected;
  SpreadContext out{{e.depth, e.normal[0], e.normal[1]}, {0, 0, 0}, 0, log8(guess.distance), guess.few};
  if (guess.few) return out;
  const auto code = static_cast<uint32_t>(guess.depth >> 4);
  const int of_depth = bounds.depth ? static_cast<int>(2 * bounds.depth->reach(code) + 1) : 1;
  out.spread[0] = error_log(guess.spread[0] / of_depth), out.slope = error_log(guess.slope / of_depth);
  for (int c = 1; c < 3; ++c) out.spread[c] = error_log(guess.spread[c] / (2 * bounds.normal + 1));
  return out;
}

// Fitted to the least bits on half of the images of walks over two terrains, a head and a bone; 256ths. For depth and
// for the normal's bytes.
struct Weights {
  int constant, error, next_error, other_error, coarse_error, distance, few, before[2], spread[3], slope;
};
constexpr Weights kExact[3] = {{-2941 * 8, 115, 13, 9, 254, -16, 3849 * 8, {0, 0}, {111, 87, 76}, 53},
                               {-19 * 8, 62, 49, -9, 84, 31, 294 * 8, {41, 0}, {-60, 157, -2}, 17},
                               {-56 * 8, 51, -10, 33, 93, 26, 87 * 8, {28, 83}, {-52, -34, 153}, 13}};
constexpr Weights kBounded[3] = {{-1758 * 8, 130, 17, 11, 54, -9, 2937 * 8, {0, 0}, {93, 102, 91}, 55},
                                 {-603 * 8, 48, 54, -11, 144, 22, 555 * 8, {49, 0}, {-49, 171, -7}, 23},
                                 {-609 * 8, 37, -12, 36, 137, 18, 392 * 8, {32, 92}, {-46, -39, 170}, 20}};

int scale_of(int kind, bool bounded, const SpreadContext& s) {
  const Weights& w = (bounded ? kBounded : kExact)[kind];
  const int error = s.error[kind];
  return w.constant + w.error * error + w.next_error * s.error[(kind + 1) % 3] +
         w.other_error * s.error[(kind + 2) % 3] + w.coarse_error * std::min(error, 40) + w.distance * s.distance +
         w.few * s.few + w.before[0] * s.before[0] + w.before[1] * s.before[1] + w.spread[0] * s.spread[0] +
         w.spread[1] * s.spread[1] + w.spread[2] * s.spread[2] + w.slope * s.slope;
}

// A prediction in 16ths, split into the nearest whole number and the rest.
struct Predicted {
  explicit Predicted(int sixteenths) : nearest((sixteenths + 8) >> 4), rounding(sixteenths + 8 - 16 * nearest) {}
  int nearest, rounding;
  int error(int64_t residual) const { return error_log(16 * residual + 8 - rounding); }
};

// Index of a depth in a lattice; both are in 16ths.
int on_lattice(const DepthLattice& lattice, int depth) {
  const int code = std::min((depth + 8) >> 4, static_cast<int>(image::kMaxDepthCode));
  const uint32_t index = lattice.index(static_cast<uint32_t>(code));
  const auto sixteenths = [&](uint32_t i) { return 16 * static_cast<int>(lattice.code(i)); };
  const int above = depth - sixteenths(index);
  const int step = above >= 0 ? sixteenths(index + 1) - sixteenths(index) : sixteenths(index) - sixteenths(index - 1);
  return 16 * static_cast<int>(index) + (step == 0 ? 0 : static_cast<int>(16 * int64_t{above} / step));
}

bool is_near(uint32_t a, uint32_t b, int reach) {
  int most = 0;
  for (int c = 0; c < 3; ++c)
    most = std::max(most, std::abs(static_cast<int>(byte_at(a, c)) - static_cast<int>(byte_at(b, c))));
  return most <= reach;
}

// Distance of blue and red of `colour` from their prediction plus `green`, green's difference to its own: 0..3.
size_t farness(uint32_t colour, uint32_t predicted, int green) {
  int sum = 0;
  for (const int channel : {kChannels[1], kChannels[2]})
    sum += std::abs(static_cast<int>(byte_at(colour, channel)) -
                    std::clamp(static_cast<int>(byte_at(predicted, channel)) + green, 0, 255));
  return sum == 0 ? 0 : sum < 6 ? 1 : sum < 20 ? 2 : 3;
}

size_t sign_of(int residual) { return residual < 0 ? 0 : residual == 0 ? 1 : 2; }

// The predicted colour of a pixel, and the models that code it.
struct ColourGuess {
  uint32_t colour;
  AdaptiveBit* plain;
  SignedModel* green;
};
ColourGuess guess_colour(ScatterContexts& contexts, const Guess& guess, const Ramp* ramp, int height) {
  if (ramp != nullptr)
    if (const Ramp::Said said = ramp->at(height); said.gap != Ramp::kNothing)
      return {said.colour, &contexts.plain_ramp[said.gap], &contexts.ramp[said.gap]};
  return {guess.colour, &contexts.plain[guess.plain_colour], &contexts.colour[0][byte_size(guess.expected.colour)]};
}

// Codes a pixel, which becomes what is decoded; false where there is no such number.
template <class Coder>
struct PixelCoder {
  ScatterContexts& contexts;
  const TileBounds& bounds;
  Ramp* ramp;
  const Guess& guess;
  const Coder coder;
  SpreadContext context = context_of(guess, bounds);

  bool code(int x, int y, Pixel& pixel, Magnitudes& out) {
    return code_depth(pixel.depth, out) && code_normal(pixel.normal, out) && code_colour(x, y, pixel, out);
  }
  bool code_depth(uint32_t& depth, Magnitudes& out) {
    const DepthLattice* lattice = bounds.depth;
    const Predicted predicted(lattice ? on_lattice(*lattice, guess.depth) : guess.depth);
    const int64_t wanted = int64_t{lattice ? lattice->index(depth) : depth} - predicted.nearest;
    const int64_t residual =
        contexts.depth.code(coder, wanted, predicted.rounding, scale_of(0, lattice != nullptr, context));
    context.before[0] = predicted.error(residual);
    out.depth = static_cast<uint8_t>(context.before[0]);
    const int64_t index = predicted.nearest + residual;
    if (index < 1 || index > (lattice ? lattice->last() : image::kMaxDepthCode)) return false;
    depth = lattice ? lattice->code(static_cast<uint32_t>(index)) : static_cast<uint32_t>(index);
    return true;
  }

  bool code_normal(uint16_t& normal, Magnitudes& out) {
    const NormalLattice lattice(bounds.normal);
    const bool exact = bounds.normal == 0;
    uint32_t result = 0;
    for (int c = 0; c < 2; ++c) {
      const auto value = static_cast<int>(byte_at(normal, c));
      const Predicted predicted(exact ? guess.normal[c]
                                      : lattice.index64(std::clamp(4 * guess.normal[c], 0, 64 * 254)) >> 2);
      // Bytes wrap, indices do not.
      const int64_t wanted = exact ? static_cast<int8_t>(static_cast<uint8_t>(value - predicted.nearest))
                                   : lattice.index(value) - predicted.nearest;
      const int64_t residual =
          contexts.normal[c].code(coder, wanted, predicted.rounding, scale_of(1 + c, bounds.depth != nullptr, context));
      context.before[1] = predicted.error(residual);
      out.normal[c] = static_cast<uint8_t>(context.before[1]);
      const int64_t index = predicted.nearest + residual;
      if (!exact && (index < 0 || index > lattice.most())) return false;
      result |=
          (exact ? static_cast<uint32_t>(index) & 255 : static_cast<uint32_t>(lattice.value(static_cast<int>(index))))
          << 8 * c;
    }
    normal = static_cast<uint16_t>(result);
    return true;
  }

  bool code_colour(int x, int y, Pixel& pixel, Magnitudes& out) {
    const int reach = bounds.colour;
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
          coder(
              !is_near(colour, known, reach),
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
};

}  // namespace

void ScatterContexts::start() {
  for (SpreadModel* model : {&depth, &normal[0], &normal[1]}) model->start();
  std::fill(std::begin(plain), std::end(plain), AdaptiveBit());
  std::fill(std::begin(plain_ramp), std::end(plain_ramp), AdaptiveBit());
  std::fill(std::begin(ramp), std::end(ramp), SignedModel());
  std::fill(std::begin(again), std::end(again), AdaptiveBit());
  for (auto& channel : colour) std::fill(std::begin(channel), std::end(channel), SignedModel());
  last_of_green.fill(-1);
}

void ScatterEncoder::start(const TileBounds& bounds, Ramp* ramp) {
  contexts_.start();
  bounds_ = &bounds;
  ramp_ = ramp;
  bytes_.clear();
  coder_ = RangeEncoder(bytes_);
}

Magnitudes ScatterEncoder::put(int x, int y, Pixel& pixel, const Guess& guess) {
  Magnitudes out;
  (void)PixelCoder<BitCoder>{contexts_, *bounds_, ramp_, guess, {coder_}}.code(x, y, pixel, out);
  return out;
}

void ScatterEncoder::finish(std::vector<uint8_t>& out) {
  coder_.finish();
  put_stored_block(out, bytes_);
}

bool ScatterDecoder::start(Reader& in, const TileBounds& bounds, Ramp* ramp) {
  contexts_.start();
  bounds_ = &bounds;
  ramp_ = ramp;
  const auto bytes = get_stored_block(in);
  if (!bytes) return false;
  coder_ = RangeDecoder(*bytes);
  return true;
}

std::optional<Pixel> ScatterDecoder::get(int x, int y, const Guess& guess, Magnitudes& out) {
  Pixel pixel;
  out = {};
  if (!PixelCoder<BitDecoder>{contexts_, *bounds_, ramp_, guess, {coder_}}.code(x, y, pixel, out)) return std::nullopt;
  return pixel;
}

}  // namespace telesplat::codec::detail
