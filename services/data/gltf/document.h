// Inside services/data/gltf: the JSON of a glTF file and the numbers that it refers to. Source: Khronos, "glTF 2.0
// Specification", sections 3.6 and 5.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/mapped_file.h"
#include "services/data/base/refusal.h"

namespace telesplat::data::gltf {

using Json = nlohmann::json;
using Bytes = std::span<const std::byte>;
// Refusals in this folder do not name the file: read_gltf() adds the name.

// Members of JSON values of any type: a missing member, or one of another type, gives null, nullopt or an empty text.
const Json& member(const Json& of, const char* key);
const Json& element(const Json& list, size_t i);
const Json& extension(const Json& of, const char* name);
std::optional<size_t> index(const Json& of, const char* key);
std::string text(const Json& of, const char* key);
double number(const Json& of, const char* key, double otherwise);
/// Returns the first N numbers of a list that has at least N; else `otherwise`.
template <size_t N>
std::array<double, N> numbers(const Json& of, const char* key, std::array<double, N> otherwise) {
  const Json& list = member(of, key);
  if (!list.is_array() || list.size() < N) return otherwise;
  for (size_t i = 0; i < N; ++i) otherwise[i] = list[i].is_number() ? list[i].get<double>() : otherwise[i];
  return otherwise;
}

/// Numbers of an accessor: `width` per element; width 0: no numbers. Copies share them.
struct Values {
  int width = 0;
  std::shared_ptr<std::vector<float>> numbers;

  size_t count() const { return width ? numbers->size() / size_t(width) : 0; }
  const float* operator[](size_t i) const { return numbers->data() + i * size_t(width); }
};

/// Returns the factor that scales a stored integer of this component type to 0..1 or -1..1; 1: floats. Refuses others.
double normalising_scale(size_t component_type);

class Document {
 public:
  /// Refuses a file that is cut off, of another version, or without valid JSON. content, companions: outlive this.
  Document(std::string_view content, Companions& companions);

  const Json& list(const char* kind) const { return member(root_, kind); }
  const Json& at(const char* kind, size_t i) const { return element(list(kind), i); }
  const Json& root() const { return root_; }

  /// Returns a buffer view, unpacked. It stays valid as long as this object. Refuses one that exceeds its buffer.
  Bytes view(size_t i);
  /// Returns an accessor's elements of `width` numbers (0: as many as it has), normalised if it says so, with sparse
  /// ones filled in. Refuses elements beyond its buffer view; no memory is allocated by a count alone.
  Values values(size_t accessor, int width);
  /// The same for integers.
  std::vector<uint32_t> indices(size_t accessor);
  /// Returns the number of bytes in the file and in the buffers that exist.
  uint64_t bytes_of_files();
  /// Returns the content of a URI: data within it, or a file's. It stays valid as long as this object. Error: the data
  /// are not base64, or Companions::read() failed.
  Result<std::string_view> resource(const std::string& uri);

 private:
  Bytes buffer(size_t i);
  template <class To>
  int read(size_t accessor, int width, std::vector<To>& out);
  template <class To>
  void copy(size_t view, const Json& of, size_t type, int width, bool normalised, std::span<To> out);

  const std::string_view content_;
  Companions& companions_;
  Json root_;
  std::map<std::string, std::string> decoded_;         // data within URIs, by URI
  std::map<size_t, std::vector<std::byte>> unpacked_;  // by buffer view
  std::map<size_t, Values> recent_;                    // by accessor: primitives may share a long one
};

}  // namespace telesplat::data::gltf
