#include "services/data/inspect.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "services/data/base/mapped_file.h"
#include "services/data/cloud/cloud.h"
#include "services/data/kinds.h"
#include "services/data/mesh/reader.h"
#include "services/data/mesh/store_file.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {
namespace {

// Returns the unit of the coordinates in a file of this kind.
const char* unit_of(const MeshFileFacts& facts) {
  if (facts.raster)
    return facts.raster->unit.empty()        ? "samples"
           : facts.raster->unit == "degrees" ? "metres, made of the degrees"
                                             : "metres";
  return facts.unit.empty() ? "the file's own units" : facts.unit.c_str();
}

// Returns the same unit as inspect_volume(), but reads only the header.
std::string unit_of_volume(const std::string& path, const MeshOptions& options) {
  const auto source = find_volume(path, options.volume);
  if (!source) return "";
  if (source->dicom) return "mm";
  const auto header = read_volume_header(source->steps[0], options.volume.raw);
  return header ? header->unit : "";
}

const char* normals_of(const MeshFileFacts& facts) {
  if (facts.iso) return "from the volume's gradients";
  if (facts.raster) return "computed from the heights";
  if (is_cloud(facts.info.format)) return "of the squares";
  return facts.info.had_normals ? "in the file" : "none in the file: computed";
}

std::string colours_of(const MeshFileFacts& facts) {
  if (!facts.texture.empty()) return "of the picture " + facts.texture;
  if (facts.raster) return "none in the file: tinted by height";
  if (is_cloud(facts.info.format) && facts.info.had_colours) return "in the file, or its intensity: see the remarks";
  return facts.info.had_colours ? "in the file" : "none in the file: neutral grey";
}

void describe_raster(const RasterFacts& r, const geometry::DBox& box, Description& out) {
  out.row("samples", fmt::format("{} x {} of {}{}", r.width, r.height, r.type,
                                 r.step > 1 ? fmt::format(", every {}th is read", r.step) : ""));
  const std::string reference = r.reference.empty() ? "" : r.reference + ", ";
  if (r.unit.empty())
    out.row("lies at", "the file does not say; a sample counts as one unit");
  else
    out.row("lies at", fmt::format("{}{}: west {:.8g}, east {:.8g}, south {:.8g}, north {:.8g}", reference, r.unit,
                                   r.west, r.east, r.south, r.north));
  if (!r.unit.empty())
    out.row(
        "a sample",
        fmt::format("{:.6g} x {:.6g} {}{}", r.sample_x, r.sample_y, r.unit,
                    r.unit == "metres" ? "" : fmt::format(", {:.4g} x {:.4g} m as shown", r.sample_x_m, r.sample_y_m)));
  const double scale = r.hi > r.lo ? (box.hi.z - box.lo.z) / (r.hi - r.lo) : 1;
  out.row("heights",
          fmt::format("{}{}{}, shown times {:.4g} (--z-scale){}", range_text(r.lo, r.hi), r.unit.empty() ? "" : " m",
                      r.height_m == 1 ? "" : fmt::format(", in the file {} of {:.6g} m", r.height_unit, r.height_m),
                      scale, r.without_data > 0 ? fmt::format("; {} samples have no data", r.without_data) : ""));
  out.json["raster"] = {{"samples", {r.width, r.height}},
                        {"type", r.type},
                        {"step", r.step},
                        {"reference", r.reference},
                        {"unit", r.unit},
                        {"west", r.west},
                        {"east", r.east},
                        {"south", r.south},
                        {"north", r.north},
                        {"sample", {r.sample_x, r.sample_y}},
                        {"sample_m", {r.sample_x_m, r.sample_y_m}},
                        {"heights", {r.lo, r.hi}},
                        {"height_unit", r.height_unit},
                        {"height_unit_m", r.height_m},
                        {"z_scale", scale},
                        {"samples_without_data", r.without_data}};
}

void describe_shape(const MeshFileFacts& facts, Description& out) {
  const MeshStoreInfo& i = facts.info;
  if (is_cloud(i.format)) out.row("points", fmt::format("{}, each a square of two triangles", i.vertices / 4));
  if (is_cloud(i.format)) out.json["points"] = i.vertices / 4;
  out.row("triangles",
          fmt::format(
              "{}{}; {} vertices", i.triangles,
              i.degenerate_dropped > 0 ? fmt::format(" ({} without an area are left out)", i.degenerate_dropped) : "",
              i.vertices));
  out.row("normals", normals_of(facts));
  out.row("colours", colours_of(facts));
  out.json["triangles"] = i.triangles;
  out.json["degenerate"] = i.degenerate_dropped;
  out.json["vertices"] = i.vertices;
  out.json["normals"] = normals_of(facts);
  out.json["colours"] = colours_of(facts);
}

std::string span_text(const scene::ValueSpan& span) {
  return span.empty() ? "no finite values" : range_text(span.lo, span.hi);
}

nlohmann::ordered_json span_json(const scene::ValueSpan& span) {
  return span.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json{span.lo, span.hi};
}

// Lists the arrays that --colour-by takes.
void describe_arrays(const std::vector<scene::ArrayInfo>& arrays, Description& out) {
  constexpr size_t kMostTold = 20;
  out.json["arrays"] = nlohmann::ordered_json::array();
  for (size_t i = 0; i < arrays.size(); ++i) {
    const scene::ArrayInfo& a = arrays[i];
    nlohmann::ordered_json json = {
        {"name", a.name}, {"unit", a.unit}, {"of", a.of_cells ? "faces" : "points"}, {"components", a.components}};
    for (const scene::ValueSpan& span : a.spans) json["spans"].push_back(span_json(span));
    out.json["arrays"].push_back(std::move(json));
    if (i == kMostTold) out.row("", fmt::format("and {} more", arrays.size() - kMostTold));
    if (i >= kMostTold) continue;
    const std::string unit = a.unit.empty() ? "" : " " + a.unit;
    out.row(i == 0 ? "arrays" : "",
            fmt::format("{}, of {}: {}{}", a.name, a.of_cells ? "faces" : "points",
                        a.components > 1 ? fmt::format("{} components, lengths ", a.components) : "",
                        a.spans.empty() ? "" : span_text(a.spans[0]) + unit));
  }
  if (!arrays.empty()) out.row("", "(--colour-by NAME[:MIN:MAX] colours by one)");
}

}  // namespace

MeshFileFacts sum_up(const MeshStoreInfo& info, const std::vector<geometry::ChunkInfo>& chunks) {
  MeshFileFacts facts;
  facts.info = info;
  std::vector<size_t> levels;
  for (const geometry::ChunkInfo& chunk : chunks) {
    levels.push_back(chunk.is_leaf() ? 0 : levels.at(chunk.first_child) + 1);
    facts.levels = std::max(facts.levels, levels.back());
    ++(chunk.is_leaf() ? facts.chunks : facts.coarse_chunks);
    (chunk.is_leaf() ? facts.chunk_bytes : facts.coarse_bytes) += chunk.bytes;
  }
  return facts;
}

Result<MeshFileFacts> inspect_mesh(const std::string& path, const MeshOptions& options, const Progress& progress) {
  const auto store = open_mesh(path, options, progress);
  if (!store) return store.error();
  MeshFileFacts facts = sum_up((*store)->info(), (*store)->chunks());
  std::error_code error;
  facts.file_bytes = std::filesystem::file_size(path, error);
  if (error) facts.file_bytes = 0;  // a folder of slices
  facts.iso = options.iso;
  facts.unit = options.iso ? unit_of_volume(path, options) : facts.info.format == "gltf" ? "metres" : "";
  if (facts.info.format == "raster") {
    const std::string& read = facts.info.source;  // a folder's first file
    const auto file = MappedFile::open(read);
    if (!file) return file.error();
    std::vector<std::string> files = companion_files((*file)->text(), "raster", read);
    files.insert(files.begin(), read);
    auto raster = inspect_raster(files);
    if (!raster) return raster.error();
    facts.raster = std::move(*raster);
    facts.texture = options.elevation.texture;
  }
  return facts;
}

Result<MeshFileFacts> inspect_store(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return Error{fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
  const auto content = read_store(descriptor, path);
  close(descriptor);
  if (!content) return content.error();
  MeshFileFacts facts = sum_up(content->info, content->chunks);
  facts.info.source = path;
  facts.info.from_cache = true;
  facts.file_bytes = content->file->bytes().size();
  return facts;
}

Description describe(const MeshFileFacts& facts) {
  const MeshStoreInfo& i = facts.info;
  Description out(facts.raster ? "raster" : "mesh", fmt::format("{}: {}", i.source,
                                                                facts.raster         ? "an elevation raster"
                                                                : facts.iso          ? "the surface of a volume"
                                                                : is_cloud(i.format) ? "a cloud of points"
                                                                                     : "a mesh"));
  const std::string format = facts.raster ? facts.raster->format : facts.iso ? "volume" : i.format;
  out.row("format", fmt::format("{}{}", format, facts.file_bytes ? ", " + bytes_text(facts.file_bytes) : ""));
  out.json["path"] = i.source;
  out.json["format"] = format;
  out.json["bytes"] = facts.file_bytes;
  out.json["content_hash"] = fmt::format("{:016x}", i.content_hash);
  if (facts.iso) out.row("surface", fmt::format("where the value is {:g} (--iso)", *facts.iso));
  if (facts.iso) out.json["iso"] = *facts.iso;
  if (facts.raster) describe_raster(*facts.raster, i.box_data, out);
  describe_shape(facts, out);
  if (!facts.iso) describe_arrays(i.arrays, out);
  if (!i.array.empty()) {
    out.row("coloured by", i.array + " (--colour-by none: by the file's own colours)");
    out.json["coloured_by"] = i.array;
  }
  const bool on_map = is_cloud(i.format) && i.coordinates.space != scene::Space::kPlain;
  const glm::dvec3 shown = on_map ? i.coordinates.shown : glm::dvec3(1);
  if (on_map) out.row("reference", i.coordinates.reference);
  if (on_map) out.json["reference"] = i.coordinates.reference;
  out.row("box", fmt::format("{} .. {}, {}", vector_text(i.box_data.lo / shown), vector_text(i.box_data.hi / shown),
                             on_map ? fmt::format("{}, heights in {}", i.coordinates.unit, i.coordinates.height_unit)
                                    : unit_of(facts)));
  out.row("size", extent_text(i.box_data.size()) + (on_map ? " m" : ""));
  out.json["box"] = box_json(i.box_data);
  out.json["unit"] = unit_of(facts);
  describe_room(out, i.box_room, i.up, i.up_reason);
  out.row("chunks",
          fmt::format("{}, {}{}", facts.chunks, bytes_text(facts.chunk_bytes), i.from_cache ? ", from the cache" : ""));
  out.json["chunks"] = {{"count", facts.chunks}, {"bytes", facts.chunk_bytes}, {"from_cache", i.from_cache}};
  if (facts.levels > 0)
    out.row("levels", fmt::format("{} above them, {} coarser chunks, {}; {:.1f} bytes a triangle in all", facts.levels,
                                  facts.coarse_chunks, bytes_text(facts.coarse_bytes),
                                  double(facts.chunk_bytes + facts.coarse_bytes) / double(i.triangles)));
  out.json["levels"] = {{"count", facts.levels}, {"chunks", facts.coarse_chunks}, {"bytes", facts.coarse_bytes}};
  for (const std::string& note : i.notes) out.row("remark", note);
  if (!i.notes.empty()) out.json["remarks"] = i.notes;
  return out;
}

bool is_mesh_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return find_mesh_file(path).ok();
  const auto file = MappedFile::open(path);
  return file.ok() && !detect_format((*file)->text(), path).format.empty();
}

std::string why_no_mesh(const std::string& path) {
  const auto file = MappedFile::open(path);
  return file ? detect_format((*file)->text(), path).complaint : "";
}

}  // namespace telesplat::data
