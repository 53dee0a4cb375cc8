// Joins data sets into one mesh.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/scene/colouring.h"
#include "services/data/vtk/cells.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data::vtk {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
constexpr uint32_t kUnused = ~uint32_t{0};

// component -1: the value, or the vector's length.
double value_of(const Array& array, size_t tuple, int component) {
  const size_t first = tuple * array.components;
  if (component >= 0) return array.at(first + size_t(component));
  if (array.components == 1) return array.at(first);
  double squares = 0;
  for (size_t c = 0; c < array.components; ++c) squares += array.at(first + c) * array.at(first + c);
  return std::sqrt(squares);
}

bool is_colour_sized(const Array* a) { return a && (a->components == 3 || a->components == 4); }

// Returns an array that holds colours, or null: active scalars of bytes, then names of colours, then any other bytes.
const Array* find_colours(const Attributes& data) {
  const Array* scalars = data.find(data.scalars);
  if (is_colour_sized(scalars) && scalars->type == StoredType::kU8) return scalars;
  for (const char* name :
       {"RGB", "RGBA", "rgb", "rgba", "Color", "color", "Colors", "colors", "Colours", "colours", "COLOR_0", "color_0"})
    if (const Array* array = data.find(name); is_colour_sized(array)) return array;
  for (const Array& a : data.arrays)
    if (is_colour_sized(&a) && a.type == StoredType::kU8) return &a;
  return nullptr;
}

// Returns the factor that scales a channel to 0..255.
double channel_scale(const Array& colours) {
  if (colours.type == StoredType::kU8) return 1;
  if (colours.type == StoredType::kU16) return 1 / 257.0;
  for (size_t i = 0; i < colours.values; ++i)
    if (colours.at(i) > 1) return 1;
  return 255;
}

uint32_t colour_of(const Array& colours, size_t tuple, double scale) {
  const auto channel = [&](size_t c) {
    const double v = colours.at(tuple * colours.components + c) * scale;
    return v > 0 ? uint32_t(std::min(v, 255.0) + 0.5) : 0;  // NaN becomes 0
  };
  return pack_rgb(channel(0), channel(1), channel(2));
}

// Collects the data sets' points and triangles, one after another.
class Collector {
 public:
  Collector(std::span<const DataSet> sets, std::span<const Surface> surfaces, Mesh& mesh)
      : sets_(sets), surfaces_(surfaces), mesh_(mesh) {}

  void collect(const std::string& path, const std::string& array) {
    size_t triangles = 0;
    for (const Surface& s : surfaces_) triangles += s.cells.size();
    mesh_.indices.reserve(3 * triangles);
    for (size_t s = 0; s < sets_.size(); ++s) add_points(s);
    if (mesh_.positions.size() > kMaxVertices || triangles > kMaxTriangles)
      refuse("{}: its surface has {} triangles, limit {}", path, triangles, kMaxTriangles);
    add_normals();
    list_arrays();
    if (!array.empty()) take(path, array);
    add_colours();
  }

 private:
  // Adds the points that triangles use, in their order.
  void add_points(size_t s) {
    const Surface& surface = surfaces_[s];
    std::vector<uint32_t> places(sets_[s].point_count(), kUnused);
    for (const uint32_t corner : surface.corners) places[corner] = 0;
    std::vector<uint32_t> used;
    for (size_t i = 0; i < places.size(); ++i) {
      if (places[i] == kUnused) continue;
      places[i] = uint32_t(mesh_.positions.size());
      mesh_.positions.push_back(sets_[s].point(i));
      used.push_back(uint32_t(i));
    }
    for (const uint32_t corner : surface.corners) mesh_.indices.push_back(places[corner]);
    used_.push_back(std::move(used));
  }

  void add_normals() {
    const auto normals_of = [](const DataSet& set) {
      const Array* named = set.point_data.find(set.point_data.normals);
      const Array* normals = named ? named : set.point_data.find("Normals");
      return normals && normals->components == 3 ? normals : nullptr;
    };
    if (std::none_of(sets_.begin(), sets_.end(), normals_of)) return;
    for (size_t s = 0; s < sets_.size(); ++s) {
      const Array* n = normals_of(sets_[s]);
      for (const uint32_t i : used_[s])
        mesh_.normals.push_back(n ? glm::vec3(n->at(3 * i), n->at(3 * i + 1), n->at(3 * i + 2)) : glm::vec3(0));
    }
  }

  void add_colours() {
    std::vector<const Array*> of_points, of_cells;
    for (const DataSet& set : sets_) {
      of_points.push_back(find_colours(set.point_data));
      of_cells.push_back(of_points.back() ? nullptr : find_colours(set.cell_data));
    }
    const auto any = [](const auto& arrays) { return std::any_of(arrays.begin(), arrays.end(), std::identity()); };
    const auto colours = [&](const auto& arrays, auto&& tuples_of, uint32_t none) {
      std::vector<uint32_t> out;
      for (size_t s = 0; s < sets_.size(); ++s) {
        const double scale = arrays[s] ? channel_scale(*arrays[s]) : 0;
        for (const uint32_t i : tuples_of(s)) out.push_back(arrays[s] ? colour_of(*arrays[s], i, scale) : none);
      }
      return out;
    };
    if (any(of_points))
      mesh_.colours = colours(
          of_points, [&](size_t s) { return std::span(used_[s]); }, kNeutralAlbedo);
    if (any(of_cells))
      colour_faces(mesh_, colours(
                              of_cells, [&](size_t s) { return std::span(surfaces_[s].cells); }, kNoColour));
  }

  const Attributes& data_of(size_t s, bool cells) const { return cells ? sets_[s].cell_data : sets_[s].point_data; }
  std::span<const uint32_t> tuples_of(size_t s, bool cells) const {
    return cells ? std::span(surfaces_[s].cells) : std::span(used_[s]);
  }

  // Lists arrays; those of equal name and size in different data sets count as one.
  void list_arrays() {
    for (const bool cells : {false, true})
      for (size_t s = 0; s < sets_.size(); ++s)
        for (const Array& array : data_of(s, cells).arrays) list(array, s, cells);
    for (const auto& info : mesh_.arrays) names_.push_back(info.name);
    scene::make_tellable(mesh_.arrays);
  }

  void list(const Array& array, size_t s, bool cells) {
    if (array.name == "vtkGhostType" || array.name == "vtkGhostLevels") return;
    const size_t first = std::count_if(mesh_.arrays.begin(), mesh_.arrays.end(), [](auto& a) { return !a.of_cells; });
    auto info =
        std::find_if(mesh_.arrays.begin() + ptrdiff_t(cells ? first : 0), mesh_.arrays.end(), [&](const auto& a) {
          return a.of_cells == cells && a.name == array.name && a.components == int(array.components) && s > 0;
        });
    if (info == mesh_.arrays.end()) {
      if (mesh_.arrays.size() == scene::kMaxArrays) return;
      info = mesh_.arrays.insert(info, {array.name, array.unit, cells, int(array.components), {}, {}});
      info->spans.resize(array.components == 1 ? 1 : std::min(array.components, size_t(scene::kMaxComponents)) + 1);
    }
    for (const uint32_t i : tuples_of(s, cells))
      for (size_t c = 0; c < info->spans.size(); ++c) info->spans[c].add(value_of(array, i, int(c) - 1));
  }

  void take(const std::string& path, const std::string& wanted) {
    const auto choice = scene::choose_array(mesh_.arrays, wanted);
    if (!choice) refuse("{}: {}", path, choice.error().text);
    const auto& info = mesh_.arrays[choice->index];
    const double origin = scene::scalar_origin(scene::span_of(mesh_.arrays, *choice));
    mesh_.scalars_of_faces = info.of_cells;
    // Files may hold two arrays with the same name.
    size_t same_before = 0;
    for (size_t i = 0; i < choice->index; ++i)
      same_before += names_[i] == names_[choice->index] && mesh_.arrays[i].of_cells == info.of_cells &&
                     mesh_.arrays[i].components == info.components;
    for (size_t s = 0; s < sets_.size(); ++s) {
      const Array* array = nullptr;
      size_t skip = same_before;
      for (const Array& a : data_of(s, info.of_cells).arrays)
        if (!array && a.name == names_[choice->index] && int(a.components) == info.components && skip-- == 0)
          array = &a;
      for (const uint32_t i : tuples_of(s, info.of_cells))
        mesh_.scalars.push_back(
            scene::stored_scalar(array ? value_of(*array, i, choice->component) : kNothing, origin));
    }
  }

  std::span<const DataSet> sets_;
  std::span<const Surface> surfaces_;
  Mesh& mesh_;
  std::vector<std::vector<uint32_t>> used_;  // used points of each data set
  std::vector<std::string> names_;           // names of mesh_.arrays, as in the files
};

void tell(const SurfaceNotes& n, const std::string& path, std::vector<std::string>& notes) {
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) notes.push_back(fmt::format("{}: {} {}", path, count, what));
  };
  add(n.points_and_lines, "points and lines are not shown");
  add(n.ghosts, "ghost or hidden cells are not shown");
  add(n.straightened, "cells of high order are shown by their corners");
  add(n.unknown, "cells of unknown types are not shown");
}

}  // namespace

Result<Mesh> read_mesh(std::string_view content, const std::string& path, Companions& companions,
                       const std::string& array) {
  return or_error([&] {
    Mesh mesh;
    mesh.format = kind_of(content);
    const auto sets = read_data_sets(content, path, companions, mesh.notes);
    SurfaceNotes notes;
    const auto surfaces = surfaces_of(sets, notes);
    Collector(sets, surfaces, mesh).collect(path, array);
    tell(notes, path, mesh.notes);
    return mesh;
  });
}

}  // namespace telesplat::data::vtk
