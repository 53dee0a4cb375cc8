#include "common/codec/streams.h"

#include <algorithm>

#include "common/codec/tokens.h"

namespace telesplat::codec::detail {

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
  for (size_t i = 0; i < n; ++i) NumberToken::put(residuals.depth[i], &depth_[done_ + i], depth_bits_);
  for (size_t i = 0; i < n; ++i) NormalToken::put(residuals.normal[i], &normal_[done_ + i], normal_bits_);
  if (plain_colour_) {
    for (size_t i = 0; i < n; ++i) {
      const uint32_t difference = static_cast<uint32_t>(unfold_bytes(residuals.colour[i])), green = difference >> 8 & 255;
      const uint32_t z = fold_bytes(difference, green << 16 | green);
      colour_[0][done_ + i] = static_cast<uint8_t>(z >> 8);
      colour_[1][done_ + i] = static_cast<uint8_t>(z >> 16);
      colour_[2][done_ + i] = static_cast<uint8_t>(z);
    }
  } else {
    for (size_t i = 0; i < n; ++i) ColourToken::put(residuals.colour[i], &colour_[0][done_ + i], colour_bits_);
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
  if (!block(depth_) || !bits(depth_bits_) || !block(normal_) || !bits(normal_bits_) || !block(colour_[0])) return false;
  if (!plain_colour) return bits(colour_bits_);
  colour_bits_.start({}, 0);
  return block(colour_[1]) && block(colour_[2]);
}

bool TokenReader::take(Residuals& residuals, size_t n) {
  if (n > count_ - done_) return false;
  uint8_t largest = 0;
  for (size_t i = 0; i < n; ++i) largest = std::max(largest, depth_[done_ + i]);
  if (largest >= NumberToken::kCount) return false;
  for (size_t i = 0; i < n; ++i) residuals.depth[i] = NumberToken::get(depth_[done_ + i], depth_bits_);
  for (size_t i = 0; i < n; ++i) residuals.normal[i] = NormalToken::get(normal_[done_ + i], normal_bits_);
  if (plain_colour_) {
    for (size_t i = 0; i < n; ++i) {
      const uint32_t green_z = colour_[0][done_ + i], green = static_cast<uint32_t>(unfold_bytes(green_z)) & 255;
      const uint32_t z = green_z << 8 | uint32_t{colour_[1][done_ + i]} << 16 | colour_[2][done_ + i];
      residuals.colour[i] = fold_bytes(add_bytes(green << 16 | green, z), 0);
    }
  } else {
    for (size_t i = 0; i < n; ++i) residuals.colour[i] = ColourToken::get(colour_[0][done_ + i], colour_bits_);
  }
  done_ += n;
  return !depth_bits_.overrun() && !normal_bits_.overrun() && !colour_bits_.overrun();
}

bool TokenReader::finished() const {
  return done_ == count_ && depth_bits_.finished() && normal_bits_.finished() && colour_bits_.finished();
}

}  // namespace telesplat::codec::detail
