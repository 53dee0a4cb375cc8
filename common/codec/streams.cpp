#include "common/codec/streams.h"

#include <algorithm>

#include "common/codec/tokens.h"

// No vectors here, but variable shifts, which are much faster with the instructions that come with AVX2.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/codec/streams.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace telesplat::codec::detail::HWY_NAMESPACE {

template <class Token, class T>
void PutAll(const T* HWY_RESTRICT z, size_t n, uint8_t* HWY_RESTRICT tokens, BitSink& bits) {
  BitSink sink = bits;
  for (size_t i = 0; i < n; ++i) Token::put(z[i], tokens + i, sink);
  bits = sink;
}
void PutNumbers(const uint32_t* z, size_t n, uint8_t* tokens, BitSink& bits) {
  PutAll<NumberToken>(z, n, tokens, bits);
}
void PutNormals(const uint16_t* z, size_t n, uint8_t* tokens, BitSink& bits) {
  PutAll<NormalToken>(z, n, tokens, bits);
}
void PutColours(const uint32_t* z, size_t n, uint8_t* tokens, BitSink& bits) {
  PutAll<ColourToken>(z, n, tokens, bits);
}
void GetNumbers(const uint8_t* HWY_RESTRICT tokens, size_t n, BitSource& bits, uint32_t* HWY_RESTRICT z) {
  BitSource source = bits;
  for (size_t i = 0; i < n; ++i) z[i] = NumberToken::get(tokens[i], source);
  bits = source;
}
// Normals of joined pixels, colours left 0; and colours added to them.
void GetNormals(const uint8_t* HWY_RESTRICT tokens, size_t n, BitSource& bits, uint64_t* HWY_RESTRICT z) {
  BitSource source = bits;
  for (size_t i = 0; i < n; ++i) z[i] = join(0, NormalToken::get(tokens[i], source));
  bits = source;
}
void GetColours(const uint8_t* HWY_RESTRICT tokens, size_t n, BitSource& bits, uint64_t* HWY_RESTRICT z) {
  BitSource source = bits;
  for (size_t i = 0; i < n; ++i) z[i] |= ColourToken::get(tokens[i], source);
  bits = source;
}

}  // namespace telesplat::codec::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace telesplat::codec::detail {

HWY_EXPORT(PutNumbers);
HWY_EXPORT(PutNormals);
HWY_EXPORT(PutColours);
HWY_EXPORT(GetNumbers);
HWY_EXPORT(GetNormals);
HWY_EXPORT(GetColours);

void TokenWriter::start(size_t count, bool plain_colour) {
  count_ = count, done_ = 0, plain_colour_ = plain_colour;
  depth_.resize(count);
  normal_.resize(count);
  for (size_t i = 0; i < (plain_colour ? 3 : 1); ++i) colour_[i].resize(count);
  depth_bits_.start(count * NumberToken::kMaxBits);
  normal_bits_.start(count * NormalToken::kMaxBits);
  colour_bits_.start(plain_colour ? 0 : count * ColourToken::kMaxBits);
}

void TokenWriter::add(const Residuals& residuals, size_t n) {
  HWY_DYNAMIC_DISPATCH(PutNumbers)(residuals.depth.data(), n, depth_.data() + done_, depth_bits_.sink);
  HWY_DYNAMIC_DISPATCH(PutNormals)(residuals.normal.data(), n, normal_.data() + done_, normal_bits_.sink);
  if (plain_colour_) {
    for (size_t i = 0; i < n; ++i) {
      const uint32_t difference = static_cast<uint32_t>(unfold_bytes(residuals.colour[i])),
                     green = difference >> 8 & 255;
      const uint32_t z = fold_bytes(difference, green << 16 | green);
      colour_[0][done_ + i] = static_cast<uint8_t>(z >> 8);
      colour_[1][done_ + i] = static_cast<uint8_t>(z >> 16);
      colour_[2][done_ + i] = static_cast<uint8_t>(z);
    }
    done_ += n;
    return;
  }
  uint32_t any_colour = 0;
  for (size_t i = 0; i < n; ++i) any_colour |= residuals.colour[i];
  if (any_colour == 0) {
    std::fill_n(colour_[0].begin() + static_cast<ptrdiff_t>(done_), n, uint8_t{0});
  } else {
    HWY_DYNAMIC_DISPATCH(PutColours)(residuals.colour.data(), n, colour_[0].data() + done_, colour_bits_.sink);
  }
  done_ += n;
}

void TokenWriter::finish(std::vector<uint8_t>& out) {
  put_block(out, depth_);
  put_stored_block(out, depth_bits_.bytes());
  put_block(out, normal_);
  put_stored_block(out, normal_bits_.bytes());
  put_block(out, colour_[0]);
  if (!plain_colour_) return put_stored_block(out, colour_bits_.bytes());
  put_block(out, colour_[1]);
  put_block(out, colour_[2]);
}

bool TokenReader::start(Reader& in, size_t count, size_t row, bool plain_colour) {
  count_ = count, done_ = 0, plain_colour_ = plain_colour;
  const auto block = [&](std::vector<uint8_t>& tokens) {
    tokens.resize(count);
    return get_block(in, tokens);
  };
  const auto bits = [&](BitReader& reader) {
    const auto bytes = get_stored_block(in);
    if (bytes) reader.start(*bytes, row * 32);
    return bytes.has_value();
  };
  if (!block(depth_) || !bits(depth_bits_) || !block(normal_) || !bits(normal_bits_) || !block(colour_[0]))
    return false;
  if (!plain_colour) return bits(colour_bits_);
  colour_bits_.start({}, 0);
  return block(colour_[1]) && block(colour_[2]);
}

bool TokenReader::take(JoinedRow& residuals, size_t n) {
  if (n > count_ - done_) return false;
  uint8_t largest = 0, any_colour = 0;
  for (size_t i = 0; i < n; ++i) largest = std::max(largest, depth_[done_ + i]);
  if (largest >= NumberToken::kCount) return false;
  HWY_DYNAMIC_DISPATCH(GetNumbers)(depth_.data() + done_, n, depth_bits_.source, residuals.depth.data());
  HWY_DYNAMIC_DISPATCH(GetNormals)(normal_.data() + done_, n, normal_bits_.source, residuals.attributes.data());
  if (plain_colour_) {
    for (size_t i = 0; i < n; ++i) {
      const uint32_t green_z = colour_[0][done_ + i], green = static_cast<uint32_t>(unfold_bytes(green_z)) & 255;
      const uint32_t z = green_z << 8 | uint32_t{colour_[1][done_ + i]} << 16 | colour_[2][done_ + i];
      residuals.attributes[i] |= fold_bytes(add_bytes(green << 16 | green, z), 0);
    }
  } else {
    for (size_t i = 0; i < n; ++i) any_colour |= colour_[0][done_ + i];
    if (any_colour != 0)
      HWY_DYNAMIC_DISPATCH(GetColours)(colour_[0].data() + done_, n, colour_bits_.source, residuals.attributes.data());
  }
  done_ += n;
  return !depth_bits_.overrun() && !normal_bits_.overrun() && !colour_bits_.overrun();
}

bool TokenReader::finished() const {
  return done_ == count_ && depth_bits_.finished() && normal_bits_.finished() && colour_bits_.finished();
}

}  // namespace telesplat::codec::detail
#endif  // HWY_ONCE
