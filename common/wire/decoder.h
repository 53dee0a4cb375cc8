// Reads messages from msgpack maps, every value against its limits. Private to this library.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <msgpack/object_fwd.hpp>
#include <optional>
#include <string>
#include <type_traits>

#include "common/core/result.h"
#include "common/wire/fields.h"
#include "common/wire/messages.h"

namespace telesplat::wire {

/// A visitor of fields(): fills each from the map. After the first error it reads nothing more.
class Decoder {
 public:
  explicit Decoder(const msgpack::object& map) : map_(map) {}

  /// From now on reads a brief message (kIsBrief): keys are numbers instead of names, and a missing field keeps its
  /// value, without an error.
  void be_brief() { brief_ = true; }

  /// The first error: names the field and the problem.
  const std::optional<Error>& error() const { return error_; }

  /// True if the map has a field of this name.
  bool has(std::string_view name) const;

  template <class T>
  void operator()(const char* name, T& value, size_t limit = 0) {
    if (const msgpack::object* o = enter(name, limit)) get(*o, value);
  }

 private:
  /// Returns the value of the field that is read from now on; null if the map lacks the field.
  const msgpack::object* enter(const char* name, size_t limit);
  void fail(std::string_view why);
  bool within(size_t size, size_t limit);
  bool is_map(const msgpack::object& o);
  /// Returns the number of entries of a list; 0, and an error, if it is no list or has more than `limit`.
  size_t list_size(const msgpack::object& o, size_t limit);
  static const msgpack::object& entry(const msgpack::object& list, size_t i);
  bool numbers(const msgpack::object& o, std::span<double> out);
  static bool all_single(std::span<const double> v);
  template <class T>
  void get_bin(const msgpack::object& o, std::vector<T>& v, size_t max_entries);
  template <class V>
  void get_map(const msgpack::object& o, std::map<std::string, V>& v);

  void get(const msgpack::object& o, bool& v);
  void get(const msgpack::object& o, uint64_t& v);
  void get(const msgpack::object& o, double& v);
  /// Precondition: the field's limit is the number of values of E.
  template <class E>
  requires std::is_enum_v<E>
  void get(const msgpack::object& o, E& v) {
    uint64_t number = 0;
    get(o, number);
    if (number >= limit_) return fail("is not one of its values");
    v = static_cast<E>(number);
  }
  void get(const msgpack::object& o, std::string& v);
  void get(const msgpack::object& o, std::vector<std::string>& v);
  void get(const msgpack::object& o, std::map<std::string, std::string>& v);
  void get(const msgpack::object& o, std::map<std::string, double>& v);
  void get(const msgpack::object& o, Bytes& v);
  void get(const msgpack::object& o, std::vector<uint32_t>& v);
  void get(const msgpack::object& o, std::vector<double>& v);
  template <size_t N>
  void get(const msgpack::object& o, std::array<double, N>& v) {
    numbers(o, v);
  }
  void get(const msgpack::object& o, geometry::Box& b);
  void get(const msgpack::object& o, geometry::Rect& r);
  void get(const msgpack::object& o, geometry::Pose& p);
  void get(const msgpack::object& o, geometry::Camera& c);
  void get(const msgpack::object& o, Moments& m);
  void get_moments(Moments& m, const std::function<std::optional<double>()>& next);
  void get(const msgpack::object& o, std::vector<geometry::ChunkInfo>& chunks);
  void get(const msgpack::object& o, volume::ShearFrame& s);
  template <class Tag>
  void get(const msgpack::object& o, Id<Tag>& v) {
    get(o, v.value);
  }
  template <Struct M>
  void get(const msgpack::object& o, M& m) {
    if (!is_map(o)) return;
    Decoder inner(o);
    M::fields(inner, m);
    if (inner.error_) fail(": " + inner.error_->text);
  }
  template <Struct M>
  void get(const msgpack::object& o, std::vector<M>& v) {
    v.resize(list_size(o, limit_));
    for (size_t i = 0; i < v.size() && !error_; ++i) get(entry(o, i), v[i]);
  }

  const msgpack::object& map_;
  bool brief_ = false;
  uint64_t number_ = 0;  // number of the next field, if the message is brief
  const char* name_ = "";
  size_t limit_ = 0;
  std::optional<Error> error_;
};

/// Calls `read` with a body that is one msgpack map, of any version or without one. Error: the body is no such map, or
/// its lists and maps have more than max_elements elements.
std::optional<Error> read_any(Bytes body, size_t max_elements,
                              const std::function<std::optional<Error>(const msgpack::object&)>& read);

/// The version in a body; nothing if the body is no map or has none.
std::optional<uint64_t> version_of(Bytes body);

/// Reads a body: one msgpack map of this protocol's version, whose fields `read` takes, with at most max_elements
/// elements in all lists and maps. `read` may return an error of its own. Bulk fields point into `body`.
std::optional<Error> read_map(Bytes body, size_t max_elements,
                              const std::function<std::optional<Error>(Decoder&)>& read);

}  // namespace telesplat::wire
