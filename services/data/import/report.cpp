#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "services/data/base/mapped_file.h"
#include "services/data/import/process.h"
#include "services/data/import/raster_facts.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {
namespace {

constexpr size_t kMaxCoordinates = 2000;  // bytes of their text

// Head of a report; the error's text or the mesh follows.
struct Report {
  uint64_t text_bytes = 0;  // length of an error's text; 0: a mesh follows
  uint64_t vertices = 0, triangles = 0, degenerate = 0;
  uint32_t normals = 0, colours = 0;
  uint64_t scalars = 0;            // number of scalars
  uint32_t of_faces = 0;           // 1: one scalar per triangle
  uint32_t arrays_bytes = 0;       // length of the arrays as scene::to_text()
  uint64_t notes_bytes = 0;        // notes, each ended by a line feed
  uint64_t coordinates_bytes = 0;  // length of the coordinates as scene::to_text()
  uint64_t copies = 0;             // vertices that are copies
  uint64_t smooth = 0;             // Mesh::smooth
};

template <class Array>
bool take(std::span<const std::byte>& bytes, uint64_t count, Array& out) {
  constexpr size_t kEach = sizeof(typename Array::value_type);
  if (count > bytes.size() / kEach) return false;
  out.resize(count);
  if (count > 0) std::memcpy(out.data(), bytes.data(), count * kEach);
  bytes = bytes.subspan(count * kEach);
  return true;
}

// Head of a report on heights; an error's text, or heights, colours, notes and coordinates follow.
struct HeightsReport {
  uint64_t text_bytes = 0;  // as in Report
  uint64_t colours = 0;     // number of colours
  uint64_t notes_bytes = 0, coordinates_bytes = 0;
  double first[2] = {}, along_row[2] = {}, along_column[2] = {};
  int32_t width = 0, height = 0, step = 1, georeferenced = 0;
};

// Makes a file's text one line: it may hold any characters.
std::string line_of(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  return text.substr(0, 300);
}

}  // namespace

bool write_import_report(int descriptor, const Result<Mesh>& result) {
  Report report;
  if (!result) {
    const std::string& text = result.error().text;
    report.text_bytes = text.size();
    return write_all(descriptor, &report, sizeof report) && write_all(descriptor, text.data(), text.size());
  }
  const Mesh& mesh = *result;
  const std::string arrays = mesh.arrays.empty() ? "" : scene::to_text(mesh.arrays);
  const std::string coordinates = scene::to_text(mesh.coordinates);
  std::string notes;
  for (const auto& note : mesh.notes) notes += note + "\n";
  report = {0,
            mesh.positions.size(),
            mesh.indices.size() / 3,
            mesh.degenerate_dropped,
            !mesh.normals.empty(),
            !mesh.colours.empty(),
            mesh.scalars.size(),
            mesh.scalars_of_faces,
            static_cast<uint32_t>(arrays.size()),
            notes.size(),
            coordinates.size(),
            mesh.copy_of.size(),
            mesh.smooth};
  const auto put = [&](const auto& array) {
    return write_all(descriptor, array.data(), array.size() * sizeof(array[0]));
  };
  return write_all(descriptor, &report, sizeof report) && put(mesh.positions) && put(mesh.normals) &&
         put(mesh.colours) && put(mesh.indices) && put(mesh.scalars) && put(mesh.copy_of) && put(arrays) &&
         put(notes) && put(coordinates);
}

Result<Mesh> read_import_report(int descriptor, const std::string& path, const std::string& format) {
  const auto mapped = MappedFile::map(descriptor, path);
  const Error incomplete{fmt::format("{}: what {} left of it is incomplete", path, kImportProgram)};
  if (!mapped || (*mapped)->bytes().size() < sizeof(Report)) return incomplete;
  Report report;
  std::memcpy(&report, (*mapped)->bytes().data(), sizeof report);
  auto rest = (*mapped)->bytes().subspan(sizeof report);
  if (report.text_bytes > 0) return Error{std::string((*mapped)->text().substr(sizeof report, report.text_bytes))};
  Mesh mesh;
  mesh.format = format;
  mesh.degenerate_dropped = report.degenerate;
  const bool whole =
      take(rest, report.vertices, mesh.positions) && take(rest, report.normals ? report.vertices : 0, mesh.normals) &&
      take(rest, report.colours ? report.vertices : 0, mesh.colours) && report.triangles <= kMaxTriangles &&
      take(rest, 3 * report.triangles, mesh.indices) &&
      (report.scalars == 0 || report.scalars == (report.of_faces ? report.triangles : report.vertices)) &&
      take(rest, report.scalars, mesh.scalars) && report.copies <= report.vertices &&
      take(rest, report.copies, mesh.copy_of) && std::all_of(mesh.copy_of.begin(), mesh.copy_of.end(), [&](uint32_t v) {
        return v < report.vertices - report.copies;
      });
  mesh.scalars_of_faces = report.of_faces != 0;
  mesh.smooth = report.smooth != 0;
  std::string arrays_text, notes, coordinates_text;
  if (!whole || report.arrays_bytes > scene::kMaxArraysText || report.coordinates_bytes > kMaxCoordinates ||
      !take(rest, report.arrays_bytes, arrays_text) || !take(rest, report.notes_bytes, notes) ||
      !take(rest, report.coordinates_bytes, coordinates_text))
    return incomplete;
  auto arrays = scene::arrays_from_text(arrays_text);
  if (!arrays) return Error{fmt::format("{}: {}", path, arrays.error().text)};
  mesh.arrays = *std::move(arrays);
  std::istringstream lines(notes);
  for (std::string note; std::getline(lines, note);) mesh.notes.push_back(note);
  auto coordinates = scene::coordinates_from_text(coordinates_text);
  if (!coordinates) return Error{fmt::format("{}: {}", path, coordinates.error().text)};
  mesh.coordinates = *std::move(coordinates);
  return mesh;
}

bool write_heights_report(int descriptor, const Result<ElevationRaster>& result) {
  HeightsReport report;
  if (!result) {
    const std::string& text = result.error().text;
    report.text_bytes = text.size();
    return write_all(descriptor, &report, sizeof report) && write_all(descriptor, text.data(), text.size());
  }
  const ElevationRaster& raster = *result;
  const std::string coordinates = scene::to_text(raster.coordinates);
  std::string notes;
  for (const auto& note : raster.notes) notes += note + "\n";
  report.colours = raster.colours.size();
  report.notes_bytes = notes.size(), report.coordinates_bytes = coordinates.size();
  for (int a = 0; a < 2; ++a) {
    report.first[a] = raster.first[a];
    report.along_row[a] = raster.along_row[a], report.along_column[a] = raster.along_column[a];
  }
  report.width = raster.width, report.height = raster.height, report.step = raster.step;
  report.georeferenced = raster.georeferenced;
  const auto put = [&](const auto& array) {
    return write_all(descriptor, array.data(), array.size() * sizeof(array[0]));
  };
  return write_all(descriptor, &report, sizeof report) && put(raster.heights) && put(raster.colours) && put(notes) &&
         put(coordinates);
}

Result<ElevationRaster> read_heights_report(int descriptor, const std::string& path) {
  const auto mapped = MappedFile::map(descriptor, path);
  const Error incomplete{fmt::format("{}: what {} left of it is incomplete", path, kImportProgram)};
  if (!mapped || (*mapped)->bytes().size() < sizeof(HeightsReport)) return incomplete;
  HeightsReport report;
  std::memcpy(&report, (*mapped)->bytes().data(), sizeof report);
  auto rest = (*mapped)->bytes().subspan(sizeof report);
  if (report.text_bytes > 0) return Error{std::string((*mapped)->text().substr(sizeof report, report.text_bytes))};
  ElevationRaster out;
  std::string notes, coordinates_text;
  const uint64_t samples = report.width > 0 && report.height > 0 ? uint64_t(report.width) * uint64_t(report.height) : 0;
  if (samples == 0 || !take(rest, samples, out.heights) || (report.colours != 0 && report.colours != samples) ||
      !take(rest, report.colours, out.colours) || report.coordinates_bytes > kMaxCoordinates ||
      !take(rest, report.notes_bytes, notes) || !take(rest, report.coordinates_bytes, coordinates_text))
    return incomplete;
  out.width = report.width, out.height = report.height, out.step = report.step;
  out.georeferenced = report.georeferenced != 0;
  for (int a = 0; a < 2; ++a) {
    out.first[a] = report.first[a];
    out.along_row[a] = report.along_row[a], out.along_column[a] = report.along_column[a];
  }
  std::istringstream lines(notes);
  for (std::string note; std::getline(lines, note);) out.notes.push_back(note);
  auto coordinates = scene::coordinates_from_text(coordinates_text);
  if (!coordinates) return Error{fmt::format("{}: {}", path, coordinates.error().text)};
  out.coordinates = *std::move(coordinates);
  return out;
}

Mesh to_notes(const RasterFacts& f) {
  Mesh out;
  for (const std::string& text : {f.format, f.type, f.reference, f.unit, f.height_unit})
    out.notes.push_back(line_of(text));
  out.notes.push_back(fmt::format("{} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", f.width, f.height, f.step, f.west,
                                  f.south, f.east, f.north, f.sample_x, f.sample_y, f.sample_x_m, f.sample_y_m, f.lo,
                                  f.hi, f.height_m, f.without_data));
  return out;
}

Result<RasterFacts> inspect_raster(const std::vector<std::string>& files) {
  const std::string& path = files[0];
  auto mesh = import("GDAL's raster", {"raster-facts", path}, files);
  if (!mesh) return mesh.error();
  auto& notes = mesh->notes;
  RasterFacts f;
  std::istringstream in(notes.size() == 6 ? notes[5] : "");
  in >> f.width >> f.height >> f.step >> f.west >> f.south >> f.east >> f.north >> f.sample_x >> f.sample_y >>
      f.sample_x_m >> f.sample_y_m >> f.lo >> f.hi >> f.height_m >> f.without_data;
  if (!in) return Error{fmt::format("{}: what {} left of it is incomplete", path, kImportProgram)};
  f.format = notes[0], f.type = notes[1], f.reference = notes[2], f.unit = notes[3], f.height_unit = notes[4];
  return f;
}

}  // namespace telesplat::data
