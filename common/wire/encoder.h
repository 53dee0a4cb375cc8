// Writes messages as msgpack maps. Private to this library.
#pragma once

#include <concepts>
#include <map>
#include <string>
#include <type_traits>

#include "common/wire/fields.h"
#include "common/wire/messages.h"

namespace telesplat::wire {

/// A visitor of fields(): appends each to `out`.
class Encoder {
 public:
  explicit Encoder(std::string& out) : out_(out) {}

  /// Writes a whole message: "v", then its fields; a brief message names its fields by number.
  template <Struct M>
  void versioned_map(const M& m, uint64_t version = kProtocolVersion) {
    const Blank<M> blank(m);
    brief_ = kIsBrief<M>;
    uint32_t count = 1;
    auto counter = [&](const char*, const auto& value, size_t = 0) { count += !blank(value); };
    M::fields(counter, m);
    begin_map(count);
    put_version(version);
    uint64_t number = 0;
    auto writer = [&](const char* name, const auto& value, size_t = 0) {
      const uint64_t n = number++;
      if (blank(value)) return;
      if constexpr (kIsBrief<M>)
        put(n), put(value);
      else
        (*this)(name, value);
    };
    M::fields(writer, m);
  }

  template <class T>
  void operator()(const char* name, const T& value, size_t /*limit*/ = 0) {
    put_text(name);
    put(value);
  }

 private:
  /// Finds the fields of a brief message that need not be sent: they hold the same values as in a new message.
  template <class M>
  class Blank {
   public:
    explicit Blank(const M& m) : m_(m) {}
    template <class T>
    bool operator()(const T& value) const {
      if constexpr (kIsBrief<M> && std::equality_comparable<T>) {
        static const M kNew;
        const auto place = reinterpret_cast<const char*>(&value) - reinterpret_cast<const char*>(&m_);
        return value == *reinterpret_cast<const T*>(reinterpret_cast<const char*>(&kNew) + place);
      }
      return false;
    }

   private:
    const M& m_;
  };

  template <class M>
  static uint32_t count_fields(const M& m) {
    uint32_t count = 0;
    auto counter = [&](const char*, const auto&, size_t = 0) { ++count; };
    M::fields(counter, m);
    return count;
  }
  void begin_map(uint32_t entries);
  void begin_array(uint32_t entries);
  void put_version(uint64_t version);
  void numbers(std::span<const double> values);
  void numbers(std::initializer_list<double> values) { numbers(std::span(values.begin(), values.size())); }
  void put_text(std::string_view text);

  void put(bool v);
  void put(uint64_t v);
  void put(double v);
  template <class E>
  requires std::is_enum_v<E>
  void put(E v) { put(static_cast<uint64_t>(v)); }
  void put(const std::string& v) { put_text(v); }
  void put(const std::vector<std::string>& v);
  void put(const std::map<std::string, std::string>& v);
  void put(const std::map<std::string, double>& v);
  void put(Bytes v);
  void put(const std::vector<uint32_t>& v) { put(std::as_bytes(std::span(v))); }
  void put(const std::vector<double>& v) { put(std::as_bytes(std::span(v))); }
  void put(const geometry::Box& b);
  void put(const geometry::Rect& r);
  void put(const geometry::Pose& p);
  void put(const geometry::Camera& c);
  void put(const Moments& m);
  void put(const std::vector<geometry::ChunkInfo>& chunks);
  void put(const volume::ShearFrame& s);
  template <class Tag>
  void put(Id<Tag> v) {
    put(v.value);
  }
  template <Struct M>
  void put(const M& m) {
    begin_map(count_fields(m));
    M::fields(*this, m);
  }
  template <Struct M>
  void put(const std::vector<M>& structs) {
    begin_array(static_cast<uint32_t>(structs.size()));
    for (const M& m : structs) put(m);
  }

  std::string& out_;
  bool brief_ = false;
};

}  // namespace telesplat::wire
