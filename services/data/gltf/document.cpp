#include "services/data/gltf/document.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "services/data/gltf/container.h"
#include "services/data/gltf/packed.h"

namespace telesplat::data::gltf {
namespace {

const Json kNothing;
constexpr const char* kMeshopt[] = {"EXT_meshopt_compression", "KHR_meshopt_compression"};

// By component type from 5120 on: bytes, and the largest integer value.
struct Component {
  size_t bytes;
  double largest;
};
constexpr size_t kByte = 5120, kUbyte = 5121, kShort = 5122, kUshort = 5123, kUint = 5125, kFloat = 5126;
constexpr Component kComponents[] = {{1, 127}, {1, 255}, {2, 32767}, {2, 65535}, {}, {4, 4294967295}, {4, 1}};

const Component& component(size_t type) {
  const size_t i = type - kByte;
  if (i >= std::size(kComponents) || kComponents[i].bytes == 0) refuse("component type {} is not one of glTF's", type);
  return kComponents[i];
}

int width_of(const std::string& type) {
  constexpr std::pair<std::string_view, int> kTypes[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                         {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};
  for (const auto& [name, width] : kTypes)
    if (type == name) return width;
  refuse("accessor type '{}' is not one of glTF's", type);
}

template <class From, class To>
void copy_as(const std::byte* from, size_t stride, int width, double scale, std::span<To> out) {
  const size_t count = out.size() / size_t(width);
  for (size_t i = 0; i < count; ++i, from += stride)
    for (int k = 0; k < width; ++k) {
      From value;
      std::memcpy(&value, from + size_t(k) * sizeof value, sizeof value);
      To& to = out[i * size_t(width) + size_t(k)];
      if constexpr (std::is_integral_v<To> || std::is_floating_point_v<From>)
        to = To(value);
      else
        to = scale == 1 ? To(value) : To(std::max(value * scale, -1.0));
    }
}

std::optional<std::string> from_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<uint8_t, 256> values;
  values.fill(64);
  for (size_t i = 0; i < kDigits.size(); ++i) values[uint8_t(kDigits[i])] = uint8_t(i);
  std::string out;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    const uint32_t digit = values[uint8_t(c)];
    if (digit == 64) return std::nullopt;
    bits = bits << 6 | digit;
    if ((count += 6) >= 8) out += char(bits >> (count -= 8) & 255);
  }
  return out;
}

void check_glb(std::string_view content) {
  if (!content.starts_with("glTF")) return;
  if (content.size() < 20) refuse("{} bytes are too few for a GLB file", content.size());
  uint32_t words[4];
  std::memcpy(words, content.data(), sizeof words);
  if (words[1] != 2) refuse("is glTF version {}, only 2 is read", words[1]);
  if (words[2] > content.size())
    refuse("is truncated: its header claims {} bytes, it has {}", words[2], content.size());
  if (gltf_json(content).empty()) refuse("its JSON chunk claims {} bytes, the file has {}", words[3], content.size());
}

}  // namespace

const Json& member(const Json& of, const char* key) {
  const auto found = of.is_object() ? of.find(key) : of.end();
  return of.is_object() && found != of.end() ? *found : kNothing;
}
const Json& element(const Json& list, size_t i) { return list.is_array() && i < list.size() ? list[i] : kNothing; }
const Json& extension(const Json& of, const char* name) { return member(member(of, "extensions"), name); }
std::optional<size_t> index(const Json& of, const char* key) {
  const Json& value = member(of, key);
  if (value.is_number_unsigned()) return value.get<size_t>();
  // Some programs write integers as 3.0.
  const double number = value.is_number_float() ? value.get<double>() : -1;
  return number >= 0 && number < 1e15 && number == double(size_t(number)) ? std::optional(size_t(number))
                                                                          : std::nullopt;
}
std::string text(const Json& of, const char* key) {
  const Json& value = member(of, key);
  return value.is_string() ? value.get<std::string>() : std::string();
}
double number(const Json& of, const char* key, double otherwise) {
  const Json& value = member(of, key);
  return value.is_number() ? value.get<double>() : otherwise;
}

double normalising_scale(size_t component_type) { return 1 / component(component_type).largest; }

Document::Document(std::string_view content, Companions& companions) : content_(content), companions_(companions) {
  check_glb(content);
  if (!gltf_json_fits(content)) refuse("its glTF JSON has more than {} bytes outside of texts", kMostGltfJson);
  root_ = Json::parse(gltf_json(content), nullptr, false);
  if (!root_.is_object()) refuse("its glTF JSON is damaged");
  const std::string version = text(member(root_, "asset"), "version");
  if (!version.empty() && !version.starts_with("2."))
    refuse("is glTF version {}, only 2 is read", version.substr(0, 20));
}

Result<std::string_view> Document::resource(const std::string& uri) {
  if (!uri.starts_with("data:")) {
    auto file = companions_.read(uri_file(uri));
    if (file || uri_file(uri) == uri) return file;
    const auto as_it_stands = companions_.read(uri);
    return as_it_stands ? as_it_stands : file;
  }
  const auto [at, added] = decoded_.try_emplace(uri);
  if (added) {
    auto decoded = from_base64(std::string_view(uri).substr(std::min(uri.find(',') + 1, uri.size())));
    if (!decoded) {
      decoded_.erase(at);
      return Error{"is no base64 text"};
    }
    at->second = std::move(*decoded);
  }
  return std::string_view(at->second);
}

Bytes Document::buffer(size_t i) {
  const Json& buffer = at("buffers", i);
  if (!buffer.is_object()) refuse("names buffer {}, there are {}", i, list("buffers").size());
  const std::string uri = text(buffer, "uri");
  // A buffer without a URI is the second chunk of a GLB, or holds the place of unpacked compressed views.
  const auto data = !uri.empty()                             ? resource(uri)
                    : i == 0 && content_.starts_with("glTF") ? Result<std::string_view>(glb_binary(content_))
                                                             : Result<std::string_view>(std::string_view());
  if (!data) refuse("needs a file that is missing: buffer {}: {}", i, data.error().text);
  return std::as_bytes(std::span(*data));
}

uint64_t Document::bytes_of_files() {
  uint64_t sum = content_.size();
  for (size_t i = 0; i < list("buffers").size(); ++i)
    if (const std::string uri = text(at("buffers", i), "uri"); !uri.empty())
      if (const auto data = resource(uri)) sum += data->size();
  return sum;
}

Bytes Document::view(size_t i) {
  if (const auto found = unpacked_.find(i); found != unpacked_.end()) return found->second;
  const Json& view = at("bufferViews", i);
  if (!view.is_object()) refuse("names buffer view {}, there are {}", i, list("bufferViews").size());
  const auto slice = [&](const Json& of) {
    const size_t number = index(of, "buffer").value_or(~size_t{0});
    const size_t offset = index(of, "byteOffset").value_or(0), length = index(of, "byteLength").value_or(0);
    const Bytes data = buffer(number);
    if (offset > data.size() || length > data.size() - offset)
      refuse("buffer view {} claims {} bytes from {} on, buffer {} has {}", i, length, offset, number, data.size());
    return data.subspan(offset, length);
  };
  for (const char* name : kMeshopt)
    if (const Json& packed = extension(view, name); packed.is_object()) try {
        return unpacked_[i] = decode_meshopt(
                   slice(packed), {index(packed, "count").value_or(0), index(packed, "byteStride").value_or(0),
                                   text(packed, "mode"), text(packed, "filter")});
      } catch (const Refusal& refusal) {
        refuse("buffer view {}: its {} is damaged: {}", i, name, refusal.text);
      }
  return slice(view);
}

template <class To>
void Document::copy(size_t view_index, const Json& of, size_t type, int width, bool normalised, std::span<To> out) {
  const Bytes data = view(view_index);
  const size_t offset = index(of, "byteOffset").value_or(0), element = component(type).bytes * size_t(width);
  const Json& layout = at("bufferViews", view_index);
  size_t stride = index(layout, "byteStride").value_or(0);
  for (const char* name : kMeshopt)
    if (stride == 0) stride = index(extension(layout, name), "byteStride").value_or(0);
  if (stride == 0) stride = element;
  const size_t count = out.size() / size_t(width);
  if (count == 0) return;
  if (offset > data.size() || element > data.size() - offset || (count - 1) > (data.size() - offset - element) / stride)
    refuse("{} elements of {} bytes, each {}, from {} on exceed the {} bytes of buffer view {}", count, element, stride,
           offset, data.size(), view_index);
  const double scale = normalised ? normalising_scale(type) : 1;
  const std::byte* from = data.data() + offset;
  if (type == kByte) copy_as<int8_t>(from, stride, width, scale, out);
  if (type == kUbyte) copy_as<uint8_t>(from, stride, width, scale, out);
  if (type == kShort) copy_as<int16_t>(from, stride, width, scale, out);
  if (type == kUshort) copy_as<uint16_t>(from, stride, width, scale, out);
  if (type == kUint) copy_as<uint32_t>(from, stride, width, scale, out);
  if constexpr (std::is_floating_point_v<To>)
    if (type == kFloat) copy_as<float>(from, stride, width, scale, out);
}

template <class To>
int Document::read(size_t number, int width, std::vector<To>& out) {
  const Json& accessor = at("accessors", number);
  if (!accessor.is_object()) refuse("names accessor {}, there are {}", number, list("accessors").size());
  const size_t type = index(accessor, "componentType").value_or(0);
  const int own = width_of(text(accessor, "type"));
  const auto count = index(accessor, "count");
  if (!count) refuse("accessor {} has no count", number);
  if (width && own != width) refuse("accessor {} is of type {}", number, text(accessor, "type"));
  if (std::is_integral_v<To> && type == kFloat) refuse("accessor {} is of floating point numbers", number);
  const auto view_index = index(accessor, "bufferView");
  // Elements may overlap, so a view of few bytes can hold many; zeros need no view at all.
  const uint64_t most = view_index ? view(*view_index).size() : bytes_of_files();
  if (*count > most) refuse("accessor {} claims {} elements, its files have {} bytes", number, *count, most);
  out.assign(*count * size_t(own), To{});
  const bool normalised = member(accessor, "normalized") == true;
  if (view_index) copy<To>(*view_index, accessor, type, own, normalised, out);
  const Json& sparse = member(accessor, "sparse");
  if (!sparse.is_object()) return own;
  const size_t changed = index(sparse, "count").value_or(0);
  const Json &where = member(sparse, "indices"), &what = member(sparse, "values");
  if (changed > *count) refuse("accessor {} has {} elements, of which {} are sparse", number, *count, changed);
  std::vector<uint32_t> places(changed);
  std::vector<To> values(changed * size_t(own));
  const size_t place_type = index(where, "componentType").value_or(0);
  if (place_type == kFloat) refuse("accessor {}: its sparse indices are floating point numbers", number);
  copy<uint32_t>(index(where, "bufferView").value_or(~size_t{0}), where, place_type, 1, false, places);
  copy<To>(index(what, "bufferView").value_or(~size_t{0}), what, type, own, normalised, values);
  for (size_t i = 0; i < changed; ++i) {
    if (places[i] >= *count) refuse("accessor {}: sparse index {} exceeds its {} elements", number, places[i], *count);
    std::copy_n(values.begin() + std::ptrdiff_t(i * size_t(own)), own,
                out.begin() + std::ptrdiff_t(places[i] * size_t(own)));
  }
  return own;
}

Values Document::values(size_t accessor, int width) {
  constexpr size_t kMostRecent = 16;
  if (recent_.size() >= kMostRecent && !recent_.contains(accessor)) recent_.clear();
  Values& out = recent_[accessor];
  if (!out.numbers || (width && width != out.width)) {
    out.numbers = std::make_shared<std::vector<float>>();
    out.width = read(accessor, width, *out.numbers);
  }
  return out;
}

std::vector<uint32_t> Document::indices(size_t accessor) {
  std::vector<uint32_t> out;
  read(accessor, 1, out);
  return out;
}

}  // namespace telesplat::data::gltf
