// What `telesplat inspect` says of a volume.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "services/data/inspect.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

uint64_t bytes_of(const std::string& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return fs::file_size(path, error);
  uint64_t bytes = 0;
  for (fs::directory_iterator entry(path, error), end; !error && entry != end; entry.increment(error))
    if (entry->is_regular_file(error)) bytes += entry->file_size(error);
  return bytes;
}

std::string bars(const std::array<uint64_t, 64>& counts) {
  constexpr const char* kBars[] = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double most = std::log1p(double(*std::max_element(counts.begin(), counts.end())));
  std::string out;
  for (const uint64_t n : counts)
    out +=
        kBars[n == 0 ? 0 : std::max<size_t>(1, size_t(std::lround(8 * std::log1p(double(n)) / std::max(most, 1e-9))))];
  return out;
}

std::string text(const glm::dvec3& v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

}  // namespace

Result<VolumeFileFacts> inspect_volume(const std::string& path, const std::string& raw, const ReadProgress& progress) {
  VolumeFileFacts facts;
  const auto source = find_volume(path, raw);
  if (!source) return source.error();
  facts.source = *source;
  if (auto status = check_steps(facts.source); !status) return status.error();
  auto volume = read_volume(facts.source, 0, progress);
  if (!volume) return volume.error();
  facts.volume = std::move(*volume);
  facts.file_bytes = bytes_of(facts.source.steps[0]);
  const Volume& v = facts.volume;
  const size_t count = v.stored.size() / voxel_bytes(v.type);
  const double scale = v.hi > v.lo ? double(facts.histogram.size()) / (v.hi - v.lo) : 0;
  for (size_t at = 0; at < count; ++at)
    ++facts.histogram[std::min(size_t(std::max(0.0, (v.value(at) - v.lo) * scale)), facts.histogram.size() - 1)];
  return facts;
}

std::string describe(const VolumeFileFacts& facts) {
  const Volume& v = facts.volume;
  const glm::dmat4& m = v.index_to_data;
  const glm::dvec3 i(m[0]), j(m[1]), k(m[2]);
  const glm::dvec3 spacing(glm::length(i), glm::length(j), glm::length(k));
  std::string out;
  out += fmt::format("file        {}\n", facts.source.name);
  out += fmt::format("format      {}, {} bytes\n", v.format, facts.file_bytes);
  out += fmt::format(
      "voxels      {} x {} x {} of {}, {:.1f} MB{}\n", v.size[0], v.size[1], v.size[2], name_of(v.type),
      double(v.stored.size()) * 1e-6,
      v.scale == 1 && v.offset == 0 ? "" : fmt::format("; value = stored * {:.6g} + {:.6g}", v.scale, v.offset));
  out += fmt::format("spacing     {:.6g} x {:.6g} x {:.6g}, in the file's units\n", spacing.x, spacing.y, spacing.z);
  out += fmt::format("size        {:.6g} x {:.6g} x {:.6g}\n", spacing.x * v.size[0], spacing.y * v.size[1],
                     spacing.z * v.size[2]);
  out += fmt::format("axes        i {}, j {}, k {}: {}-handed\n", text(i / spacing.x), text(j / spacing.y),
                     text(k / spacing.z), glm::determinant(glm::dmat3(m)) < 0 ? "left" : "right");
  out += fmt::format("begins at   {}\n", text(glm::dvec3(m[3])));
  out += fmt::format("values      {:.6g} .. {:.6g}{}{}\n", v.lo, v.hi, v.hounsfield ? ", Hounsfield units (a CT)" : "",
                     v.not_finite > 0 ? fmt::format("; {} voxels are not finite", v.not_finite) : "");
  out += fmt::format("histogram   |{}| (log)\n", bars(facts.histogram));
  if (facts.source.steps.size() > 1)
    out += fmt::format("steps       {}: {} .. {}\n", facts.source.steps.size(),
                       fs::path(facts.source.steps.front()).filename().string(),
                       fs::path(facts.source.steps.back()).filename().string());
  if (!v.remark.empty()) out += fmt::format("remark      {}\n", v.remark);
  return out;
}

}  // namespace telesplat::data
