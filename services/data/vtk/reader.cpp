#include "services/data/vtk/reader.h"

#include <fmt/format.h>

#include <filesystem>

#include "services/data/vtk/files.h"

namespace telesplat::data::vtk {
namespace {

constexpr int kMostLevels = 8;  // files that name files
constexpr size_t kMostFiles = 10'000;

struct KindRow {
  std::string_view type, kind;
};
constexpr KindRow kKinds[] = {{"ImageData", "vti"},
                              {"UniformGrid", "vti"},
                              {"PolyData", "vtp"},
                              {"RectilinearGrid", "vtr"},
                              {"StructuredGrid", "vts"},
                              {"UnstructuredGrid", "vtu"},
                              {"PImageData", "pvti"},
                              {"PPolyData", "pvtp"},
                              {"PRectilinearGrid", "pvtr"},
                              {"PStructuredGrid", "pvts"},
                              {"PUnstructuredGrid", "pvtu"},
                              {"vtkMultiBlockDataSet", "vtm"},
                              {"vtkMultiPieceDataSet", "vtm"},
                              {"vtkPartitionedDataSet", "vtm"},
                              {"vtkPartitionedDataSetCollection", "vtm"},
                              {"vtkHierarchicalBoxDataSet", "vtm"},
                              {"vtkHierarchicalDataSet", "vtm"},
                              {"vtkNonOverlappingAMR", "vtm"},
                              {"vtkOverlappingAMR", "vtm"},
                              {"Collection", "pvd"}};

// The files that an element and those in it name, in their order. pvd: only those of the first time step.
struct Named {
  std::vector<std::string> files;
  size_t steps = 0;
  std::string first_step;
};
Named files_in(const XmlFile& file, const std::string& kind) {
  struct Walker : pugi::xml_tree_walker {
    bool for_each(pugi::xml_node& node) override {
      const std::string_view name = node.name();
      const auto attribute = name == "DataSet" ? node.attribute("file")
                             : name == "Piece" ? node.attribute("Source")
                                               : pugi::xml_attribute();
      if (!attribute || !*attribute.value() || out.files.size() == kMostFiles) return true;
      const std::string step = node.attribute("timestep").value();
      if (series && (out.steps == 0 || step != last)) ++out.steps, last = step;
      if (out.files.empty()) out.first_step = step;
      if (!series || step == out.first_step) out.files.emplace_back(attribute.value());
      return true;
    }
    Named out;
    std::string last;
    bool series = false;
  } walker;
  walker.series = kind == "pvd";
  pugi::xml_node root = file.root();
  root.traverse(walker);
  return std::move(walker.out);
}

std::string beside(const std::string& folder, const std::string& named) {
  return (std::filesystem::path(folder) / named).lexically_normal().string();
}
std::string folder_of(const std::string& path) { return std::filesystem::path(path).parent_path().string(); }

class Reader {
 public:
  Reader(const std::string& path, Companions& companions, std::vector<std::string>& notes)
      : path_(path), companions_(companions), notes_(notes) {}

  // from: this file's folder, relative to the first file's.
  void read(std::string_view content, const std::string& name, const std::string& from, int level) {
    const std::string kind = kind_of(content);
    if (kind.empty()) refuse("{}: is no data set of VTK's that is known", name);
    if (kind == "vtk") {
      sets_.push_back(read_legacy(content, name));
      return;
    }
    const XmlFile file(content, name);
    if (!kind.starts_with('p') && kind != "vtm") {
      for (auto& piece : read_pieces(file)) sets_.push_back(std::move(piece));
      return;
    }
    if (level == kMostLevels) refuse("{}: files name files, {} deep", name, level);
    const Named named = files_in(file, kind);
    if (named.steps > 1)
      notes_.push_back(
          fmt::format("{}: holds {} time steps; the first one is shown ({})", name, named.steps, named.first_step));
    for (const std::string& one : named.files) read_named(beside(from, one), level + 1);
  }

  std::vector<DataSet> sets_;

 private:
  void read_named(const std::string& named, int level) {
    if (++files_ > kMostFiles) refuse("{}: names more than {} files", path_, kMostFiles);
    const auto content = companions_.read(named);
    if (!content) refuse("{}: needs a file that cannot be read: {}", path_, content.error().text);
    return read(*content, beside(folder_of(path_), named), folder_of(named), level);
  }

  const std::string& path_;
  Companions& companions_;
  std::vector<std::string>& notes_;
  size_t files_ = 0;
};

// Lists the files that a file names; damaged files add no names.
void list_named(std::string_view content, const std::string& path, const std::string& from, Companions& companions,
                int level, std::vector<std::string>& out) try {
  const std::string kind = kind_of(content);
  if (level == kMostLevels || !(kind.starts_with('p') || kind == "vtm")) return;
  for (const std::string& one : files_in(XmlFile(content, path), kind).files) {
    if (out.size() == kMostFiles) return;
    const std::string named = beside(from, one);
    out.push_back(named);
    if (const auto inner = companions.read(named))
      list_named(*inner, path, folder_of(named), companions, level + 1, out);
  }
} catch (const Refusal&) {
}

}  // namespace

std::string kind_of(std::string_view content) {
  if (content.starts_with("# vtk DataFile")) return "vtk";
  const auto root = root_tag(content);
  const std::string_view type = root.child("VTKFile").attribute("type").value();
  for (const KindRow& row : kKinds)
    if (row.type == type) return std::string(row.kind);
  return {};
}

bool is_image(std::string_view content) {
  const std::string kind = kind_of(content);
  return kind == "vti" || kind == "pvti" || (kind == "vtk" && legacy_kind(content) == "STRUCTURED_POINTS");
}

bool is_mesh_kind(std::string_view kind) {
  if (kind == "vtk" || kind == "vtm" || kind == "pvd") return true;
  if (kind.starts_with('p')) kind.remove_prefix(1);
  return kind == "vtp" || kind == "vtr" || kind == "vts" || kind == "vtu";
}

std::string active_scalars(std::string_view content) {
  if (!root_tag(content).first_child()) return {};
  try {
    const XmlFile file(content, "");
    const auto data = file.root().child(file.root().attribute("type").value()), piece = data.child("Piece");
    for (const auto element :
         {piece.child("PointData"), data.child("PPointData"), piece.child("CellData"), data.child("PCellData")})
      if (const std::string name = element.attribute("Scalars").value(); !name.empty()) return name;
  } catch (const Refusal&) {
  }
  return {};
}

std::vector<std::string> named_files(std::string_view content, const std::string& path, Companions& companions) {
  std::vector<std::string> out;
  list_named(content, path, "", companions, 0, out);
  return out;
}

std::vector<DataSet> read_data_sets(std::string_view content, const std::string& path, Companions& companions,
                                    std::vector<std::string>& notes) {
  Reader reader(path, companions, notes);
  reader.read(content, path, "", 0);
  return std::move(reader.sets_);
}

}  // namespace telesplat::data::vtk
