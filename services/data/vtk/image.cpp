#include "services/data/vtk/reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "services/data/vtk/files.h"

namespace telesplat::data::vtk {
namespace {

// An array as the file's words describe it.
struct ArrayRow {
  std::string name;
  bool of_cells = false;
  StoredType type = StoredType::kU8;
  size_t components = 1;
  bool text = false;
};

void choose(const std::vector<ArrayRow>& rows, const std::string& wanted, const std::string (&active)[2], Image& out,
            const std::string& path) {
  for (const ArrayRow& row : rows) out.arrays.push_back(row.name);
  const ArrayRow* chosen = nullptr;
  const auto first = [&](auto&& fits) {
    const auto found = chosen ? rows.end() : std::find_if(rows.begin(), rows.end(), fits);
    if (found != rows.end()) chosen = &*found;
  };
  if (!wanted.empty()) {
    first([&](const ArrayRow& r) { return r.name == wanted; });
    if (!chosen) refuse("{}: has no array \"{}\"; it has: {}", path, wanted, fmt::join(out.arrays, ", "));
  }
  for (const bool cells : {false, true}) {
    first([&](const ArrayRow& r) { return r.of_cells == cells && r.name == active[cells] && r.components == 1; });
    first([&](const ArrayRow& r) { return r.of_cells == cells && r.components == 1; });
  }
  first([](const ArrayRow&) { return true; });
  if (!chosen) return;
  out.array = chosen->name, out.of_cells = chosen->of_cells, out.type = chosen->type;
  out.components = chosen->components, out.text = chosen->text;
}

std::vector<ArrayRow> rows_in(pugi::xml_node points, pugi::xml_node cells, const char* element) {
  std::vector<ArrayRow> out;
  for (const bool of_cells : {false, true})
    for (const auto node : (of_cells ? cells : points).children(element)) {
      const std::string_view format = node.attribute("format").value();
      ArrayRow row{node.attribute("Name").value(),
                   of_cells,
                   {},
                   std::max(node.attribute("NumberOfComponents").as_uint(1), 1u),
                   format == "ascii" || (format.empty() && !node.attribute("offset"))};
      if (type_of(node.attribute("type").value(), row.type) && row.name != "vtkGhostType")
        out.push_back(std::move(row));
    }
  return out;
}

Image legacy_header(std::string_view content, const std::string& path, const std::string& array) {
  const auto set = read_legacy(content, path, false);
  Image out;
  out.extent = set.extent, out.index_to_data = set.index_to_data, out.bytes = content.size();
  out.packed = true;  // or text: the parser has compared sizes with the file's
  std::vector<ArrayRow> rows;
  for (const bool cells : {false, true})
    for (const Array& a : (cells ? set.cell_data : set.point_data).arrays)
      rows.push_back({a.name, cells, a.type, a.components, false});
  choose(rows, array, {set.point_data.scalars, set.cell_data.scalars}, out, path);
  return out;
}

// Calls f(content, name) for the file, or for those that it names.
template <class F>
void each_file(std::string_view content, const std::string& path, Companions& companions, F&& f) {
  if (kind_of(content) != "pvti") return f(content, path);
  for (const std::string& named : named_files(content, path, companions)) {
    const auto one = companions.read(named);
    if (!one) refuse("{}: needs a file that cannot be read: {}", path, one.error().text);
    f(*one, (std::filesystem::path(path).parent_path() / named).string());
  }
}

std::array<int64_t, 3> sides_of(const std::array<int64_t, 6>& extent, bool cells) {
  std::array<int64_t, 3> out;
  for (size_t a = 0; a < 3; ++a) {
    out[a] = extent[2 * a + 1] - extent[2 * a] + (cells ? 0 : 1);
    if (cells) out[a] = std::max<int64_t>(out[a], 1);
  }
  return out;
}

class Assembly {
 public:
  explicit Assembly(const Image& image) : image_(image), sides_(sides_of(image.extent, image.of_cells)) {}

  void add(Array array, const std::array<int64_t, 6>& extent, const std::string& name) {
    if (array.type != image_.type || array.components != 1)
      refuse("{}: array {} has {} components of {}, elsewhere 1 of {}", name, array.name, array.components,
             name_of(array.type), name_of(image_.type));
    const size_t size = stored_bytes(array.type);
    if (extent == image_.extent) {
      if (array.owned.empty()) array.owned.assign(array.data, array.data + array.values * size);
      out_ = std::move(array.owned), filled_ = out_.size() / size;
      return;
    }
    const size_t all = size_t(sides_[0]) * size_t(sides_[1]) * size_t(sides_[2]);
    out_.resize(all * size), there_.resize(all);
    const auto sides = sides_of(extent, image_.of_cells);
    for (size_t a = 0; a < 3; ++a)
      if (extent[2 * a] < image_.extent[2 * a] || extent[2 * a + 1] > image_.extent[2 * a + 1])
        refuse("{}: the extent {} of a piece is not within {}", name, fmt::join(extent, " "),
               fmt::join(image_.extent, " "));
    for (int64_t k = 0; k < sides[2]; ++k)
      for (int64_t j = 0; j < sides[1]; ++j) {
        const auto at = [&](size_t a, int64_t i) { return extent[2 * a] - image_.extent[2 * a] + i; };
        const size_t to = size_t(at(0, 0) + sides_[0] * (at(1, j) + sides_[1] * at(2, k)));
        std::memcpy(out_.data() + to * size, array.data + size_t(sides[0] * (j + sides[1] * k)) * size,
                    size_t(sides[0]) * size);
        for (size_t i = to; i < to + size_t(sides[0]); ++i) filled_ += !there_[i], there_[i] = true;
      }
  }

  std::vector<std::byte> finish(const std::string& path) {
    const size_t all = size_t(sides_[0] * sides_[1] * sides_[2]);
    if (filled_ == all) return std::move(out_);
    refuse("{}: has {} values for {} x {} x {} voxels", path, filled_, sides_[0], sides_[1], sides_[2]);
  }

 private:
  const Image& image_;
  const std::array<int64_t, 3> sides_;
  std::vector<std::byte> out_;
  std::vector<bool> there_;
  size_t filled_ = 0;
};

Image xml_header(const XmlFile& file, std::string_view content, const std::string& path, Companions& companions,
                 const std::string& array) {
  const auto root = file.root();
  const auto image = root.child(root.attribute("type").value());
  Image out;
  const std::string_view extent = image.attribute("WholeExtent").value();
  if (!is_image(content) || !image.attribute("WholeExtent"))
    refuse("{}: is no VTK image: no ImageData with a WholeExtent", path);
  if (!parse_extent(extent, out.extent))
    refuse("{}: its WholeExtent, {}, is no extent: six whole numbers", path, extent.substr(0, 80));
  for (size_t a = 0; a < 6; ++a)
    if (std::abs(double(out.extent[a])) > 1e9 || (a % 2 == 1 && out.extent[a] < out.extent[a - 1]))
      refuse("{}: claims the extent {}", path, extent.substr(0, 80));
  out.index_to_data = placement_of(image);
  out.packed = !std::string_view(root.attribute("compressor").value()).empty();
  const auto piece = image.child("Piece");
  const bool parallel = kind_of(content) == "pvti";
  const auto points = parallel ? image.child("PPointData") : piece.child("PointData");
  const auto cells = parallel ? image.child("PCellData") : piece.child("CellData");
  const auto rows = rows_in(points, cells, parallel ? "PDataArray" : "DataArray");
  choose(rows, array, {points.attribute("Scalars").value(), cells.attribute("Scalars").value()}, out, path);
  each_file(content, path, companions, [&](std::string_view one, const std::string&) { out.bytes += one.size(); });
  out.packed = out.packed || parallel, out.text = out.text && !parallel;  // the named files may be packed or text
  return out;
}

std::vector<std::byte> values_of(const Image& image, std::string_view content, const std::string& path,
                                 Companions& companions) {
  if (image.array.empty()) refuse("{}: has no values that can be shown", path);
  if (image.components != 1) refuse("{}: has {} components a voxel, supported is 1", path, image.components);
  Assembly assembly(image);
  if (kind_of(content) == "vtk") {
    auto set = read_legacy(content, path);
    for (Array& array : (image.of_cells ? set.cell_data : set.point_data).arrays)
      if (array.name == image.array) assembly.add(std::move(array), set.extent, path);
    return assembly.finish(path);
  }
  each_file(content, path, companions, [&](std::string_view one, const std::string& name) {
    const XmlFile file(one, name);
    for (const auto piece : file.root().child("ImageData").children("Piece")) {
      const auto extent = piece_extent(file, piece.attribute("Extent").value());
      const auto sides = sides_of(extent, image.of_cells);
      const auto node = piece.child(image.of_cells ? "CellData" : "PointData")
                            .find_child_by_attribute("DataArray", "Name", image.array.c_str());
      assembly.add(file.array(node, sides[0] * sides[1] * sides[2]), extent, name);
    }
  });
  return assembly.finish(path);
}

}  // namespace

Result<Image> read_image_header(std::string_view content, const std::string& path, Companions& companions,
                                const std::string& array) {
  if (legacy_kind(content) == "STRUCTURED_POINTS") return or_error([&] { return legacy_header(content, path, array); });
  std::optional<XmlFile> file;
  if (const auto opened = or_error([&] { file.emplace(content, path); }); !opened)
    return Error{opened.error().text + "; an image has a WholeExtent"};
  return or_error([&] { return xml_header(*file, content, path, companions, array); });
}

Result<std::vector<std::byte>> read_image(const Image& image, std::string_view content, const std::string& path,
                                          Companions& companions) {
  return or_error([&] { return values_of(image, content, path, companions); });
}

}  // namespace telesplat::data::vtk
