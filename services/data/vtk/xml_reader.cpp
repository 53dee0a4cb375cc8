#include "services/data/vtk/files.h"

#include <fmt/format.h>

#include "services/data/vtk/cells.h"

namespace telesplat::data::vtk {
namespace {

constexpr size_t kBestPacking = 10'000;  // best ratio of any compressor, to 1

pugi::xml_node array_named(pugi::xml_node element, const char* name) {
  return element.find_child_by_attribute("DataArray", "Name", name);
}

// Reads all arrays of numbers in an element <PointData> or <CellData>.
Attributes read_attributes(const XmlFile& file, pugi::xml_node element, size_t tuples) {
  Attributes out{{}, element.attribute("Scalars").value(), element.attribute("Normals").value()};
  StoredType type;
  for (const auto node : element.children("DataArray"))
    if (type_of(node.attribute("type").value(), type)) out.arrays.push_back(file.array(node, int64_t(tuples)));
  return out;
}

// Common part of all kinds of pieces.
struct Piece {
  const XmlFile& file;
  pugi::xml_node node;
  DataSet set;

  void read_points(int64_t count) {
    if (count == 0) return;
    auto points = file.array(node.child("Points").child("DataArray"), count);
    if (points.components != 3) refuse("{}: its points have {} components, not 3", set.name, points.components);
    set.points = std::move(points);
  }

  void read_data() {
    set.point_data = read_attributes(file, node.child("PointData"), set.point_count());
    set.cell_data = read_attributes(file, node.child("CellData"), set.cell_count());
  }

  // Reads the cells of an element with connectivity and offsets.
  Cells read_cells(const char* element, int64_t count) {
    if (count == 0) return Cells{};
    const auto from = node.child(element);
    const auto ids = file.array(array_named(from, "connectivity"), -1);
    const auto ends = file.array(array_named(from, "offsets"), count);
    return make_cells(ids, ends, false, set.point_count(), set.name);
  }

  int64_t number(const char* attribute) const { return node.attribute(attribute).as_llong(); }
};

void read_poly_data(Piece& piece) {
  piece.read_points(piece.number("NumberOfPoints"));
  struct Kind {
    const char *element, *count;
    uint8_t type;
  };
  for (const Kind& kind : {Kind{"Verts", "NumberOfVerts", kPolyVertex}, Kind{"Lines", "NumberOfLines", kPolyLine},
                           Kind{"Polys", "NumberOfPolys", kPolygon}, Kind{"Strips", "NumberOfStrips", kStrip}})
    append_cells(piece.read_cells(kind.element, piece.number(kind.count)), kind.type, piece.set);
}

// Reads polyhedra as VTK 9.4 writes them (file version 2.3): a list of faces, and the faces of each polyhedron.
void read_listed_faces(Piece& piece, pugi::xml_node cells) {
  DataSet& set = piece.set;
  const auto ids = piece.file.array(array_named(cells, "face_connectivity"), -1);
  const auto ends = piece.file.array(array_named(cells, "face_offsets"), -1);
  const auto all = make_cells(ids, ends, false, set.point_count(), set.name);
  const auto of_cells = piece.file.array(array_named(cells, "polyhedron_to_faces"), -1);
  const auto ends_of_cells = piece.file.array(array_named(cells, "polyhedron_offsets"), int64_t(set.cells.size()));
  const auto faces = make_cells(of_cells, ends_of_cells, false, all.size(), set.name);
  set.face_begins = faces.begins;
  for (const uint32_t face : faces.points) {
    if (set.faces.points.size() > 4 * all.points.size())  // two cells may share a face
      refuse("{}: its polyhedra have more than four times the faces that there are", set.name);
    set.faces.add(all[face]);
  }
}

// Reads polyhedra of older files: a stream of numbers, and the end of each cell's part (-1: not a polyhedron).
void read_face_streams(Piece& piece, pugi::xml_node cells) {
  DataSet& set = piece.set;
  const auto faces = piece.file.array(array_named(cells, "faces"), -1);
  const auto ends = piece.file.array(array_named(cells, "faceoffsets"), int64_t(set.cells.size()));
  const auto stream = indices_of(faces);
  set.face_begins.assign(1, 0);
  size_t begin = 0;
  for (size_t cell = 0; cell < set.cells.size(); ++cell) {
    const double end = ends.at(cell);
    if (set.types[cell] == kPolyhedron && end > double(begin)) {
      if (end > double(stream.size()))
        refuse("{}: the faces of cell {} end at {} of {}", set.name, cell, end, stream.size());
      add_face_stream(std::span(stream).subspan(begin, size_t(end) - begin), set);
      begin = size_t(end);
    }
    set.face_begins.push_back(set.faces.size());
  }
  return check_ids(set.faces.points, set.point_count(), set.name);
}

void read_unstructured(Piece& piece) {
  DataSet& set = piece.set;
  piece.read_points(piece.number("NumberOfPoints"));
  const int64_t count = piece.number("NumberOfCells");
  set.cells = piece.read_cells("Cells", count);
  if (count == 0) return;
  const auto cells = piece.node.child("Cells");
  set.types = types_of(piece.file.array(array_named(cells, "types"), count));
  if (array_named(cells, "polyhedron_to_faces")) return read_listed_faces(piece, cells);
  if (array_named(cells, "faces")) return read_face_streams(piece, cells);
}

void read_structured(Piece& piece, const std::string& kind, pugi::xml_node grid) {
  DataSet& set = piece.set;
  set.structured = true;
  const char* extent = piece.node.attribute("Extent").value();
  set.extent = piece_extent(piece.file, *extent ? extent : grid.attribute("WholeExtent").value());
  if (kind == "StructuredGrid") return piece.read_points(int64_t(set.point_count()));
  if (kind == "ImageData") {
    set.image = true;
    set.index_to_data = placement_of(grid);
    return;
  }
  auto coordinates = piece.node.child("Coordinates").child("DataArray");
  for (size_t a = 0; a < 3; ++a, coordinates = coordinates.next_sibling("DataArray"))
    set.axes[a] = piece.file.array(coordinates, set.side(a));
}

}  // namespace

bool parse_extent(std::string_view text, std::array<int64_t, 6>& out) {
  TextScanner in(text);
  for (int64_t& value : out)
    if (!in.skip_space() || !in.integer(value)) return false;
  return true;
}

std::array<int64_t, 6> piece_extent(const XmlFile& file, std::string_view text) {
  std::array<int64_t, 6> out;
  if (!parse_extent(text, out)) refuse("{}: the Extent of a piece is no six numbers", file.name());
  check_extent(out, file.bytes(), file.name());
  return out;
}

glm::dmat4 placement_of(pugi::xml_node image) {
  const auto numbers = [&](const char* name, std::array<double, 9> out) {
    TextScanner in(image.attribute(name).value());
    for (double& value : out)
      if (!in.skip_space() || !in.number(value)) break;
    return out;
  };
  const auto origin = numbers("Origin", {}), spacing = numbers("Spacing", {1, 1, 1}),
             direction = numbers("Direction", {1, 0, 0, 0, 1, 0, 0, 0, 1});
  glm::dmat4 out(1);
  for (int a = 0; a < 3; ++a)
    for (int row = 0; row < 3; ++row) out[a][row] = direction[size_t(3 * row + a)] * spacing[size_t(a)];
  out[3] = glm::dvec4(origin[0], origin[1], origin[2], 1);
  return out;
}

std::vector<DataSet> read_pieces(const XmlFile& file) {
  const std::string kind = file.root().attribute("type").value();
  const auto data = file.root().child(kind.c_str());
  std::vector<DataSet> out;
  for (const auto node : data.children("Piece")) {
    Piece piece{file, node, {}};
    piece.set.name = file.name();
    for (const char* count :
         {"NumberOfPoints", "NumberOfCells", "NumberOfPolys", "NumberOfStrips", "NumberOfVerts", "NumberOfLines"})
      if (piece.number(count) < 0 || piece.number(count) > int64_t(file.bytes() * kBestPacking))
        refuse("{}: claims {} {} in a file of {} bytes", file.name(), node.attribute(count).value(), count,
               file.bytes());
    if (kind == "PolyData")
      read_poly_data(piece);
    else if (kind == "UnstructuredGrid")
      read_unstructured(piece);
    else
      read_structured(piece, kind, data);
    piece.read_data();
    out.push_back(std::move(piece.set));
  }
  return out;
}

}  // namespace telesplat::data::vtk
