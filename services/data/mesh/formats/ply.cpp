#include "services/data/mesh/formats/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "common/scene/colouring.h"
#include "services/data/base/mesh.h"
#include "services/data/base/polygons/double_vertices.h"
#include "services/data/base/text_scanner.h"
#include "services/data/texture/bake.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 20, kMaxElements = 64, kMaxProperties = 256, kMaxTextures = 1024;

using enum StoredType;
constexpr TypeName kTypes[] = {{"char", kI8},     {"int8", kI8},    {"uchar", kU8},   {"uint8", kU8},   {"short", kI16},
                               {"int16", kI16},   {"ushort", kU16}, {"uint16", kU16}, {"int", kI32},    {"int32", kI32},
                               {"uint", kU32},    {"uint32", kU32}, {"int64", kI64},  {"uint64", kU64}, {"float", kF32},
                               {"float32", kF32}, {"double", kF64}, {"float64", kF64}};

// Returns the words of one header line, at most six.
std::vector<std::string_view> split(TextScanner& scan) {
  std::vector<std::string_view> words;
  while (words.size() < 6 && scan.skip_blanks()) words.push_back(scan.word());
  scan.next_line();
  return words;
}

// Adds the property of one "property ..." line to its element.
void parse_property(const std::vector<std::string_view>& words, PlyElement& element, const std::string& where) {
  PlyProperty property;
  property.is_list = words.size() == 5 && words[1] == "list";
  if (!property.is_list && words.size() != 3)
    refuse("{}: a property line is 'property TYPE NAME' or 'property list TYPE TYPE NAME'", where);
  const auto type = type_named(words[words.size() - 2], kTypes);
  const auto count_type = property.is_list ? type_named(words[2], kTypes) : StoredType::kU8;
  if (!type || !count_type || *count_type >= StoredType::kF32)
    refuse("{}: unknown or unfit type in property '{}'", where, words.back());
  if (element.properties.size() == kMaxProperties)
    refuse("{}: more than {} properties in element '{}'", where, kMaxProperties, element.name);
  property.type = *type;
  property.count_type = *count_type;
  property.name = words.back();
  element.properties.push_back(std::move(property));
}

void parse_encoding(std::string_view word, PlyHeader& header, const std::string& where) {
  if (word == "ascii")
    header.encoding = PlyEncoding::kAscii;
  else if (word == "binary_little_endian")
    header.encoding = PlyEncoding::kLittleEndian;
  else if (word == "binary_big_endian")
    header.encoding = PlyEncoding::kBigEndian;
  else
    refuse("{}: unknown PLY format '{}'", where, word);
}

void parse_element(const std::vector<std::string_view>& words, PlyHeader& header, const std::string& where) {
  TextScanner number(words[2]);
  int64_t count = -1;
  if (!number.integer(count) || !number.at_end() || count < 0)
    refuse("{}: element count '{}' is not a number from 0 on", where, words[2]);
  if (header.elements.size() == kMaxElements) refuse("{}: more than {} elements", where, kMaxElements);
  header.elements.push_back({std::string(words[1]), static_cast<uint64_t>(count), {}});
}

// Refuses counts that the bytes after the header cannot hold.
void check_counts(const PlyHeader& header, size_t file_bytes, const std::string& name) {
  const uint64_t data_bytes = file_bytes - header.bytes;
  uint64_t needed = 0;
  for (const PlyElement& element : header.elements) {
    const uint64_t least = element.least_bytes(header.encoding);
    if (element.count == 0) continue;
    if (least == 0) refuse("{}: element '{}' has no properties", name, element.name);
    if (element.count > data_bytes / least + 1)
      refuse("{}: header claims {} of element '{}' ({} bytes or more each), but only {} bytes follow it", name,
             element.count, element.name, least, data_bytes);
    needed += element.count * least;
    if (needed > data_bytes + 1)  // a text file's last number needs no separator
      refuse("{}: is truncated: header claims elements of {} bytes or more, but only {} bytes follow it", name, needed,
             data_bytes);
  }
}

}  // namespace

int PlyElement::find(std::string_view property) const {
  for (size_t i = 0; i < properties.size(); ++i)
    if (properties[i].name == property) return static_cast<int>(i);
  return -1;
}

size_t PlyElement::least_bytes(PlyEncoding encoding) const {
  size_t bytes = 0;
  for (const PlyProperty& p : properties)
    bytes += encoding == PlyEncoding::kAscii ? 2 : stored_bytes(p.is_list ? p.count_type : p.type);
  return bytes;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
  for (const PlyElement& e : elements)
    if (e.name == element) return &e;
  return nullptr;
}

PlyHeader parse_ply_header(std::string_view content, const std::string& name) {
  std::string text(content.substr(0, kMaxHeaderBytes));
  if (text.starts_with("ply\r") && !text.starts_with("ply\r\n")) std::replace(text.begin(), text.end(), '\r', '\n');
  TextScanner scan(text);
  if (scan.word() != "ply") refuse("{}: does not start with 'ply'", name);
  scan.next_line();
  PlyHeader header;
  bool has_format = false;
  for (int line = 2;; ++line) {
    const std::string where = fmt::format("{}:{}", name, line);
    if (scan.at_end()) refuse("{}: PLY header has no 'end_header'", name);
    const std::string_view rest = std::string_view(text).substr(scan.offset());
    const auto words = split(scan);
    if (words.size() > 2 && words[0] == "comment" && words[1] == "TextureFile" && header.textures.size() < kMaxTextures)
      header.textures.push_back(rest_of_line(rest, size_t(words[2].data() - rest.data())));
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() >= 2) {
      parse_encoding(words[1], header, where);
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      parse_element(words, header, where);
    } else if (words[0] == "property" && !header.elements.empty()) {
      parse_property(words, header.elements.back(), where);
    } else {
      refuse("{}: '{}' is no PLY header line", where, words[0].substr(0, 40));
    }
  }
  if (!has_format) refuse("{}: PLY header has no format line", name);
  header.bytes = scan.offset();
  check_counts(header, content.size(), name);
  return header;
}

PlyArrays::PlyArrays(const PlyHeader& header, const std::function<bool(const PlyElement&, std::string_view)>& is_taken)
    : header_(header) {
  for (const PlyElement& element : header.elements) {
    const bool vertices = element.name == "vertex", faces = element.name == "face";
    std::vector<int>& of = of_element_.emplace_back(element.properties.size(), -1);
    for (size_t i = 0; i < of.size() && (vertices || faces); ++i) {
      const PlyProperty& p = element.properties[i];
      if (p.is_list || is_taken(element, p.name)) continue;
      of[i] = int(arrays_.size());
      arrays_.push_back({p.name, "", faces, 1, {scene::ValueSpan{}}});
    }
  }
  scene::make_tellable(arrays_);
  for (auto& of : of_element_)  // properties beyond the limit have no array
    for (int& array : of)
      if (array >= int(arrays_.size())) array = -1;
}

void PlyArrays::choose(const std::string& text, const std::string& file) {
  const auto choice = scene::choose_array(arrays_, text);
  if (!choice) refuse("{}: {}", file, choice.error().text);
  chosen_ = int(choice->index);
}

const std::vector<int>& PlyArrays::arrays_of(const PlyElement& element) const {
  return of_element_[size_t(&element - header_.elements.data())];
}

void PlyArrays::finish(Mesh& mesh) {
  if (chosen_ >= 0) {
    const double origin = scene::scalar_origin(arrays_[size_t(chosen_)].spans[0]);
    values_.resize(faces_chosen() ? mesh.indices.size() / 3 : mesh.positions.size(), kMissing);
    mesh.scalars.reserve(values_.size());
    for (const double v : values_) mesh.scalars.push_back(scene::stored_scalar(v, origin));
    mesh.scalars_of_faces = faces_chosen();
  }
  mesh.arrays = std::move(arrays_);
}

void PlyTextures::add_corner(double texture, glm::vec2 place) {
  const bool named = texture >= 0 && texture < kNoTexture && place == place;
  corners_.push_back(named ? Corner{uint32_t(texture), {place.x, 1 - place.y}} : Corner{kNoTexture, {0, 0}});
}

void PlyTextures::bake(Mesh& mesh, const std::vector<std::string>& pictures, const std::string& name,
                       Companions& companions, uint64_t texture_detail) const {
  NamedTextures textures(name, companions);
  std::vector<uint32_t> numbers;
  for (const std::string& picture : pictures) {
    const auto number = textures.number_of(picture, Wrap::kRepeat);
    numbers.push_back(number);
  }
  mesh.notes.insert(mesh.notes.end(), textures.notes().begin(), textures.notes().end());
  if (textures.all().empty()) return;

  std::vector<Corner> looks(mesh.positions.size(), Corner{kNoTexture, {0, 0}});
  double_vertices(
      mesh, [&](uint32_t vertex, size_t corner) { return looks[vertex] == corners_[corner]; },
      [&](uint32_t vertex, size_t corner) {
        if (vertex == looks.size()) looks.emplace_back();
        looks[vertex] = corners_[corner];
      });
  mesh.colours.resize(mesh.positions.size(), kNeutralAlbedo);
  TextureUse use{textures.all(), {}, {}};
  for (size_t v = 0; v < looks.size(); ++v) {
    use.texture.push_back(looks[v].picture < numbers.size() ? numbers[looks[v].picture] : kNoTexture);
    use.uv.push_back(looks[v].place);
    if (use.texture[v] != kNoTexture) mesh.colours[v] = 0xffffff;
  }
  if (!drop_not_finite(mesh, name)) return;
  if (const std::string note = bake_textures(mesh, std::move(use), texture_detail); !note.empty())
    mesh.notes.push_back(name + ": " + note);
}

}  // namespace telesplat::data
