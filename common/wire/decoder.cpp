#include "common/wire/decoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <msgpack/null_visitor.hpp>
#include <msgpack/parse.hpp>
#include <msgpack/unpack.hpp>

#include "common/core/utf8.h"
#include "common/wire/short_camera.h"
#include "common/wire/varint.h"

namespace telesplat::wire {
namespace {

bool is(const msgpack::object& key, std::string_view name) {
  return key.type == msgpack::type::STR && std::string_view(key.via.str.ptr, key.via.str.size) == name;
}
bool is(const msgpack::object& key, uint64_t number) {
  return key.type == msgpack::type::POSITIVE_INTEGER && key.via.u64 == number;
}

const msgpack::object* find(const msgpack::object& map, const auto& field) {
  for (uint32_t i = 0; i < map.via.map.size; ++i)
    if (is(map.via.map.ptr[i].key, field)) return &map.via.map.ptr[i].val;
  return nullptr;
}

bool is_integer(double v, double lo, double hi) { return v >= lo && v <= hi && v == std::floor(v); }

std::optional<Error> check_version(const msgpack::object& map) {
  const msgpack::object* version = find(map, std::string_view("v"));
  if (!version || version->type != msgpack::type::POSITIVE_INTEGER) return Error{"has no version"};
  if (version->via.u64 == kProtocolVersion) return std::nullopt;
  return Error{fmt::format("has version {} instead of {}", version->via.u64, kProtocolVersion)};
}

constexpr int kMaxDepth = 8;

// Adds up the sizes that lists and maps claim, without taking memory for them. Stops beyond the limit.
struct ElementCounter : msgpack::null_visitor {
  size_t left = 0;
  int depth = 0;
  bool too_many = false;
  bool take(uint64_t elements) {
    too_many |= elements > left;
    if (too_many || ++depth > kMaxDepth) return false;
    left -= elements;
    return true;
  }
  bool start_array(uint32_t elements) { return take(elements); }
  bool start_map(uint32_t pairs) { return take(2 * uint64_t{pairs}); }
  bool end_array() { return --depth, true; }
  bool end_map() { return --depth, true; }
};

// An element takes a byte in the message, and 24 of memory once it is read. Other faults are left to the reader.
bool has_more(Bytes body, size_t max_elements) {
  ElementCounter counter;
  counter.left = max_elements;
  msgpack::parse(reinterpret_cast<const char*>(body.data()), body.size(), counter);
  return counter.too_many;
}

}  // namespace

std::optional<Error> read_any(Bytes body, size_t max_elements,
                              const std::function<std::optional<Error>(const msgpack::object&)>& read) {
  try {
    if (has_more(body, max_elements)) return Error{fmt::format("has more than {} elements", max_elements)};
    // Strings and binaries are referenced in place. Sizes that lists and maps claim are limited before memory is taken.
    const msgpack::unpack_limit limit(geometry::kMaxChunks, kMaxEntries, kMaxControlBytes, kMaxBulkBytes, kMaxString,
                                      kMaxDepth);
    size_t offset = 0;
    const msgpack::object_handle handle = msgpack::unpack(
        reinterpret_cast<const char*>(body.data()), body.size(), offset,
        [](msgpack::type::object_type, size_t, void*) { return true; }, nullptr, limit);
    if (offset != body.size()) return Error{fmt::format("{} bytes follow the map", body.size() - offset)};
    const msgpack::object& map = handle.get();
    if (map.type != msgpack::type::MAP) return Error{"is not a map"};
    return read(map);
  } catch (const std::exception& e) {  // msgpack's own errors: truncated, too deep, too large
    return Error{e.what()};
  }
}

std::optional<Error> read_map(Bytes body, size_t max_elements,
                              const std::function<std::optional<Error>(Decoder&)>& read) {
  return read_any(body, max_elements, [&](const msgpack::object& map) {
    if (auto bad = check_version(map)) return bad;
    Decoder decoder(map);
    return read(decoder);
  });
}

std::optional<uint64_t> version_of(Bytes body) {
  std::optional<uint64_t> out;
  read_any(body, kMaxElements, [&](const msgpack::object& map) {
    const msgpack::object* version = find(map, std::string_view("v"));
    if (version && version->type == msgpack::type::POSITIVE_INTEGER) out = version->via.u64;
    return std::optional<Error>();
  });
  return out;
}

bool Decoder::has(std::string_view name) const { return find(map_, name) != nullptr; }

const msgpack::object* Decoder::enter(const char* name, size_t limit) {
  if (error_) return nullptr;
  const msgpack::object* o = brief_ ? find(map_, number_++) : find(map_, std::string_view(name));
  if (!o && !brief_) error_ = Error{fmt::format("field {} is missing", name)};
  name_ = name;
  limit_ = limit;
  return o;
}

void Decoder::fail(std::string_view why) {
  if (!error_) error_ = Error{fmt::format("field {} {}", name_, why)};
}

bool Decoder::within(size_t size, size_t limit) {
  if (size <= limit) return true;
  fail(fmt::format("has {} entries or bytes, limit {}", size, limit));
  return false;
}

bool Decoder::is_map(const msgpack::object& o) {
  if (o.type == msgpack::type::MAP) return true;
  fail("is not a map");
  return false;
}

size_t Decoder::list_size(const msgpack::object& o, size_t limit) {
  if (o.type == msgpack::type::ARRAY) return within(o.via.array.size, limit) ? o.via.array.size : 0;
  fail("is not a list");
  return 0;
}

const msgpack::object& Decoder::entry(const msgpack::object& list, size_t i) { return list.via.array.ptr[i]; }

// ---- numbers and texts ---------------------------------------------------------------------------------------------

void Decoder::get(const msgpack::object& o, bool& v) {
  if (o.type != msgpack::type::BOOLEAN) return fail("is not a boolean");
  v = o.via.boolean;
}

void Decoder::get(const msgpack::object& o, uint64_t& v) {
  if (o.type != msgpack::type::POSITIVE_INTEGER) return fail("is not an unsigned integer");
  v = o.via.u64;
}

void Decoder::get(const msgpack::object& o, double& v) {
  if (o.type == msgpack::type::FLOAT64 || o.type == msgpack::type::FLOAT32)
    v = o.via.f64;
  else if (o.type == msgpack::type::POSITIVE_INTEGER)
    v = static_cast<double>(o.via.u64);
  else if (o.type == msgpack::type::NEGATIVE_INTEGER)
    v = static_cast<double>(o.via.i64);
  else
    return fail("is not a number");
  if (!std::isfinite(v)) fail("is not finite");
}

// Texts go into JSON, logs and terminals, which take only UTF-8.
void Decoder::get(const msgpack::object& o, std::string& v) {
  if (o.type != msgpack::type::STR) return fail("is not a string");
  const std::string_view text(o.via.str.ptr, o.via.str.size);
  if (!within(text.size(), limit_ ? limit_ : kMaxString)) return;
  if (!valid_utf8(text)) return fail("is not UTF-8");
  v = text;
}

// True if all values stay finite as floats.
bool Decoder::all_single(std::span<const double> v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(static_cast<float>(x)); });
}

bool Decoder::numbers(const msgpack::object& o, std::span<double> out) {
  if (o.type != msgpack::type::ARRAY || o.via.array.size != out.size())
    fail(fmt::format("is not a list of {} numbers", out.size()));
  for (size_t i = 0; i < out.size() && !error_; ++i) get(entry(o, i), out[i]);
  return !error_;
}

// ---- lists, maps and bulk fields -----------------------------------------------------------------------------------

void Decoder::get(const msgpack::object& o, Bytes& v) {
  if (o.type != msgpack::type::BIN) return fail("is not binary");
  if (within(o.via.bin.size, limit_)) v = {reinterpret_cast<const std::byte*>(o.via.bin.ptr), o.via.bin.size};
}

template <class T>
void Decoder::get_bin(const msgpack::object& o, std::vector<T>& v, size_t max_entries) {
  if (o.type != msgpack::type::BIN) return fail("is not binary");
  if (o.via.bin.size % sizeof(T))
    return fail(fmt::format("has {} bytes, not a multiple of {}", o.via.bin.size, sizeof(T)));
  if (!within(o.via.bin.size / sizeof(T), max_entries)) return;
  v.resize(o.via.bin.size / sizeof(T));
  if (!v.empty()) std::memcpy(v.data(), o.via.bin.ptr, o.via.bin.size);
}
void Decoder::get(const msgpack::object& o, std::vector<uint32_t>& v) { get_bin(o, v, limit_ > 0 ? limit_ : kMaxKeys); }
void Decoder::get(const msgpack::object& o, std::vector<double>& v) { get_bin(o, v, kMaxBulkBytes / sizeof(double)); }

void Decoder::get(const msgpack::object& o, std::vector<std::string>& v) {
  v.resize(list_size(o, kMaxEntries));
  for (size_t i = 0; i < v.size() && !error_; ++i) get(entry(o, i), v[i]);
}

template <class V>
void Decoder::get_map(const msgpack::object& o, std::map<std::string, V>& v) {
  if (!is_map(o) || !within(o.via.map.size, kMaxEntries)) return;
  const size_t value_limit = limit_;
  for (uint32_t i = 0; i < o.via.map.size && !error_; ++i) {
    std::string key;
    limit_ = 0;  // the field's limit is for its values, not for its keys
    get(o.via.map.ptr[i].key, key);
    limit_ = value_limit;
    if (!error_) get(o.via.map.ptr[i].val, v[key]);
  }
}
void Decoder::get(const msgpack::object& o, std::map<std::string, std::string>& v) { get_map(o, v); }
void Decoder::get(const msgpack::object& o, std::map<std::string, double>& v) { get_map(o, v); }

// ---- cameras, boxes and poses --------------------------------------------------------------------------------------

void Decoder::get(const msgpack::object& o, geometry::Box& b) {
  double v[6];
  if (!numbers(o, v)) return;
  if (!all_single(v)) return fail("is beyond single precision");
  b = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

void Decoder::get(const msgpack::object& o, geometry::Rect& r) {
  double v[4];
  if (!numbers(o, v)) return;
  const double side = geometry::kMaxImageSide;
  if (!is_integer(v[0], 0, side) || !is_integer(v[1], 0, side) || !is_integer(v[2], 1, side) ||
      !is_integer(v[3], 1, side))
    return fail(fmt::format("{}x{}+{}+{} is not a rectangle within {}", v[2], v[3], v[0], v[1], side));
  r = {int(v[0]), int(v[1]), int(v[2]), int(v[3])};
}

void Decoder::get(const msgpack::object& o, geometry::Pose& p) {
  double v[7];
  if (!numbers(o, v)) return;
  p = {{v[0], v[1], v[2]}, glm::dquat(v[3], v[4], v[5], v[6])};
  geometry::Camera camera;
  camera.pose = p;
  if (const auto valid = geometry::validate(camera); !valid) fail(": " + valid.error().text);
}

void Decoder::get(const msgpack::object& o, geometry::Camera& c) {
  if (brief_ && o.type == msgpack::type::BIN) {
    const auto read = read_short_form({reinterpret_cast<const std::byte*>(o.via.bin.ptr), o.via.bin.size});
    if (!read) return fail(read.error().text);
    c = *read;
    return;
  }
  double v[14];
  if (!numbers(o, v)) return;
  if (!is_integer(v[12], 1, geometry::kMaxImageSide) || !is_integer(v[13], 1, geometry::kMaxImageSide))
    return fail(fmt::format("has size {}x{}, limit {}", v[12], v[13], geometry::kMaxImageSide));
  const geometry::Pose pose{{v[0], v[1], v[2]}, glm::dquat(v[3], v[4], v[5], v[6])};
  c = {pose, v[7], v[8], v[9], v[10], v[11], int(v[12]), int(v[13])};
  if (const auto valid = geometry::validate(c); !valid) fail(": " + valid.error().text);
}

// Reads moments, each in microseconds after the known one before. next(): a number, nothing if not known, or fails.
void Decoder::get_moments(Moments& m, const std::function<std::optional<double>()>& next) {
  double before = 0;  // sums stay far below what f64 holds exactly: each is checked
  for (double Moments::*const moment : kMoments) {
    m.*moment = 0;
    const std::optional<double> number = next();
    if (error_) return;
    if (!number) continue;
    const bool duration = moment == &Moments::fetch_s;
    const double us = duration ? *number : before + *number;
    if (!(std::abs(*number) <= kMostMoment_us && std::abs(us) <= kMostMoment_us))
      return fail(fmt::format("has a moment of {} microseconds, limit {}", us, kMostMoment_us));
    if (!duration) before = us;
    m.*moment = us / 1e6;
  }
}

void Decoder::get(const msgpack::object& o, Moments& m) {
  if (brief_ && o.type == msgpack::type::BIN) {
    VarintSource in({reinterpret_cast<const std::byte*>(o.via.bin.ptr), o.via.bin.size});
    get_moments(m, [&]() -> std::optional<double> {
      const uint64_t number = in.number(kMostVarint);
      if (number == 0) return std::nullopt;
      return static_cast<double>(unfold(number - 1));
    });
    if (in.failed() || in.left() != 0)
      fail(fmt::format("of {} bytes is not {} moments", o.via.bin.size, std::size(kMoments)));
    return;
  }
  if (o.type != msgpack::type::ARRAY || o.via.array.size != std::size(kMoments))
    return fail(fmt::format("is not a list of {} moments", std::size(kMoments)));
  uint32_t at = 0;
  get_moments(m, [&]() -> std::optional<double> {
    const msgpack::object& moment = entry(o, at++);
    if (moment.type == msgpack::type::POSITIVE_INTEGER) return double(moment.via.u64);
    if (moment.type == msgpack::type::NEGATIVE_INTEGER) return double(moment.via.i64);
    if (moment.type != msgpack::type::NIL) fail("has a moment that is no integer");
    return std::nullopt;
  });
}

void Decoder::get(const msgpack::object& o, std::vector<geometry::ChunkInfo>& chunks) {
  const size_t size = list_size(o, geometry::kMaxChunks);
  uint64_t children = 0;  // end of those of the chunks before
  for (size_t i = 0; i < size && !error_; ++i) {
    double v[12];
    if (!numbers(entry(o, i), v)) return;
    if (!all_single(std::span(v).subspan(3))) return fail("holds a chunk whose box is beyond single precision");
    if (!is_integer(v[0], double(i), double(i)) || !is_integer(v[1], 0, geometry::kMaxChunkTriangles) ||
        !is_integer(v[2], 0, kMaxBulkBytes))
      return fail("holds a chunk whose id, triangles or bytes are out of range");
    if (!is_integer(v[10], 0, double(i)) || !is_integer(v[11], 0, double(i)) || v[10] + v[11] > double(i) ||
        (v[11] > 0 && v[10] < double(children)) || !(v[9] >= 0) || (v[11] > 0) != (v[9] > 0))
      return fail("holds a chunk that is no node of a tree");
    if (v[11] > 0) children = uint64_t(v[10] + v[11]);
    chunks.push_back({ChunkId{uint64_t(v[0])},
                      {{v[3], v[4], v[5]}, {v[6], v[7], v[8]}},
                      uint64_t(v[1]),
                      uint64_t(v[2]),
                      float(v[9]),
                      uint32_t(v[10]),
                      uint32_t(v[11])});
  }
}

void Decoder::get(const msgpack::object& o, volume::ShearFrame& s) {
  constexpr uint32_t kLeast = kShearNumbers + kLayerNumbers;
  constexpr uint32_t kMost = kShearNumbers + kLayerNumbers * volume::kMaxLayers;
  if (o.type != msgpack::type::ARRAY) return fail("is not a list");
  const uint32_t size = o.via.array.size;
  if (size < kLeast || (size - kShearNumbers) % kLayerNumbers || size > kMost)
    return fail(fmt::format("is a list of {} numbers, limits {} and {}, three a layer", size, kLeast, kMost));
  const auto number = [&](uint32_t i) {
    double v = 0;
    if (!error_) get(entry(o, i), v);
    return v;
  };
  const auto integer = [&](uint32_t i, double lo, double hi) {
    const double v = number(i);
    if (!error_ && !is_integer(v, lo, hi))
      fail(fmt::format("has {} as number {}, not an integer in {} to {}", v, i, lo, hi));
    return error_ ? 0 : int(v);
  };
  s.axis = integer(0, 0, 2);
  s.direction = integer(1, -1, 1);
  s.eye = {number(2), number(3), number(4)};
  s.u0 = number(5), s.du = number(6), s.v0 = number(7), s.dv = number(8);
  s.width = integer(9, 1, volume::kMaxRasterSide);
  s.height = integer(10, 1, volume::kMaxRasterSide);
  for (uint32_t at = kShearNumbers; at < size && !error_; at += kLayerNumbers)
    s.layers.push_back({integer(at, 0, volume::kMaxSide), integer(at + 1, 0, volume::kMaxSide), number(at + 2)});
}

}  // namespace telesplat::wire
