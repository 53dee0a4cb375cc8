// Points of formats 6 and later: each attribute is in a stream of bytes of its own, which may be missing where the
// attribute does not change. Each of four scanner channels has its own models.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "services/data/cloud/laz/items.h"

namespace telesplat::data::laz {
namespace {

enum Layer { kPlan, kHeight, kClass, kFlags, kIntensity, kAngle, kUser, kSource, kTime, kColours, kInfrared, kLayers };

// Bytes 0 to 29 of a LAS record; time apart.
struct NewPoint {
  int32_t x = 0, y = 0, z = 0;
  uint16_t intensity = 0;
  uint8_t returns = 0, flags = 0, classes = 0, user = 0;
  int16_t angle = 0;
  uint16_t source = 0;

  uint32_t r() const { return returns & 15; }
  uint32_t n() const { return returns >> 4; }
};
constexpr size_t kPointBytes = 22;

using Layers = std::array<Decoder, kLayers>;

// Points of one scanner channel.
class Channel {
 public:
  Channel(const NewPoint& last, uint64_t time) : last_(last), time_(time) {
    times_.begin(time);
    places_.begin(last.z), intensities_.fill(last.intensity);
  }
  const NewPoint& last() const { return last_; }
  uint64_t time() const { return time_; }

  // Says what changes from this point to the next one, and adds the step to that one's channel.
  uint32_t changes(Decoder& plan, uint32_t& channel) {
    const bool first = last_.r() == 1, end = last_.r() >= last_.n();
    const uint32_t changed = plan.symbol(changed_[first | end << 1 | time_changed_ << 2]);
    if (changed & 64) channel = (channel + plan.symbol(channel_step_) + 1) % 4;
    return changed;
  }

  void next(Layers& layers, uint32_t changed, uint32_t channel) {
    time_changed_ = changed >> 4 & 1;
    take_returns(layers[kPlan], changed);
    take_place(layers);
    const bool first = last_.r() == 1, end = last_.r() >= last_.n();
    if (layers[kClass].has_bytes())
      last_.classes = uint8_t(layers[kClass].symbol(classes_[(last_.classes & 31) << 1 | (first && end)]));
    uint32_t flags = (last_.flags & 15) | (last_.flags >> 2 & 48);
    if (layers[kFlags].has_bytes()) flags = layers[kFlags].symbol(flags_[flags]);
    last_.flags = uint8_t((flags & 15) | channel << 4 | (flags & 48) << 2);
    if (layers[kIntensity].has_bytes()) {
      const uint32_t context = first | end << 1;
      uint16_t& was = intensities_[context << 1 | time_changed_];
      last_.intensity = was = uint16_t(intensity_.next(layers[kIntensity], was, context));
    }
    if (changed & 8 && layers[kAngle].has_bytes())
      last_.angle = int16_t(angle_.next(layers[kAngle], uint16_t(last_.angle), time_changed_));
    if (layers[kUser].has_bytes()) last_.user = uint8_t(layers[kUser].symbol(users_[last_.user / 4]));
    if (changed & 32 && layers[kSource].has_bytes())
      last_.source = uint16_t(source_.next(layers[kSource], last_.source));
    if (time_changed_ && layers[kTime].has_bytes()) time_ = times_.next(layers[kTime]);
  }

 private:
  void take_returns(Decoder& plan, uint32_t changed) {
    const uint32_t was = last_.r();
    uint32_t r = was, n = last_.n();
    if (changed & 4) n = plan.symbol(numbers_of_returns_[n]);
    if ((changed & 3) == 1) r = was + 1;
    if ((changed & 3) == 2) r = was + 15;
    if ((changed & 3) == 3) r = time_changed_ ? plan.symbol(returns_[was]) : was + plan.symbol(return_step_) + 2;
    last_.returns = uint8_t(n << 4 | r % 16);
  }

  void take_place(Layers& layers) {
    // Contexts by number of returns and return.
    static constexpr const char* kReturns[16] = {
        "0123453445555555", "1013333333333333", "2124444444433333", "3345444444444444",
        "4344544444444444", "5344454444444444", "3344445444444444", "4344444544444444",
        "4344444454444444", "5344444445444444", "5344444444544444", "5334444444455444",
        "5334444444455544", "5334444444445554", "5334444444444555", "5334444444444455"};
    const uint32_t r = last_.r(), n = last_.n();
    const size_t context = size_t(kReturns[n][r] - '0') << 1 | time_changed_;
    places_.next_plan(layers[kPlan], context, n == 1, last_.x, last_.y);
    if (layers[kHeight].has_bytes())
      last_.z = places_.next_height(layers[kHeight], std::min<size_t>(n > r ? n - r : r - n, 7), n == 1);
  }

  NewPoint last_;
  uint64_t time_;
  bool time_changed_ = false;
  std::vector<SymbolModel> changed_ = std::vector<SymbolModel>(8, SymbolModel(128)),
                           classes_ = std::vector<SymbolModel>(64), users_ = classes_,
                           flags_ = std::vector<SymbolModel>(64, SymbolModel(64)),
                           returns_ = std::vector<SymbolModel>(16, SymbolModel(16)), numbers_of_returns_ = returns_;
  SymbolModel channel_step_{3}, return_step_{13};
  std::array<uint16_t, 8> intensities_;
  Numbers intensity_{16, 4}, angle_{16, 2}, source_{16};
  Places places_;
  Times times_{true};
};

// The numbers of one scanner channel that stand beside points.
struct Beside {
  bool used = false;
  Colours::Rgb rgb{};
  uint16_t infrared = 0;
  std::string extra;
  Colours colours;
  SymbolModel infrared_changed{4};
  std::array<SymbolModel, 2> infrared_bytes;
  std::vector<SymbolModel> extra_bytes;

  void begin(const Beside& last) { used = true, rgb = last.rgb, infrared = last.infrared, extra = last.extra; }
};

class LayersDecoder final : public PointDecoder {
 public:
  LayersDecoder(const Items& items, std::string_view chunk, uint64_t points)
      : items_(items), first_(chunk.substr(0, items.bytes())), extra_layers_(items.extra) {
    const auto number = [&](size_t at) {
      uint32_t out;
      if (at + sizeof out > chunk.size()) throw Damaged();
      std::memcpy(&out, chunk.data() + at, sizeof out);
      return out;
    };
    size_t at = first_.size();
    if (number(at) != points) throw Damaged();
    std::vector<Decoder*> layers;
    for (size_t i = 0; i < kLayers; ++i)
      if (i < kColours || (i == kColours && items.colours) || (i == kInfrared && items.infrared))
        layers.push_back(&layers_[i]);
    for (Decoder& layer : extra_layers_) layers.push_back(&layer);
    size_t body = at + 4 + 4 * layers.size();
    for (Decoder* layer : layers) {
      const uint32_t bytes = number(at += 4);
      if (body > chunk.size() || bytes > chunk.size() - body) throw Damaged();
      if (bytes > 0) *layer = Decoder(chunk.substr(body, bytes));
      body += bytes;
    }
    for (Beside& beside : beside_) beside.extra_bytes.resize(items.extra);
  }

  void next(char* out) override {
    if (!first_.empty()) return begin(out);
    if (!layers_[kPlan].has_bytes()) throw Damaged();
    uint32_t channel = now_;
    const uint32_t changed = channels_[now_]->changes(layers_[kPlan], channel);
    auto& points = channels_[channel];
    if (!points) points = std::make_unique<Channel>(channels_[now_]->last(), channels_[now_]->time());
    points->next(layers_, changed, channel);
    now_ = channel;
    std::memcpy(out, &points->last(), kPointBytes);
    const uint64_t time = points->time();
    std::memcpy(out + kPointBytes, &time, sizeof time);
    next_beside(out + kPointBytes + sizeof time, items_.each_has_its_channel || changed & 64 ? channel : 0);
  }

 private:
  // The first point is not compressed.
  void begin(char* out) {
    std::memcpy(out, first_.data(), first_.size());
    NewPoint point;
    uint64_t time;
    std::memcpy(static_cast<void*>(&point), out, kPointBytes);
    std::memcpy(&time, out += kPointBytes, sizeof time);
    now_ = beside_now_ = point.flags >> 4 & 3;
    channels_[now_] = std::make_unique<Channel>(point, time);
    Beside& beside = beside_[now_];
    beside.used = true;
    out += sizeof time;
    if (items_.colours) std::memcpy(beside.rgb.data(), out, sizeof beside.rgb), out += sizeof beside.rgb;
    if (items_.infrared) std::memcpy(&beside.infrared, out, sizeof beside.infrared), out += sizeof beside.infrared;
    beside.extra.assign(out, items_.extra);
    first_ = {};
  }

  void next_beside(char* out, uint32_t channel) {
    // Version 3 goes on with the values of the last channel where it comes back to one.
    size_t values = beside_now_;
    if (const bool first = !beside_[channel].used; first || items_.each_has_its_channel) {
      if (first) beside_[channel].begin(beside_[beside_now_]);
      values = channel;
    }
    beside_now_ = channel;
    Beside &models = beside_[channel], &last = beside_[values];
    if (layers_[kColours].has_bytes()) last.rgb = models.colours.next(layers_[kColours], last.rgb);
    if (Decoder& layer = layers_[kInfrared]; layer.has_bytes()) {
      const uint32_t changed = layer.symbol(models.infrared_changed);
      uint32_t low = last.infrared & 255, high = last.infrared >> 8;
      if (changed & 1) low = uint8_t(low + layer.symbol(models.infrared_bytes[0]));
      if (changed & 2) high = uint8_t(high + layer.symbol(models.infrared_bytes[1]));
      last.infrared = uint16_t(high << 8 | low);
    }
    if (items_.colours) std::memcpy(out, last.rgb.data(), sizeof last.rgb), out += sizeof last.rgb;
    if (items_.infrared) std::memcpy(out, &last.infrared, sizeof last.infrared), out += sizeof last.infrared;
    for (size_t i = 0; i < extra_layers_.size(); ++i) {
      Decoder& layer = extra_layers_[i];
      if (layer.has_bytes()) last.extra[i] = char(uint8_t(last.extra[i]) + layer.symbol(models.extra_bytes[i]));
      *out++ = last.extra[i];
    }
  }

  const Items items_;
  std::string_view first_;  // empty: it was written
  Layers layers_;
  std::vector<Decoder> extra_layers_;
  std::array<std::unique_ptr<Channel>, 4> channels_;
  std::array<Beside, 4> beside_;
  uint32_t now_ = 0, beside_now_ = 0;
};

}  // namespace

std::unique_ptr<PointDecoder> decode_layers(const Items& items, std::string_view chunk, uint64_t points) {
  return std::make_unique<LayersDecoder>(items, chunk, points);
}

}  // namespace telesplat::data::laz
