#include "services/data/surface/isosurface.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "common/volume/histogram.h"
#include "services/data/import/iso.h"
#include "services/data/import/process.h"
#include "services/data/volume/statistics.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

constexpr int kBins = 128;

bool write_all(int descriptor, const void* data, size_t bytes) {
  const auto* at = static_cast<const std::byte*>(data);
  while (bytes > 0) {
    const ssize_t n = write(descriptor, at, std::min(bytes, size_t{1} << 30));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    at += n, bytes -= size_t(n);
  }
  return true;
}

// Text as hexadecimal digits of its hash: for file names.
std::string hex(const std::string& text) { return fmt::format("{:016x}", XXH3_64bits(text.data(), text.size())); }

}  // namespace

Result<MeshSource> surface_source(const std::string& path, const std::string& raw, const std::string& series,
                                  double iso, const Progress& progress) {
  auto found = find_volume(path, raw, series);
  if (!found) return found.error();
  const auto read = [source = *found, iso](const ReadProgress& p) -> Result<Mesh> {
    const auto volume = read_volume(source, 0, p);
    if (!volume) return volume.error();
    return isosurface(*volume, iso, source.name);
  };
  const std::string which = raw.empty() && series.empty() ? "" : "-" + hex(raw + series);
  // What the volume's first step is read from: one file, or all slices of a series.
  const auto files = found->dicom ? found->files() : std::vector{found->steps.front()};
  return MeshSource{hash_files(files, progress), fmt::format("-surface{}{}", iso, which), read};
}

Result<Mesh> isosurface(const Volume& volume, double iso, const std::string& name) {
  if (!std::isfinite(iso) || iso <= volume.lo || iso > volume.hi)
    return Error{
        fmt::format("{}: --iso {}: no surface there; its values are {} to {}", name, iso, volume.lo, volume.hi)};
  for (const int n : volume.size)
    if (n < 2)
      return Error{fmt::format("{}: {} x {} x {} voxels are too flat for a surface", name, volume.size[0],
                               volume.size[1], volume.size[2])};
  VolumeHeader header;
  for (size_t a = 0; a < 3; ++a) header.size[a] = volume.size[a];
  header.type = int32_t(volume.type);
  header.iso = (iso - volume.offset) / volume.scale;
  std::memcpy(header.index_to_data, &volume.index_to_data[0][0], sizeof header.index_to_data);
  const int input = memfd_create("telesplat-volume", MFD_CLOEXEC);
  if (input < 0 || !write_all(input, &header, sizeof header) ||
      !write_all(input, volume.stored.data(), volume.stored.size())) {
    const int reason = errno;
    if (input >= 0) close(input);
    return Error{fmt::format("{}: no memory file for its voxels: {}", name, std::strerror(reason))};
  }
  auto mesh = import("VTK's surface", {"iso", name}, {fmt::format("/proc/self/fd/{}", input)});
  close(input);
  if (!mesh) return mesh;
  mesh->frame = volume.box();
  // The store keeps what other values a surface may have.
  mesh->arrays = {{.name = "value", .unit = {}, .spans = {{volume.lo, volume.hi}}}};
  if (const auto levels = choose_levels(volume, volume.lo, volume.hi))
    mesh->arrays[0].histogram = volume::to_text(volume::histogram_of(count_levels(volume, *levels), *levels, kBins));
  mesh->coordinates.space = volume.space;
  mesh->coordinates.unit = volume.unit;
  if (!volume.remark.empty()) mesh->notes.push_back(name + ": " + volume.remark);
  return mesh;
}

}  // namespace telesplat::data
