#include "services/data/vtk/cell_faces.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numeric>
#include <string_view>

#include "services/data/base/polygons/polygon.h"

namespace telesplat::data::vtk {
namespace {

// A letter a node. Faces of volume cells look outward. "abc:def": corners, then middles and centre. A star: middles
// of two edges alone.
struct Row {
  uint8_t type;
  int dimension;
  size_t nodes;
  std::string_view faces;
};
constexpr Row kRows[] = {
    {1, 0, 1, ""},
    {kPolyVertex, 0, 0, ""},
    {3, 1, 2, ""},
    {kPolyLine, 1, 0, ""},
    {5, 2, 3, "abc"},
    {kStrip, 2, 0, ""},
    {kPolygon, 2, 0, ""},
    {8, 2, 4, "abdc"},
    {kQuad, 2, 4, "abcd"},
    {10, 3, 4, "abd bcd cad acb"},
    {11, 3, 8, "caeg bdhf abfe dcgh bacd efhg"},
    {kHexahedron, 3, 8, "aehd bcgf abfe dhgc adcb efgh"},
    {13, 3, 6, "abc dfe adeb befc cfda"},
    {14, 3, 5, "adcb abe bce cde dae"},
    {15, 3, 10, "aedcb fghij abgf bchg cdih deji eafj"},
    {16, 3, 12, "afedcb ghijkl abhg bcih cdji dekj eflk fagl"},
    {21, 1, 3, ""},
    {22, 2, 6, "abc:def"},
    {23, 2, 8, "abcd:efgh"},
    {24, 3, 10, "abd:eih bcd:fji cad:ghj acb:gfe"},
    {25, 3, 20, "aehd:qptl bcgf:jsnr abfe:irmq dhgc:tosk adcb:lkji efgh:mnop"},
    {26, 3, 15, "abc:ghi dfe:lkj adeb:mjng befc:nkoh cfda:olmi"},
    {27, 3, 13, "adcb:ihgf abe:fkj bce:glk cde:hml dae:ijm"},
    {28, 2, 9, "abcd:efghi"},
    {29, 3, 27, "aehd:qptlu bcgf:jsnrv abfe:irmqw dhgc:toskx adcb:lkjiy efgh:mnopz"},
    {30, 2, 6, "abcd:ef*"},
    {31, 3, 12, "abc:ghi dfe:lkj bade:gj* cbef:hk* acfd:il*"},
    {32, 3, 18, "abc:ghi dfe:lkj adeb:mjngp befc:nkohq cfda:olmir"},
    {33, 3, 24, "aehd:qptlu bcgf:jsnrv abfe:irmqw dhgc:toskx adcb:lkji efgh:mnop"},
    {34, 2, 7, "abc:defg"},
    {35, 1, 4, ""},
    {kQuadraticPolygon, 2, 0, ""},
    {37, 3, 19, "adcb:ihgfn abe:fkjo bce:glkp cde:hmlq dae:ijmr"},
    {kPolyhedron, 3, 0, ""},
};
// Cells of any order, Lagrange's (from 68) and Bezier's (from 75), have the corners of these, and come first with
// them; some of Lagrange's have the nodes of the others if they are of second order (0: VTK has changed their order).
constexpr uint8_t kOfCorners[] = {3, 5, 9, 10, 12, 13, 14}, kOfSecondOrder[] = {0, 22, 28, 24, 0, 0, 0};
constexpr uint8_t kFirstLagrange = 68, kFirstBezier = 75, kBehindBezier = 82;

FaceRow parse_face(std::string_view text) {
  FaceRow out;
  const size_t corners = std::min(text.find(':'), text.size());
  out.corners = uint8_t(corners);
  for (const char c : text)
    if (c >= 'a') out.node[out.nodes++] = uint8_t(c - 'a');
  out.middles = text.ends_with('*') ? 2 : out.nodes > out.corners ? out.corners : 0;
  return out;
}

CellKind parse_row(const Row& row) {
  CellKind out{row.dimension, row.nodes, false, {}};
  for (std::string_view rest = row.faces; !rest.empty();) {
    const std::string_view face = rest.substr(0, rest.find(' '));
    out.faces.push_back(parse_face(face));
    rest.remove_prefix(std::min(face.size() + 1, rest.size()));
  }
  return out;
}

struct Table {
  std::array<CellKind, kBehindBezier> kinds;
  std::array<bool, kBehindBezier> known{};

  Table() {
    for (const Row& row : kRows) kinds[row.type] = parse_row(row), known[row.type] = true;
    for (size_t i = 0; i < std::size(kOfCorners); ++i)
      for (const uint8_t first : {kFirstLagrange, kFirstBezier}) {
        kinds[first + i] = kinds[kOfCorners[i]];
        kinds[first + i].corners_alone = i > 0;
        known[first + i] = true;
      }
  }
};

}  // namespace

const CellKind* kind_of_cell(uint8_t type, size_t nodes) {
  static const Table table;
  if (type >= kBehindBezier || !table.known[type]) return nullptr;
  if (type >= kFirstLagrange && type < kFirstBezier) {
    const CellKind& second = table.kinds[kOfSecondOrder[type - kFirstLagrange]];
    if (second.dimension > 0 && nodes == second.nodes) return &second;
  }
  return &table.kinds[type];
}

void FaceCutter::cut_polygon_of(std::span<const uint32_t> corners, std::vector<uint32_t>& out) {
  if (corners.size() == 3) {
    out.insert(out.end(), corners.begin(), corners.end());
    return;
  }
  positions_.clear(), cut_.clear();
  for (const uint32_t corner : corners) positions_.push_back(set_.point(corner));
  local_.resize(corners.size());
  std::iota(local_.begin(), local_.end(), 0u);
  cut_polygon(local_, positions_, cut_);
  for (const uint32_t i : cut_) out.push_back(corners[i]);
}

void FaceCutter::cut(const FacePoints& face, std::vector<uint32_t>& out) {
  const auto& c = face.corners;
  const auto& m = face.middles;
  const size_t n = c.size();
  if (m.empty()) return cut_polygon_of(c, out);
  if (m.size() < n) {  // straight between the two curved edges
    cut_polygon_of(std::array{c[0], m[0], m[1], c[3]}, out);
    return cut_polygon_of(std::array{m[0], c[1], c[2], m[1]}, out);
  }
  for (size_t i = 0; i < n; ++i) {
    const uint32_t before = m[(i + n - 1) % n];
    if (face.centre.empty())
      out.insert(out.end(), {before, c[i], m[i]});
    else
      out.insert(out.end(), {before, c[i], face.centre[0], c[i], m[i], face.centre[0]});
  }
  if (!face.centre.empty()) return;
  const auto length = [&](size_t a, size_t b) { return glm::distance(set_.point(m[a]), set_.point(m[b])); };
  if (n == 4 && length(1, 3) < length(0, 2)) {
    out.insert(out.end(), {m[0], m[1], m[3], m[1], m[2], m[3]});
    return;
  }
  for (size_t i = 2; i < n; ++i) out.insert(out.end(), {m[0], m[i - 1], m[i]});
}

}  // namespace telesplat::data::vtk
