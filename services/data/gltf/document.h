// Inside services/data/gltf: the JSON of a glTF file and the numbers that it leads to. Source: Khronos, "glTF 2.0
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
// Refusals in this folder do not name the file: read_gltf() does.

// Members of JSON values, which may be of any type: what is absent or of another type is null, nothing, empty.
const Json& member(const Json& of, const char* key);
const Json& element(const Json& list, size_t i);
const Json& extension(const Json& of, const char* name);
std::optional<size_t> index(const Json& of, const char* key);
std::string text(const Json& of, const char* key);
double number(const Json& of, const char* key, double otherwise);
/// The first N numbers of a list that has as many; else `otherwise`.
template <size_t N>
std::array<double, N> numbers(const Json& of, const char* key, std::array<double, N> otherwise) {
  const Json& list = member(of, key);
  if (!list.is_array() || list.size() < N) return otherwise;
  for (size_t i = 0; i < N; ++i) otherwise[i] = list[i].is_number() ? list[i].get<double>() : otherwise[i];
  return otherwise;
}

/// Numbers of an accessor: `width` an element; width 0: none. Copies share them.
struct Values {
  int width = 0;
  std::shared_ptr<std::vector<float>> numbers;

  size_t count() const { return width ? numbers->size() / size_t(width) : 0; }
  const float* operator[](size_t i) const { return numbers->data() + i * size_t(width); }
};

/// What makes a stored integer of this component type a number of 0..1 or -1..1; 1 for floats. Refuses other types.
double normalising_scale(size_t component_type);

class Document {
 public:
  /// Refuses: a file that is cut off, of another version, without sound JSON. content, companions: outlive this.
  Document(std::string_view content, Companions& companions);

  const Json& list(const char* kind) const { return member(root_, kind); }
  const Json& at(const char* kind, size_t i) const { return element(list(kind), i); }
  const Json& root() const { return root_; }

  /// A buffer view, unpacked. It stays valid as long as this object. Refuses one that exceeds its buffer.
  Bytes view(size_t i);
  /// An accessor's elements of `width` numbers (0: as many as it has), normalised where it says so, sparse ones put in.
  /// Refuses what its buffer view does not hold; nothing is allocated by a count alone.
  Values values(size_t accessor, int width);
  /// The same of whole numbers.
  std::vector<uint32_t> indices(size_t accessor);
  /// Bytes in the file and in the buffers that are there.
  uint64_t bytes_of_files();
  /// What a URI stands for: text within it, or a file. It stays valid as long as this object. Error: text within that
  /// is no base64, or Companions::read().
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
  std::map<std::string, std::string> decoded_;         // what stands in texts, by these
  std::map<size_t, std::vector<std::byte>> unpacked_;  // by buffer view
  std::map<size_t, Values> recent_;                    // by accessor: primitives may share a long one
};

}  // namespace telesplat::data::gltf
