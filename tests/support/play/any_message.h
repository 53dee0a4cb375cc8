// Makes messages of any kind from bytes: fields have known values, or strange ones. The result has gone through encoder
// and decoder, as if it had come over a socket: it is valid.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/volume/shear.h"
#include "common/wire/serial.h"
#include "tests/support/play/dice.h"
#include "tests/support/wire_samples.h"

namespace telesplat::test {

/// A received message. Its bulk fields point into `body`.
template <class M>
struct Arrived {
  M message;
  std::shared_ptr<const std::string> body;
};

/// Encodes and decodes a message; nothing: the decoder refuses it.
template <class M>
std::optional<Arrived<M>> over_the_wire(const M& m) {
  auto body = std::make_shared<const std::string>(wire::encode(m));
  auto decoded = wire::decode<M>(bytes_of(*body));
  if (!decoded) return std::nullopt;
  return Arrived<M>{*std::move(decoded), std::move(body)};
}

/// Values for fields, beside strange numbers. Lists may be empty.
struct Values {
  uint64_t ids = 6;  ///< small ones: 0 .. ids
  std::vector<uint64_t> other_ids;
  std::vector<geometry::Camera> cameras;
  std::vector<volume::ShearFrame> shears;
  std::vector<wire::Bytes> bulk;
  std::vector<std::string> texts;
  std::vector<std::string> keys;
  std::vector<std::pair<std::string_view, std::vector<std::string>>> texts_of;  ///< values for fields of this name
};

/// Fills messages field by field.
class AnyMessage {
 public:
  AnyMessage(Dice& dice, const Values& values) : dice_(dice), values_(values) {}

  /// Makes a message; nothing: the decoder refuses it.
  template <class M>
  std::optional<Arrived<M>> make() {
    M m;
    fill(m);
    return over_the_wire(m);
  }
  template <class M>
  void fill(M& m) {
    M::fields(*this, m);
  }

  void operator()(const char*, bool& v, size_t = 0) { v = dice_.chance(50); }
  void operator()(const char*, uint64_t& v, size_t = 0) { v = whole(); }
  void operator()(const char*, double& v, size_t = 0) { v = real(); }
  void operator()(const char* name, std::string& v, size_t = 0) { v = text(name); }
  template <class E>
  requires std::is_enum_v<E>
  void operator()(const char*, E& v, uint64_t values) { v = E(dice_.below(values)); }
  template <class Tag>
  void operator()(const char*, Id<Tag>& v, size_t = 0) {
    v.value = id();
  }
  void operator()(const char*, std::vector<std::string>& v, size_t = 0) {
    v.resize(dice_.below(4));
    for (std::string& s : v) s = key();
  }
  void operator()(const char*, std::map<std::string, std::string>& v, size_t = 0) {
    for (uint64_t n = dice_.below(4); n-- > 0;) v[key()] = text("");
  }
  void operator()(const char*, std::map<std::string, double>& v, size_t = 0) {
    for (uint64_t n = dice_.below(4); n-- > 0;) v[key()] = real();
  }
  void operator()(const char*, wire::Bytes& v, size_t = 0) {
    if (!values_.bulk.empty()) v = dice_.pick(values_.bulk);
  }
  void operator()(const char*, std::vector<uint32_t>& v, size_t = 0) {
    v.resize(dice_.below(8));
    for (uint32_t& n : v) n = dice_.chance(80) ? uint32_t(dice_.below(256)) : ~uint32_t{0} - uint32_t(dice_.below(4));
  }
  void operator()(const char*, std::vector<double>& v, size_t = 0) {
    v.resize(dice_.below(12));
    for (double& n : v) n = real();
  }
  void operator()(const char*, geometry::Box& v, size_t = 0) {
    constexpr std::array<float, 5> kSides{1, 0.4f, 0, -1, 3e6f};
    const float side = dice_.pick(kSides);
    v = {glm::vec3(-side), glm::vec3(side)};
  }
  void operator()(const char*, geometry::Rect& v, size_t = 0) {
    v = {int(16 * dice_.below(8)), int(16 * dice_.below(8)), int(16 * dice_.below(9)), int(16 * dice_.below(9))};
  }
  void operator()(const char*, geometry::Camera& v, size_t = 0) {
    if (!values_.cameras.empty()) v = dice_.pick(values_.cameras);
    if (dice_.chance(5)) v.width = v.height = dice_.chance(50) ? geometry::kMaxImageSide : 1;
  }
  void operator()(const char*, geometry::Pose& v, size_t = 0) {
    v.position_room = {0.1 * double(dice_.below(9)), dice_.chance(3) ? 1e6 : 0.1, 0.3};
  }
  void operator()(const char*, wire::Moments& v, size_t = 0) {
    if (dice_.chance(70)) return;
    for (double wire::Moments::*m : wire::kMoments) v.*m = real();
  }
  void operator()(const char*, std::vector<geometry::ChunkInfo>& v, size_t = 0) {
    v.resize(dice_.below(3));
    for (size_t i = 0; i < v.size(); ++i)
      v[i] = {ChunkId{dice_.chance(30) ? id() : i}, {{-1, -1, -1}, {1, 1, 1}}, uint32_t(whole()), uint32_t(whole())};
    if (v.size() == 2 && dice_.chance(50)) v[1].spacing_m = 0.1f, v[1].first_child = 0, v[1].children = 1;
  }
  void operator()(const char*, volume::ShearFrame& v, size_t = 0) {
    if (!values_.shears.empty()) v = dice_.pick(values_.shears);
    if (dice_.chance(4)) v.width = int(dice_.below(volume::kMaxRasterSide + 2));
  }
  template <Composed M>
  void operator()(const char*, M& v, size_t = 0) {
    fill(v);
  }
  template <Composed M>
  void operator()(const char*, std::vector<M>& v, size_t = 0) {
    v.resize(dice_.below(4));
    for (M& m : v) fill(m);
  }

  uint64_t id() {
    if (!values_.other_ids.empty() && dice_.chance(40)) return dice_.pick(values_.other_ids);
    return dice_.chance(97) ? dice_.below(values_.ids + 1) : strange();
  }
  uint64_t whole() { return dice_.chance(90) ? dice_.below(9) : strange(); }
  double real() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr std::array<double, 14> kReals{
        0,   1,     0.5,    -1,   3,         60,         1e-9,
        1e6, 1e300, -1e300, 4096, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()};
    return dice_.chance(50) ? double(dice_.below(100)) * 0.25 : dice_.pick(kReals);
  }
  std::string text(std::string_view field) {
    for (const auto& [name, texts] : values_.texts_of)
      if (name == field && dice_.chance(95)) return dice_.pick(texts);
    constexpr std::array<std::string_view, 6> kTexts{
        "", "a,b", "two\nlines \"quoted\"", "\x1b[31mred", "0:#000:0, 9:#fff:1", "{\"a\": [1]}"};
    if (!values_.texts.empty() && dice_.chance(60)) return dice_.pick(values_.texts);
    return std::string(dice_.pick(kTexts));
  }
  std::string key() { return values_.keys.empty() || dice_.chance(10) ? text("") : dice_.pick(values_.keys); }

 private:
  uint64_t strange() {
    constexpr std::array<uint64_t, 6> kStrange{
        ~uint64_t{0}, uint64_t{1} << 53, (uint64_t{1} << 32) - 1, uint64_t{1} << 32, 65535, 1024};
    return dice_.pick(kStrange);
  }

  Dice& dice_;
  const Values& values_;
};

}  // namespace telesplat::test
