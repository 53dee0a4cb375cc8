#include "services/data/mesh/formats/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "services/data/base/mesh.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 20, kMaxElements = 64, kMaxProperties = 256, kMaxTextures = 1024;

std::optional<PlyType> parse_type(std::string_view word) {
  constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::kInt8},       {"int8", PlyType::kInt8},      {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},     {"short", PlyType::kInt16},    {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},   {"uint16", PlyType::kUint16},  {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},     {"uint", PlyType::kUint32},    {"uint32", PlyType::kUint32},
      {"int64", PlyType::kInt64},     {"uint64", PlyType::kUint64},  {"float", PlyType::kFloat32},
      {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64}, {"float64", PlyType::kFloat64}};
  for (const auto& [name, type] : kNames)
    if (name == word) return type;
  return std::nullopt;
}

bool is_integer(PlyType type) { return type != PlyType::kFloat32 && type != PlyType::kFloat64; }

// The words of one header line, at most six.
std::vector<std::string_view> split(TextScanner& scan) {
  std::vector<std::string_view> words;
  while (words.size() < 6 && scan.skip_blanks()) words.push_back(scan.word());
  scan.next_line();
  return words;
}

// One "property ..." line into its element.
Status parse_property(const std::vector<std::string_view>& words, PlyElement& element, const std::string& where) {
  PlyProperty property;
  property.is_list = words.size() == 5 && words[1] == "list";
  if (!property.is_list && words.size() != 3)
    return Error{where + ": a property line is 'property TYPE NAME' or 'property list TYPE TYPE NAME'"};
  const auto type = parse_type(words[words.size() - 2]);
  const auto count_type = property.is_list ? parse_type(words[2]) : PlyType::kUint8;
  if (!type || !count_type || !is_integer(*count_type))
    return Error{fmt::format("{}: unknown or unfit type in property '{}'", where, words.back())};
  if (element.properties.size() == kMaxProperties)
    return Error{fmt::format("{}: more than {} properties in element '{}'", where, kMaxProperties, element.name)};
  property.type = *type;
  property.count_type = *count_type;
  property.name = words.back();
  element.properties.push_back(std::move(property));
  return ok_status();
}

Status parse_encoding(std::string_view word, PlyHeader& header, const std::string& where) {
  if (word == "ascii")
    header.encoding = PlyEncoding::kAscii;
  else if (word == "binary_little_endian")
    header.encoding = PlyEncoding::kLittleEndian;
  else if (word == "binary_big_endian")
    header.encoding = PlyEncoding::kBigEndian;
  else
    return Error{fmt::format("{}: unknown PLY format '{}'", where, word)};
  return ok_status();
}

Status parse_element(const std::vector<std::string_view>& words, PlyHeader& header, const std::string& where) {
  TextScanner number(words[2]);
  int64_t count = -1;
  if (!number.integer(count) || !number.at_end() || count < 0)
    return Error{fmt::format("{}: element count '{}' is not a number from 0 on", where, words[2])};
  if (header.elements.size() == kMaxElements)
    return Error{fmt::format("{}: more than {} elements", where, kMaxElements)};
  header.elements.push_back({std::string(words[1]), static_cast<uint64_t>(count), {}});
  return ok_status();
}

// Refuses counts that the bytes after the header cannot hold.
Status check_counts(const PlyHeader& header, size_t file_bytes, const std::string& name) {
  const uint64_t data_bytes = file_bytes - header.bytes;
  uint64_t needed = 0;
  for (const PlyElement& element : header.elements) {
    const uint64_t least = element.least_bytes(header.encoding);
    if (element.count == 0) continue;
    if (least == 0) return Error{fmt::format("{}: element '{}' has no properties", name, element.name)};
    if (element.count > data_bytes / least + 1)
      return Error{
          fmt::format("{}: header claims {} of element '{}' ({} bytes or more each), but only {} bytes follow it", name,
                      element.count, element.name, least, data_bytes)};
    needed += element.count * least;
    if (needed > data_bytes + 1)  // the last number of a text file need not be followed by a separator
      return Error{
          fmt::format("{}: is truncated: header claims elements of {} bytes or more, but only {} bytes follow it", name,
                      needed, data_bytes)};
  }
  return ok_status();
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
    bytes += encoding == PlyEncoding::kAscii ? 2 : kPlyTypeBytes[static_cast<int>(p.is_list ? p.count_type : p.type)];
  return bytes;
}

const PlyElement* PlyHeader::find(std::string_view element) const {
  for (const PlyElement& e : elements)
    if (e.name == element) return &e;
  return nullptr;
}

Result<PlyHeader> parse_ply_header(std::string_view content, const std::string& name) {
  std::string text(content.substr(0, kMaxHeaderBytes));
  if (text.starts_with("ply\r") && !text.starts_with("ply\r\n")) std::replace(text.begin(), text.end(), '\r', '\n');
  TextScanner scan(text);
  if (scan.word() != "ply") return Error{name + ": does not start with 'ply'"};
  scan.next_line();
  PlyHeader header;
  bool has_format = false;
  for (int line = 2;; ++line) {
    const std::string where = fmt::format("{}:{}", name, line);
    if (scan.at_end()) return Error{name + ": PLY header has no 'end_header'"};
    const std::string_view rest = std::string_view(text).substr(scan.offset());
    const auto words = split(scan);
    if (words.size() > 2 && words[0] == "comment" && words[1] == "TextureFile" && header.textures.size() < kMaxTextures)
      header.textures.push_back(rest_of_line(rest, size_t(words[2].data() - rest.data())));
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() >= 2) {
      if (auto status = parse_encoding(words[1], header, where); !status) return status.error();
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      if (auto status = parse_element(words, header, where); !status) return status.error();
    } else if (words[0] == "property" && !header.elements.empty()) {
      if (auto status = parse_property(words, header.elements.back(), where); !status) return status.error();
    } else {
      return Error{fmt::format("{}: '{}' is no PLY header line", where, words[0].substr(0, 40))};
    }
  }
  if (!has_format) return Error{name + ": PLY header has no format line"};
  header.bytes = scan.offset();
  if (auto status = check_counts(header, content.size(), name); !status) return status.error();
  return header;
}

}  // namespace telesplat::data
