#include "services/data/vtk/cells.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numeric>
#include <string_view>

#include "services/data/base/polygons/polygon.h"

namespace telesplat::data::vtk {
namespace {

// One letter per node. Faces of volume cells look outward. "abc:def": corners, then middles and centre. A star: only
// two edges have middles.
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
// Cells of any order, Lagrange's (from 68) and Bezier's (from 75), begin with the corners of these types; some Lagrange
// cells of second order have the nodes of kOfSecondOrder (0: VTK has changed their order).
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

constexpr int kDuplicate = 1, kRefined = 8, kHidden = 32, kHiddenPoint = 2;  // bits of vtkGhostType

const Array* marks_of(const Attributes& data, size_t count) {
  const Array* marks = data.find("vtkGhostType");
  return marks && marks->type == StoredType::kU8 && marks->values == count ? marks : nullptr;
}

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

CellReader::CellReader(const DataSet& set) : set_(set), states_(set.cell_count(), CellState::kShown) {
  if (set.structured) {
    size_t step = 1;
    for (size_t a = 0; a < 3; step *= size_t(set.side(a++))) {
      sides_[a] = size_t(std::max<int64_t>(set.side(a) - 1, 1));
      if (set.side(a) > 1) steps_.push_back(step);
    }
    structured_type_ = steps_.size() == 3 ? kHexahedron : steps_.size() == 2 ? kQuad : kPolyLine;
  }
  if (const Array* marks = marks_of(set.cell_data, count()))
    for (size_t i = 0; i < count(); ++i) {
      const int mark = int(marks->at(i));
      states_[i] = mark & (kHidden | kRefined) ? CellState::kAbsent
                   : mark & kDuplicate         ? CellState::kGhost
                                               : CellState::kShown;
    }
  if (const Array* levels = set.cell_data.find("vtkGhostLevels"); levels && levels->tuples() == count())
    for (size_t i = 0; i < count(); ++i)
      if (levels->at(i * levels->components) > 0) states_[i] = CellState::kGhost;
  if (const Array* marks = marks_of(set.point_data, set.point_count()))
    for (size_t i = 0; i < count(); ++i)
      for (const uint32_t point : nodes(i))
        if (int(marks->at(point)) & kHiddenPoint) states_[i] = CellState::kAbsent;
}

const CellKind* CellReader::kind(size_t cell) const {
  return kind_of_cell(type(cell), set_.structured ? 8 : set_.cells[cell].size());
}

void CellReader::check() const {
  if (set_.structured) return;
  for (size_t i = 0; i < count(); ++i)
    if (const CellKind* k = kind(i); k && set_.cells[i].size() < k->nodes)
      refuse("{}: cell {} of type {} has {} points of {}", set_.name, i, set_.types[i], set_.cells[i].size(), k->nodes);
}

std::span<const uint32_t> CellReader::nodes(size_t cell) {
  if (!set_.structured) return set_.cells[cell];
  const size_t i = cell % sides_[0], j = cell / sides_[0] % sides_[1], k = cell / (sides_[0] * sides_[1]);
  const size_t first = i + size_t(set_.side(0)) * (j + size_t(set_.side(1)) * k);
  const size_t u = steps_.empty() ? 0 : steps_[0], v = steps_.size() < 2 ? 0 : steps_[1];
  const size_t square[4] = {first, first + u, first + u + v, first + v};
  for (size_t c = 0; c < 8; ++c) corners_[c] = uint32_t(square[c % 4] + (c < 4 || steps_.size() < 3 ? 0 : steps_[2]));
  return std::span(corners_).first(steps_.size() == 3 ? 8 : steps_.size() == 2 ? 4 : 2);
}

size_t CellReader::face_count(size_t cell) const {
  if (type(cell) == kPolyhedron)
    return set_.face_begins.empty() ? 0 : set_.face_begins[cell + 1] - set_.face_begins[cell];
  const CellKind* k = kind(cell);
  return !k || k->dimension < 2 ? 0 : k->dimension == 2 ? 1 : k->faces.size();
}

FacePoints CellReader::face(size_t cell, size_t face) {
  if (type(cell) == kPolyhedron) return {set_.faces[set_.face_begins[cell] + face], {}, {}};
  const auto points = nodes(cell);
  const CellKind* k = kind(cell);
  if (k->faces.empty()) {
    const size_t corners = type(cell) == kQuadraticPolygon ? points.size() / 2 : points.size();
    return {points.first(corners), points.subspan(corners, points.size() == 2 * corners ? corners : 0), {}};
  }
  const FaceRow& row = k->faces[face];
  face_.clear();
  for (size_t n = 0; n < row.nodes; ++n) face_.push_back(points[row.node[n]]);
  const auto all = std::span<const uint32_t>(face_);
  return {all.first(row.corners), all.subspan(row.corners, row.middles), all.subspan(row.corners + row.middles)};
}

glm::dvec3 CellReader::area_vector(std::span<const uint32_t> corners) const {
  glm::dvec3 area(0);
  if (corners.empty()) return area;
  const glm::dvec3 first = set_.point(corners[0]);
  for (size_t i = 2; i < corners.size(); ++i)
    area += glm::cross(set_.point(corners[i - 1]) - first, set_.point(corners[i]) - first);
  return area;
}

double CellReader::volume_under(std::span<const uint32_t> corners, const glm::dvec3& from) const {
  return corners.empty() ? 0 : glm::dot(set_.point(corners[0]) - from, area_vector(corners));
}

void CellReader::orient(size_t cell) {
  oriented_ = cell;
  if (type(cell) == kPolyhedron) return orient_polyhedron(cell);
  const glm::dvec3 from = set_.point(nodes(cell)[0]);
  double volume = 0;
  for (size_t f = 0; f < face_count(cell); ++f) volume += volume_under(face(cell, f).corners, from);
  inward_.assign(face_count(cell), volume < 0);
}

// Faces of polyhedra may have either orientation: first neighbours are turned to run along their edge in opposite ways.
void CellReader::orient_polyhedron(size_t cell) {
  struct Edge {
    uint32_t low, high;
    uint32_t face;
    bool forward;
    bool operator<(const Edge& o) const { return low != o.low ? low < o.low : high < o.high; }
  };
  const size_t faces = face_count(cell);
  inward_.assign(faces, false);
  std::vector<Edge> edges;
  const auto edge_of = [](std::span<const uint32_t> c, size_t i, uint32_t f) {
    const uint32_t a = c[i], b = c[(i + 1) % c.size()];
    return Edge{std::min(a, b), std::max(a, b), f, a < b};
  };
  for (uint32_t f = 0; f < faces; ++f)
    for (size_t i = 0; i < face(cell, f).corners.size(); ++i) edges.push_back(edge_of(face(cell, f).corners, i, f));
  std::sort(edges.begin(), edges.end());
  std::vector<bool> reached(faces, false);
  std::vector<uint32_t> part;
  const glm::dvec3 from = edges.empty() ? glm::dvec3(0) : set_.point(edges[0].low);
  for (uint32_t start = 0; start < faces; ++start) {
    if (reached[start]) continue;
    part.assign(1, start), reached[start] = true;
    double volume = 0;
    for (size_t at = 0; at < part.size(); ++at) {
      const uint32_t f = part[at];
      const auto corners = face(cell, f).corners;
      volume += volume_under(corners, from) * (inward_[f] ? -1 : 1);
      for (size_t i = 0; i < corners.size(); ++i) {
        const Edge edge = edge_of(corners, i, f);
        // More than two faces at an edge: the cell is damaged, and only its first ones count.
        auto other = std::lower_bound(edges.begin(), edges.end(), edge);
        for (int n = 0; n < 4 && other != edges.end() && !(edge < *other); ++n, ++other)
          if (!reached[other->face]) {
            reached[other->face] = true;
            inward_[other->face] = inward_[f] != (other->forward == edge.forward);
            part.push_back(other->face);
          }
      }
    }
    if (volume < 0)
      for (const uint32_t f : part) inward_[f] = !inward_[f];
  }
}

bool CellReader::looks_inward(size_t cell, size_t face) {
  if (oriented_ != cell) orient(cell);
  return inward_[face];
}

}  // namespace telesplat::data::vtk
