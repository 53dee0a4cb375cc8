#include "services/data/surface/isosurface.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>

#include "common/volume/histogram.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/slices.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

constexpr int kBins = 128;

// Returns the hash of a text in hexadecimal digits, for file names.
std::string hex(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

}  // namespace

Result<MeshSource> surface_source(const std::string& path, const VolumeLayout& layout, double iso,
                                  const Progress& progress, const HashMemory& memory) {
  auto found = find_volume(path, layout);
  if (!found) return found.error();
  const auto read = [source = *found, iso](const ReadProgress& p) -> Result<Mesh> {
    const auto volume = read_volume(source, 0, p);
    if (!volume) return volume.error();
    return isosurface(*volume, iso, source.name);
  };
  const std::string said = layout.text(), which = said.empty() ? "" : "-" + hex(said);
  // Files of the volume's first step: one file and those that it names, or all slices of a series.
  const bool several = found->dicom || !found->slices.empty();
  auto files = several ? found->files() : std::vector{found->steps.front()};
  if (!several)
    if (const auto header = read_volume_header(files[0], layout.raw, layout.array)) {
      if (header->data_path != files[0]) files.push_back(header->data_path);
      files.insert(files.end(), header->more_paths.begin(), header->more_paths.end());
    }
  return MeshSource{hash_known_files(files, memory, progress), fmt::format("-surface{}{}", iso, which), read};
}

Result<Mesh> isosurface(const Volume& volume, double iso, const std::string& name) {
  if (!std::isfinite(iso) || iso <= volume.lo || iso > volume.hi)
    return Error{
        fmt::format("{}: --iso {}: no surface there; its values are {} to {}", name, iso, volume.lo, volume.hi)};
  for (const int n : volume.size)
    if (n < 2)
      return Error{fmt::format("{}: {} x {} x {} voxels are too flat for a surface", name, volume.size[0],
                               volume.size[1], volume.size[2])};
  const auto stored = [&](double value) { return (value - volume.offset) / volume.scale; };
  auto mesh = flying_edges(volume, stored(iso), stored(volume.lo), name);
  if (!mesh) return mesh;
  if (mesh->indices.empty()) return Error{fmt::format("{}: has no surface at this value", name)};
  mesh->format = "iso";
  mesh->frame = volume.box();
  // The store keeps the range of other values that a surface may have.
  mesh->arrays = {{.name = "value", .unit = {}, .spans = {{volume.lo, volume.hi}}}};
  if (const auto levels = choose_levels(volume, volume.lo, volume.hi))
    mesh->arrays[0].histogram = volume::to_text(volume::histogram_of(count_levels(volume, *levels), *levels, kBins));
  mesh->coordinates.space = volume.space;
  mesh->coordinates.unit = volume.unit;
  if (!volume.remark.empty()) mesh->notes.push_back(name + ": " + volume.remark);
  return mesh;
}

}  // namespace telesplat::data
