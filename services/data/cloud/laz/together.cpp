// Points of formats 0 to 5: all their numbers are in one stream of bytes.
#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "services/data/cloud/laz/items.h"

namespace telesplat::data::laz {
namespace {

// Bytes 0 to 19 of a LAS record.
struct OldPoint {
  int32_t x = 0, y = 0, z = 0;
  uint16_t intensity = 0;
  uint8_t returns = 0, classes = 0, angle = 0, user = 0;
  uint16_t source = 0;
};
static_assert(sizeof(OldPoint) == 20);

class Points {
 public:
  void next(Decoder& decoder, OldPoint& last) {
    // Contexts by number of returns and return.
    static constexpr uint8_t kReturns[8][8] = {{15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},
                                               {13, 1, 2, 4, 7, 11, 11, 10},    {12, 3, 4, 5, 8, 12, 12, 11},
                                               {11, 6, 7, 8, 9, 13, 13, 12},    {10, 10, 11, 12, 13, 14, 14, 13},
                                               {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15}};
    const uint32_t changed = decoder.symbol(changed_);
    if (changed & 32) last.returns = uint8_t(decoder.symbol(returns_[last.returns]));
    const int r = last.returns & 7, n = last.returns >> 3 & 7;
    const uint32_t context = kReturns[n][r];
    uint16_t& intensity = intensities_[context];
    if (changed & 16) intensity = uint16_t(intensity_.next(decoder, intensity, std::min<uint32_t>(context, 3)));
    last.intensity = intensity;
    if (changed & 8) last.classes = uint8_t(decoder.symbol(classes_[last.classes]));
    if (changed & 4) last.angle = uint8_t(last.angle + decoder.symbol(angles_[last.returns >> 6 & 1]));
    if (changed & 2) last.user = uint8_t(decoder.symbol(users_[last.user]));
    if (changed & 1) last.source = uint16_t(source_.next(decoder, last.source));
    places_.next_plan(decoder, context, n == 1, last.x, last.y);
    last.z = places_.next_height(decoder, size_t(std::abs(n - r)), n == 1);
  }

 private:
  SymbolModel changed_{64};
  std::vector<SymbolModel> returns_ = std::vector<SymbolModel>(256), classes_ = returns_, users_ = returns_;
  std::array<SymbolModel, 2> angles_;
  std::array<uint16_t, 16> intensities_{};
  Numbers intensity_{16, 4}, source_{16};
  Places places_;
};

class TogetherDecoder final : public PointDecoder {
 public:
  TogetherDecoder(const Items& items, std::string_view chunk)
      : items_(items), first_(chunk.substr(0, items.bytes())), rest_(chunk.substr(first_.size())), extra_(items.extra) {
    if (first_.size() < items.bytes()) throw Damaged();
  }

  void next(char* out) override {
    if (!first_.empty()) return begin(out);
    if (!decoder_.has_bytes()) decoder_ = Decoder(rest_);
    points_.next(decoder_, last_);
    const auto put = [&](const void* from, size_t bytes) { std::memcpy(out, from, bytes), out += bytes; };
    put(&last_, sizeof last_);
    if (items_.time) time_ = times_.next(decoder_), put(&time_, sizeof time_);
    if (items_.colours) rgb_ = colours_.next(decoder_, rgb_), put(rgb_.data(), sizeof rgb_);
    for (size_t i = 0; i < extra_.size(); ++i)
      *out++ = extra_last_[i] = char(uint8_t(extra_last_[i]) + decoder_.symbol(extra_[i]));
  }

 private:
  // The first point is not compressed.
  void begin(char* out) {
    const char* from = first_.data();
    std::memcpy(out, from, first_.size());
    const auto take = [&](void* to, size_t bytes) { std::memcpy(to, from, bytes), from += bytes; };
    take(&last_, sizeof last_);
    if (items_.time) take(&time_, sizeof time_), times_.begin(time_);
    if (items_.colours) take(rgb_.data(), sizeof rgb_);
    extra_last_.assign(from, from + items_.extra);
    first_ = {};
  }

  const Items items_;
  std::string_view first_, rest_;  // first_: empty: it was written
  Decoder decoder_;
  OldPoint last_;
  Points points_;
  uint64_t time_ = 0;
  Times times_{false};
  Colours::Rgb rgb_{};
  Colours colours_;
  std::vector<char> extra_last_;
  std::vector<SymbolModel> extra_;
};

}  // namespace

std::unique_ptr<PointDecoder> decode_together(const Items& items, std::string_view chunk) {
  return std::make_unique<TogetherDecoder>(items, chunk);
}

}  // namespace telesplat::data::laz
