// Reads STL. Sources: 3D Systems, "StereoLithography Interface Specification", 1989; colours: "STL (file format)",
// Wikipedia, and files that VisCAM, Materialise Magics and MeshLab write.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "services/data/base/numbering.h"
#include "services/data/base/text_scanner.h"
#include "services/data/mesh/formats/readers.h"

namespace telesplat::data {
namespace {

constexpr size_t kBinaryHeader = 84, kBinaryTriangle = 50;

// Joins corners that lie at exactly the same place.
class Welder {
 public:
  uint32_t operator()(const glm::dvec3& p) { return places_(p + glm::dvec3(0.0)); }  // -0 and 0 are the same place
  std::vector<glm::dvec3> positions() { return places_.take_keys(); }

 private:
  Numbering<glm::dvec3> places_;
};

// Ignores case: programs write both.
bool is_word(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + ('a' - 'A') : a) == b; });
}

// A facet's last two bytes hold bit 15 and 5 bits per channel. VisCAM sets bit 15 for a facet with its own colour, blue
// lowest. Materialise writes a default colour into the header and sets bit 15 where it applies; red is lowest. MeshLab
// has Materialise's header without the comma, but sets the bit for own colours.
std::vector<uint32_t> facet_colours(std::string_view header, const std::vector<uint16_t>& bits) {
  constexpr uint16_t kTop = 0x8000;
  constexpr std::string_view kWord = "COLOR=", kNext = "MATERIAL=";
  const size_t at = header.find(kWord), rgba = at + kWord.size();
  const bool by_header = at != header.npos && rgba + 4 <= header.size();
  const bool meshlab = by_header && header.substr(rgba + 4).starts_with(kNext), materialise = by_header && !meshlab;
  const auto any = [&](uint16_t mask) {
    return std::any_of(bits.begin(), bits.end(), [&](uint16_t b) { return b & mask; });
  };
  if (!materialise && !any(kTop)) return {};
  uint32_t of_all = kNoColour;
  if (materialise) {
    const auto byte = [&](size_t i) { return uint32_t(uint8_t(header[rgba + i])); };
    of_all = pack_rgb(byte(0), byte(1), byte(2));
  }
  const bool used = any(0xffff);  // else the program wrote no facet colours: the facets are not all black
  std::vector<uint32_t> out;
  out.reserve(bits.size());
  for (const uint16_t b : bits) {
    const auto channel = [&](int shift) { return ((b >> shift & 31u) * 255 + 15) / 31; };
    const bool own = used && ((b & kTop) == 0) == materialise;
    const uint32_t low = channel(0), high = channel(10);
    out.push_back(!own ? of_all : by_header ? pack_rgb(low, channel(5), high) : pack_rgb(high, channel(5), low));
  }
  return out;
}

Result<Mesh> read_binary(std::string_view content, const std::string& name, const ReadProgress& progress) {
  uint32_t triangles;
  std::memcpy(&triangles, content.data() + 80, 4);
  const uint64_t room = (content.size() - kBinaryHeader) / kBinaryTriangle;
  if (triangles > room)
    return Error{
        fmt::format("{}: STL header claims {} triangles, its {} bytes hold {}", name, triangles, content.size(), room)};
  Mesh mesh;
  mesh.format = "stl";
  mesh.indices.reserve(3 * size_t{triangles});
  Welder weld;
  std::vector<uint16_t> bits(triangles);
  for (uint32_t t = 0; t < triangles; ++t) {
    float corner[9];
    const char* const facet = content.data() + kBinaryHeader + size_t{t} * kBinaryTriangle;
    std::memcpy(corner, facet + 12, sizeof corner);
    std::memcpy(&bits[t], facet + 12 + sizeof corner, 2);
    for (int k = 0; k < 3; ++k) mesh.indices.push_back(weld({corner[3 * k], corner[3 * k + 1], corner[3 * k + 2]}));
    if ((t & 0xffff) == 0 && progress) progress(static_cast<double>(t) / triangles);
  }
  mesh.positions = weld.positions();
  if (const auto colours = facet_colours(content.substr(0, 80), bits); !colours.empty()) colour_faces(mesh, colours);
  return mesh;
}

// Reads only the "vertex" lines: three in a row are a triangle.
Result<Mesh> read_ascii(std::string_view content, const std::string& name, const ReadProgress& progress) {
  Mesh mesh;
  mesh.format = "stl";
  Welder weld;
  TextScanner scan(content);
  bool ended = false;
  for (size_t lines = 0; scan.skip_space(); ++lines) {
    const std::string_view word = scan.word();
    if (is_word(word, "vertex")) {
      glm::dvec3 p;
      for (int a = 0; a < 3; ++a)
        if (!scan.skip_blanks() || !scan.number(p[a]))
          return Error{fmt::format("{}:{}: a vertex is not three numbers", name, scan.line_number())};
      mesh.indices.push_back(weld(p));
    } else if (is_word(word, "endfacet")) {
      if (mesh.indices.size() % 3 != 0)
        return Error{fmt::format("{}:{}: a facet does not have three vertices", name, scan.line_number())};
    } else if (is_word(word, "endsolid")) {
      ended = true;
    }
    scan.next_line();
    if ((lines & 0xffff) == 0 && progress)
      progress(static_cast<double>(scan.offset()) / static_cast<double>(content.size()));
  }
  if (!ended || mesh.indices.size() % 3 != 0)
    return Error{fmt::format("{}: is truncated: no 'endsolid' at its end", name)};
  mesh.positions = weld.positions();
  return mesh;
}

}  // namespace

bool is_binary_stl(std::string_view content) {
  uint32_t triangles = 0;
  if (content.size() < kBinaryHeader) return false;
  std::memcpy(&triangles, content.data() + 80, 4);
  return content.size() == kBinaryHeader + kBinaryTriangle * uint64_t{triangles};
}

bool is_text_stl(std::string_view content) {
  constexpr int kMostNameLines = 16, kBytesToTell = 512;
  if (is_binary_stl(content) || content.substr(0, kBytesToTell).find('\0') != content.npos) return false;
  if (content.starts_with("\xef\xbb\xbf")) content.remove_prefix(3);
  TextScanner scan(content);
  scan.skip_space();
  if (!is_word(scan.word(), "solid")) return false;
  for (int line = 0; line < kMostNameLines; ++line) {  // after the name line, which binary files have, too
    scan.next_line();
    if (!scan.skip_space()) return true;
    const std::string_view word = scan.word();
    if (is_word(word, "facet") || is_word(word, "endsolid")) return true;
  }
  return false;
}

Result<Mesh> read_stl(std::string_view content, const std::string& name, const ReadProgress& progress) {
  if (is_text_stl(content)) return read_ascii(content, name, progress);
  if (content.size() < kBinaryHeader)
    return Error{fmt::format("{}: {} bytes are too few for an STL file, its header alone has {}", name, content.size(),
                             kBinaryHeader)};
  return read_binary(content, name, progress);
}

}  // namespace telesplat::data
