// One valid message of every type, and just enough of msgpack to damage it.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <typeinfo>
#include <vector>

#include "common/wire/serial.h"

namespace telesplat::test {

inline constexpr std::array<std::byte, 5> kBulk{std::byte{1}, std::byte{2}, std::byte{0}, std::byte{255}, std::byte{5}};

struct AnyVisitor {};
/// A message, or a struct within one.
template <class M>
concept Composed = requires(AnyVisitor f, M& m) {
  M::fields(f, m);
};

// Gives every field, of any type, a value other than its default.
struct Filler {
  void operator()(const char*, bool& v, size_t = 0) { v = true; }
  void operator()(const char*, uint64_t& v, size_t = 0) { v = 1000 + ++n_; }
  void operator()(const char*, double& v, size_t = 0) { v = 0.25 + ++n_; }
  void operator()(const char* name, std::string& v, size_t = 0) { v = std::string("some ") + name; }
  void operator()(const char*, std::vector<std::string>& v, size_t = 0) { v = {"a", "", "b"}; }
  void operator()(const char*, std::map<std::string, std::string>& v, size_t = 0) {
    v = {{"key", "value"}, {"other", ""}};
  }
  void operator()(const char*, std::map<std::string, double>& v, size_t = 0) {
    v = {{"points", 1e6}, {"small", -1e-9}};
  }
  template <class E>
  requires std::is_enum_v<E>
  void operator()(const char*, E& v, size_t = 0) { v = E(1); }
  template <class Tag>
  void operator()(const char*, Id<Tag>& v, size_t = 0) {
    v.value = (uint64_t(1) << 40) + ++n_;
  }
  void operator()(const char*, wire::Bytes& v, size_t = 0) { v = kBulk; }
  void operator()(const char*, std::vector<uint32_t>& v, size_t = 0) { v = {1, 2, 0xffffffff}; }
  void operator()(const char*, std::vector<double>& v, size_t = 0) { v = {1.5, -2, 3e300}; }
  void operator()(const char*, geometry::Box& v, size_t = 0) { v = {{-1, -2, -3}, {1, 2, 3.5}}; }
  void operator()(const char*, geometry::Rect& v, size_t = 0) { v = {64, 32, 100, 50}; }
  void operator()(const char*, geometry::Camera& v, size_t = 0) {
    v = {{{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}}, -1, 1, -0.5, 0.75, 0.01, 320, 200};
  }
  void operator()(const char*, geometry::Pose& v, size_t = 0) { v = {{0.1, 0.2, 0.3}, {0.6, 0, 0.8, 0}}; }
  void operator()(const char*, wire::Moments& v, size_t = 0) {
    for (double wire::Moments::*m : wire::kMoments) v.*m = 0.5 + ++n_;
  }
  void operator()(const char*, std::vector<geometry::ChunkInfo>& v, size_t = 0) {
    v = {{ChunkId{0}, {{-1, -1, -1}, {0, 0, 0}}, 12, 500}, {ChunkId{1}, {{0, 0, 0}, {1, 1, 1}}, 7, 300, 0.25f, 0, 1}};
  }
  void operator()(const char*, volume::ShearFrame& v, size_t = 0) {
    v = {1, -1, {3, 40, 5}, -0.5, 0.01, -0.25, 0.02, 100, 50, {{8, 16, 11.5}, {0, 8, 3.5}}};
  }
  template <Composed M>
  void operator()(const char*, M& v, size_t = 0) {
    fill(v);
  }
  template <Composed M>
  void operator()(const char*, std::vector<M>& v, size_t = 0) {
    v.resize(2);
    for (M& m : v) fill(m);
  }
  template <class M>
  void fill(M& m) {
    M::fields(*this, m);
    if constexpr (requires { m.tiles_in_frame; }) m.tile = 3, m.tiles_in_frame = 8;
    if constexpr (requires { m.blocks_in_frame; }) m.tile = 5, m.block = 3, m.blocks_in_frame = 8;
    if constexpr (requires { m.step; }) m.step = 4;
    if constexpr (requires {
                    m.slabs;
                    m.slab;
                  })
      m.slab = 2, m.slabs = 5;
    if constexpr (requires {
                    m.begin;
                    m.end;
                  })
      m.begin = 3, m.end = 12;
    if constexpr (std::is_same_v<M, wire::SliceWeights>) m.begin = 3;
    if constexpr (std::is_same_v<M, wire::Plan>)
      m.tiles = {64, 32, 100, 50, 700, 2, 0, 0, 64, 32, 2048, 0, 200, 100, 1, 1, 1, 1};
    if constexpr (std::is_same_v<M, wire::SwapReady>) m.number = 2, m.viewers = 4;
    if constexpr (requires { m.buffers; }) m.buffers = 3;
    if constexpr (std::is_same_v<M, wire::SessionSettings>) {
      m.validation = 33, m.still_rays = 4, m.layers = 8, m.least_sampling = 0.75, m.buffers = 2;
      m.picture_quality = 35, m.picture_samples = 4, m.picture_shading = 2;
    }
    if constexpr (requires { m.wall_viewers; }) m.wall_viewers = 4;
    if constexpr (requires { m.footprint; }) m.footprint = 0.00078125;
  }

 private:
  uint64_t n_ = 0;
};

template <class M>
M sample_message() {
  M m;
  Filler().fill(m);
  return m;
}

inline wire::Bytes bytes_of(const std::string& s) { return std::as_bytes(std::span(s)); }

/// A kind of message, without its type: properties that all kinds have.
struct MessageSample {
  std::string_view name;
  const std::type_info& type;
  std::string body;          ///< a valid message; no field has its default value
  std::string default_body;  ///< encoded with nothing set; need not be valid
  /// Decodes a body and encodes the result.
  Result<std::string> (*round_trip)(wire::Bytes body);
};

template <class M>
Result<std::string> round_trip(wire::Bytes body) {
  const auto message = wire::decode<M>(body);
  if (!message) return message.error();
  return wire::encode(*message);
}

/// Returns one of every message.
inline const std::vector<MessageSample>& message_samples() {
  static const std::vector<MessageSample> samples = []<class... M>(std::type_identity<std::tuple<M...>>) {
    return std::vector<MessageSample>{
        {M::kName, typeid(M), wire::encode(sample_message<M>()), wire::encode(M{}), round_trip<M>}...};
  }(std::type_identity<wire::Messages>{});
  return samples;
}

/// Returns the end of the msgpack value at `at`; bytes must be well-formed. Passes every string on the way to `text`.
inline size_t value_end(const std::string& bytes, size_t at, const std::function<void(std::string_view)>& text = {}) {
  const auto u8 = [&](size_t i) { return static_cast<unsigned char>(bytes.at(i)); };
  const auto number = [&](size_t i, size_t n) {
    size_t v = 0;
    for (size_t k = 0; k < n; ++k) v = v << 8 | u8(i + k);
    return v;
  };
  const auto values = [&](size_t i, size_t count) {
    while (count--) i = value_end(bytes, i, text);
    return i;
  };
  const auto string = [&](size_t i, size_t size) {
    if (text) text(std::string_view(bytes).substr(i, size));
    return i + size;
  };
  const unsigned t = u8(at);
  if (t < 0x80 || t >= 0xe0 || t == 0xc0 || t == 0xc2 || t == 0xc3) return at + 1;
  if (t < 0x90) return values(at + 1, 2 * (t & 15));
  if (t < 0xa0) return values(at + 1, t & 15);
  if (t < 0xc0) return string(at + 1, t & 31);
  if (t <= 0xc6) return at + 1 + (size_t{1} << (t - 0xc4)) + number(at + 1, size_t{1} << (t - 0xc4));  // bin
  if (t == 0xca || t == 0xce || t == 0xd2) return at + 5;
  if (t == 0xcb || t == 0xcf || t == 0xd3) return at + 9;
  if (t == 0xcc || t == 0xd0) return at + 2;
  if (t == 0xcd || t == 0xd1) return at + 3;
  if (t >= 0xd9 && t <= 0xdb) {
    const size_t width = size_t{1} << (t - 0xd9);
    return string(at + 1 + width, number(at + 1, width));
  }
  const size_t width = t & 1 ? 4 : 2;
  return values(at + 1 + width, number(at + 1, width) * (t >= 0xde ? 2 : 1));  // array, map
}

struct Field {
  std::string name;                    // a brief message's fields have numbers
  size_t key = 0, value = 0, end = 0;  // offsets in the body
};

/// The fields of an encoded message's map.
inline std::vector<Field> fields_of(const std::string& body) {
  std::vector<Field> out;
  const unsigned first = static_cast<unsigned char>(body.at(0));
  const size_t count =
      first == 0xde ? static_cast<unsigned char>(body[1]) * 256u + static_cast<unsigned char>(body[2]) : first & 15;
  for (size_t i = 0, at = first == 0xde ? 3 : 1; i < count; ++i) {
    const size_t value = value_end(body, at), end = value_end(body, value);
    const auto key = static_cast<unsigned char>(body.at(at));
    out.push_back({key < 0x80 ? std::to_string(key) : body.substr(at + 1, value - at - 1), at, value, end});
    at = end;
  }
  return out;
}

/// Returns `body` with the value of a field replaced.
inline std::string with_value(const std::string& body, const std::string& field, const std::string& value) {
  for (const Field& f : fields_of(body))
    if (f.name == field) return body.substr(0, f.value) + value + body.substr(f.end);
  return body;
}

}  // namespace telesplat::test
