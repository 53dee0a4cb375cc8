// STL. Source: 3D Systems, "StereoLithography Interface Specification", 1989.
#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "services/data/base/text_scanner.h"
#include "services/data/mesh/reader.h"

namespace telesplat::data {
namespace {

constexpr size_t kBinaryHeader = 84, kBinaryTriangle = 50;

// Joins corners that lie at exactly the same place: an open hash table from positions to vertex numbers that grows with
// them.
class Welder {
 public:
  explicit Welder(std::vector<glm::dvec3>& positions) : positions_(positions), table_(1024, kFree) {}

  uint32_t operator()(glm::dvec3 p) {
    p += glm::dvec3(0.0);  // -0 and 0 are the same place
    if (2 * positions_.size() >= table_.size()) grow();
    uint32_t& slot = find(p);
    if (slot == kFree) {
      slot = static_cast<uint32_t>(positions_.size());
      positions_.push_back(p);
    }
    return slot;
  }

 private:
  static constexpr uint32_t kFree = ~uint32_t{0};

  static uint64_t hash(const glm::dvec3& p) {
    uint64_t h = 0;
    for (int a = 0; a < 3; ++a) h = (std::rotl(h, 23) ^ std::bit_cast<uint64_t>(p[a])) * 0x9e3779b97f4a7c15;
    return h ^ h >> 32;
  }
  uint32_t& find(const glm::dvec3& p) {
    const size_t mask = table_.size() - 1;
    size_t slot = hash(p) & mask;
    while (table_[slot] != kFree && std::memcmp(&positions_[table_[slot]], &p, sizeof p) != 0) slot = (slot + 1) & mask;
    return table_[slot];
  }
  void grow() {
    table_.assign(2 * table_.size(), kFree);
    for (size_t i = 0; i < positions_.size(); ++i) find(positions_[i]) = static_cast<uint32_t>(i);
  }

  std::vector<glm::dvec3>& positions_;
  std::vector<uint32_t> table_;
};

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
  Welder weld(mesh.positions);
  for (uint32_t t = 0; t < triangles; ++t) {
    float corner[9];
    std::memcpy(corner, content.data() + kBinaryHeader + size_t{t} * kBinaryTriangle + 12, sizeof corner);
    for (int k = 0; k < 3; ++k) mesh.indices.push_back(weld({corner[3 * k], corner[3 * k + 1], corner[3 * k + 2]}));
    if ((t & 0xffff) == 0 && progress) progress(static_cast<double>(t) / triangles);
  }
  return mesh;
}

// Only the "vertex" lines matter: three in a row are a triangle.
Result<Mesh> read_ascii(std::string_view content, const std::string& name, const ReadProgress& progress) {
  Mesh mesh;
  mesh.format = "stl";
  Welder weld(mesh.positions);
  TextScanner scan(content);
  bool ended = false;
  for (size_t lines = 0; scan.skip_space(); ++lines) {
    const std::string_view word = scan.word();
    if (word == "vertex" || word == "VERTEX") {
      glm::dvec3 p;
      for (int a = 0; a < 3; ++a)
        if (!scan.skip_blanks() || !scan.number(p[a]))
          return Error{fmt::format("{}:{}: a vertex is not three numbers", name, scan.line_number())};
      mesh.indices.push_back(weld(p));
    } else if (word == "endfacet" || word == "ENDFACET") {
      if (mesh.indices.size() % 3 != 0)
        return Error{fmt::format("{}:{}: a facet does not have three vertices", name, scan.line_number())};
    } else if (word == "endsolid" || word == "ENDSOLID") {
      ended = true;
    }
    scan.next_line();
    if ((lines & 0xffff) == 0 && progress)
      progress(static_cast<double>(scan.offset()) / static_cast<double>(content.size()));
  }
  if (!ended || mesh.indices.size() % 3 != 0)
    return Error{fmt::format("{}: is truncated: no 'endsolid' at its end", name)};
  return mesh;
}

}  // namespace

Result<Mesh> read_stl(std::string_view content, const std::string& name, const ReadProgress& progress) {
  uint32_t triangles = 0;
  if (content.size() >= kBinaryHeader) std::memcpy(&triangles, content.data() + 80, 4);
  const bool exact = content.size() == kBinaryHeader + kBinaryTriangle * uint64_t{triangles};
  if (content.starts_with("solid") && !(exact && content.size() >= kBinaryHeader))
    return read_ascii(content, name, progress);
  if (content.size() < kBinaryHeader)
    return Error{fmt::format("{}: {} bytes are too few for an STL file, its header alone has {}", name, content.size(),
                             kBinaryHeader)};
  return read_binary(content, name, progress);
}

}  // namespace telesplat::data
