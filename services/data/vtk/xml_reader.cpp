#include "services/data/vtk/xml_reader.h"

#include <fmt/format.h>

#include "services/data/base/text_scanner.h"
#include "services/data/vtk/cell_faces.h"

namespace telesplat::data::vtk {
namespace {

constexpr size_t kBestPacking = 10'000;  // of any compressor, to 1

pugi::xml_node array_named(pugi::xml_node element, const char* name) {
  return element.find_child_by_attribute("DataArray", "Name", name);
}

// What is shared by all kinds of pieces.
struct Piece {
  const XmlFile& file;
  pugi::xml_node node;
  DataSet set;

  Status read_points(int64_t count) {
    if (count == 0) return ok_status();
    auto points = file.array(node.child("Points").child("DataArray"), count);
    if (!points) return points.error();
    if (points->components != 3)
      return Error{fmt::format("{}: its points have {} components, not 3", set.name, points->components)};
    set.points = std::move(*points);
    return ok_status();
  }

  Status read_data() {
    auto points = read_attributes(file, node.child("PointData"), set.point_count());
    if (!points) return points.error();
    set.point_data = std::move(*points);
    auto cells = read_attributes(file, node.child("CellData"), set.cell_count());
    if (!cells) return cells.error();
    set.cell_data = std::move(*cells);
    return ok_status();
  }

  // Cells of an element with connectivity and offsets.
  Result<Cells> read_cells(const char* element, int64_t count) {
    if (count == 0) return Cells{};
    const auto from = node.child(element);
    const auto ids = file.array(array_named(from, "connectivity"), -1);
    if (!ids) return ids.error();
    const auto ends = file.array(array_named(from, "offsets"), count);
    if (!ends) return ends.error();
    return make_cells(*ids, *ends, false, set.point_count(), set.name);
  }

  int64_t number(const char* attribute) const { return node.attribute(attribute).as_llong(); }
};

Status read_poly_data(Piece& piece) {
  if (const Status s = piece.read_points(piece.number("NumberOfPoints")); !s) return s;
  struct Kind {
    const char *element, *count;
    uint8_t type;
  };
  for (const Kind& kind : {Kind{"Verts", "NumberOfVerts", kPolyVertex}, Kind{"Lines", "NumberOfLines", kPolyLine},
                           Kind{"Polys", "NumberOfPolys", kPolygon}, Kind{"Strips", "NumberOfStrips", kStrip}}) {
    auto cells = piece.read_cells(kind.element, piece.number(kind.count));
    if (!cells) return cells.error();
    append_cells(std::move(*cells), kind.type, piece.set);
  }
  return ok_status();
}

// As VTK 9.4 writes them (file version 2.3): faces by themselves, and which ones each polyhedron has.
Status read_listed_faces(Piece& piece, pugi::xml_node cells) {
  DataSet& set = piece.set;
  const auto ids = piece.file.array(array_named(cells, "face_connectivity"), -1);
  if (!ids) return ids.error();
  const auto ends = piece.file.array(array_named(cells, "face_offsets"), -1);
  if (!ends) return ends.error();
  const auto all = make_cells(*ids, *ends, false, set.point_count(), set.name);
  if (!all) return all.error();
  const auto of_cells = piece.file.array(array_named(cells, "polyhedron_to_faces"), -1);
  if (!of_cells) return of_cells.error();
  const auto ends_of_cells = piece.file.array(array_named(cells, "polyhedron_offsets"), int64_t(set.cells.size()));
  if (!ends_of_cells) return ends_of_cells.error();
  const auto faces = make_cells(*of_cells, *ends_of_cells, false, all->size(), set.name);
  if (!faces) return faces.error();
  set.face_begins = faces->begins;
  for (const uint32_t face : faces->points) {
    if (set.faces.points.size() > 4 * all->points.size())  // two cells may share a face
      return Error{fmt::format("{}: its polyhedra have more than four times the faces that there are", set.name)};
    const auto corners = (*all)[face];
    set.faces.points.insert(set.faces.points.end(), corners.begin(), corners.end());
    set.faces.begins.push_back(set.faces.points.size());
  }
  return ok_status();
}

// As older files have them: a stream of numbers, and where each cell's part of it ends (-1: it is no polyhedron).
Status read_face_streams(Piece& piece, pugi::xml_node cells) {
  DataSet& set = piece.set;
  const auto faces = piece.file.array(array_named(cells, "faces"), -1);
  if (!faces) return faces.error();
  const auto ends = piece.file.array(array_named(cells, "faceoffsets"), int64_t(set.cells.size()));
  if (!ends) return ends.error();
  const auto stream = indices_of(*faces);
  set.face_begins.assign(1, 0);
  size_t begin = 0;
  for (size_t cell = 0; cell < set.cells.size(); ++cell) {
    const double end = ends->at(cell);
    if (set.types[cell] == kPolyhedron && end > double(begin)) {
      if (end > double(stream.size()))
        return Error{fmt::format("{}: the faces of cell {} end at {} of {}", set.name, cell, end, stream.size())};
      if (const Status s = add_face_stream(std::span(stream).subspan(begin, size_t(end) - begin), set); !s) return s;
      begin = size_t(end);
    }
    set.face_begins.push_back(set.faces.size());
  }
  return check_ids(set.faces.points, set.point_count(), set.name);
}

Status read_unstructured(Piece& piece) {
  DataSet& set = piece.set;
  if (const Status s = piece.read_points(piece.number("NumberOfPoints")); !s) return s;
  const int64_t count = piece.number("NumberOfCells");
  auto read = piece.read_cells("Cells", count);
  if (!read) return read.error();
  set.cells = std::move(*read);
  if (count == 0) return ok_status();
  const auto cells = piece.node.child("Cells");
  const auto types = piece.file.array(array_named(cells, "types"), count);
  if (!types) return types.error();
  set.types = types_of(*types);
  if (array_named(cells, "polyhedron_to_faces")) return read_listed_faces(piece, cells);
  if (array_named(cells, "faces")) return read_face_streams(piece, cells);
  return ok_status();
}

Status read_structured(Piece& piece, const std::string& kind, pugi::xml_node grid) {
  DataSet& set = piece.set;
  set.structured = true;
  const char* extent = piece.node.attribute("Extent").value();
  if (!parse_extent(*extent ? extent : grid.attribute("WholeExtent").value(), set.extent))
    return Error{fmt::format("{}: the Extent of a piece is no six numbers", set.name)};
  if (const Status s = check_extent(set.extent, piece.file.bytes(), set.name); !s) return s;
  if (kind == "StructuredGrid") return piece.read_points(int64_t(set.point_count()));
  if (kind == "ImageData") {
    set.image = true;
    set.index_to_data = placement_of(grid);
    return ok_status();
  }
  auto coordinates = piece.node.child("Coordinates").child("DataArray");
  for (size_t a = 0; a < 3; ++a, coordinates = coordinates.next_sibling("DataArray")) {
    auto axis = piece.file.array(coordinates, set.side(a));
    if (!axis) return axis.error();
    set.axes[a] = std::move(*axis);
  }
  return ok_status();
}

}  // namespace

bool parse_extent(std::string_view text, std::array<int64_t, 6>& out) {
  TextScanner in(text);
  for (int64_t& value : out)
    if (!in.skip_space() || !in.integer(value)) return false;
  return true;
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

Result<Attributes> read_attributes(const XmlFile& file, pugi::xml_node element, size_t tuples) {
  Attributes out{{}, element.attribute("Scalars").value(), element.attribute("Normals").value()};
  StoredType type;
  for (const auto node : element.children("DataArray")) {
    if (!type_of(node.attribute("type").value(), type)) continue;
    auto array = file.array(node, int64_t(tuples));
    if (!array) return array.error();
    out.arrays.push_back(std::move(*array));
  }
  return out;
}

Result<std::vector<DataSet>> read_pieces(const XmlFile& file) {
  const std::string kind = file.root().attribute("type").value();
  const auto data = file.root().child(kind.c_str());
  std::vector<DataSet> out;
  for (const auto node : data.children("Piece")) {
    Piece piece{file, node, {}};
    piece.set.name = file.name();
    for (const char* count :
         {"NumberOfPoints", "NumberOfCells", "NumberOfPolys", "NumberOfStrips", "NumberOfVerts", "NumberOfLines"})
      if (piece.number(count) < 0 || piece.number(count) > int64_t(file.bytes() * kBestPacking))
        return Error{fmt::format("{}: claims {} {} in a file of {} bytes", file.name(), node.attribute(count).value(),
                                 count, file.bytes())};
    const Status read = kind == "PolyData"           ? read_poly_data(piece)
                        : kind == "UnstructuredGrid" ? read_unstructured(piece)
                                                     : read_structured(piece, kind, data);
    if (!read) return read.error();
    if (const Status s = piece.read_data(); !s) return s.error();
    out.push_back(std::move(piece.set));
  }
  return out;
}

}  // namespace telesplat::data::vtk
