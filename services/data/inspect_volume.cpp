// Describes volumes for `telesplat inspect`.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "services/data/inspect.h"
#include "services/data/volume/formats/dicom.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

std::string bars(const std::array<uint64_t, 64>& counts) {
  constexpr const char* kBars[] = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  const double most = std::log1p(double(*std::max_element(counts.begin(), counts.end())));
  std::string out;
  for (const uint64_t n : counts)
    out +=
        kBars[n == 0 ? 0 : std::max<size_t>(1, size_t(std::lround(8 * std::log1p(double(n)) / std::max(most, 1e-9))))];
  return out;
}

// Takes the first step's histogram and facts, before a store takes its voxels.
void take(const Volume& v, VolumeFileFacts& facts) {
  facts.voxel_bytes = v.stored.size();
  const size_t count = v.stored.size() / voxel_bytes(v.type);
  const double scale = v.hi > v.lo ? double(facts.histogram.size()) / (v.hi - v.lo) : 0;
  for (size_t at = 0; at < count; ++at)
    ++facts.histogram[std::min(size_t(std::max(0.0, (v.value(at) - v.lo) * scale)), facts.histogram.size() - 1)];
  facts.volume = {v.size,   v.index_to_data, v.unit, v.space, v.type,       v.scale,  v.offset, {},
                  v.format, v.hounsfield,    v.lo,   v.hi,    v.not_finite, v.remark, v.array};
}

std::string unit_of(const VolumeFileFacts& facts) {
  return facts.volume.unit.empty() ? "the file's own units" : facts.volume.unit;
}

void describe_grid(const VolumeFileFacts& facts, Description& out) {
  const Volume& v = facts.volume;
  const glm::dmat4& m = v.index_to_data;
  const glm::dvec3 i(m[0]), j(m[1]), k(m[2]);
  const glm::dvec3 spacing(glm::length(i), glm::length(j), glm::length(k));
  const bool scaled = v.scale != 1 || v.offset != 0, left = glm::determinant(glm::dmat3(m)) < 0;
  out.row("voxels", fmt::format("{} x {} x {} of {}, {}{}", v.size[0], v.size[1], v.size[2], name_of(v.type),
                                bytes_text(facts.voxel_bytes),
                                scaled ? fmt::format("; value = stored * {:.6g} + {:.6g}", v.scale, v.offset) : ""));
  out.row("spacing", fmt::format("{}, {}", extent_text(spacing), unit_of(facts)));
  out.row("axes", fmt::format("i {}, j {}, k {}: {}-handed", vector_text(i / spacing.x), vector_text(j / spacing.y),
                              vector_text(k / spacing.z), left ? "left" : "right"));
  if (v.space == scene::Space::kLps || v.space == scene::Space::kRas) {
    const bool lps = v.space == scene::Space::kLps;
    out.row("patient", fmt::format("x grows to the {}, y to the {}, z to the head ({})", lps ? "left" : "right",
                                   lps ? "back" : "front", scene::axis_letters(v.space)));
  }
  out.json["space"] = scene::axis_letters(v.space);
  const geometry::DBox box = v.box();
  out.row("box", fmt::format("{} .. {}, {}", vector_text(box.lo), vector_text(box.hi), unit_of(facts)));
  out.row("size", extent_text(box.size()));
  out.json["voxels"] = {v.size[0], v.size[1], v.size[2]};
  out.json["type"] = name_of(v.type);
  out.json["voxel_bytes"] = facts.voxel_bytes;
  out.json["scale"] = v.scale;
  out.json["offset"] = v.offset;
  out.json["spacing"] = vector_json(spacing);
  out.json["unit"] = unit_of(facts);
  for (int a = 0; a < 4; ++a) out.json["index_to_data"].push_back(vector_json(glm::dvec3(m[a])));
  out.json["handed"] = left ? "left" : "right";
  out.json["box"] = box_json(box);
}

// Lists the arrays that a file names, and the shown one.
void describe_arrays(const VolumeFileFacts& facts, Description& out) {
  if (facts.volume.array.empty()) return;
  out.row("array", facts.volume.array);
  out.json["array"] = facts.volume.array;
  out.json["arrays"] = facts.arrays;
  if (facts.arrays.size() > 1)
    out.row("", fmt::format("of {} (--array NAME shows another)", fmt::join(facts.arrays, ", ")));
}

void describe_values(const VolumeFileFacts& facts, Description& out) {
  const Volume& v = facts.volume;
  const volume::ValueRange& range = facts.session.range;
  const size_t steps = facts.source.steps.size();
  std::string of;
  if (steps > 1 && facts.steps_read == steps) of = fmt::format(", of all {} steps", steps);
  if (steps > 1 && facts.steps_read < steps)
    of = fmt::format(", of the first step alone: the {} steps together are more than is kept in memory", steps);
  out.row("values",
          fmt::format("{}{}{}{}", range_text(range.lo, range.hi), range.hounsfield ? ", Hounsfield units (a CT)" : "",
                      of, v.not_finite > 0 ? fmt::format("; {} voxels are not finite", v.not_finite) : ""));
  out.row("", fmt::format("mostly {} where it is not background", range_text(range.typical_lo, range.typical_hi)));
  out.row("histogram", fmt::format("|{}| (log{})", bars(facts.histogram),
                                   steps > 1 ? "; first step, " + range_text(v.lo, v.hi) : ""));
  out.json["values"] = {{"lo", range.lo},
                        {"hi", range.hi},
                        {"typical_lo", range.typical_lo},
                        {"typical_hi", range.typical_hi},
                        {"hounsfield", range.hounsfield},
                        {"not_finite", v.not_finite},
                        {"steps_read", facts.steps_read}};
  out.json["histogram"] = {{"lo", v.lo}, {"hi", v.hi}, {"counts", facts.histogram}};
}

void describe_choices(const VolumeFileFacts& facts, Description& out) {
  const std::string transfer = volume::to_text(facts.session.transfer);
  out.row("shown with", fmt::format("--tf {} ({})", facts.transfer, facts.transfer_reason));
  out.json["transfer"] = {{"name", facts.transfer}, {"reason", facts.transfer_reason}, {"points", transfer}};
  out.json["levels"] = facts.session.levels.count;
  out.json["lighting"] = facts.session.lit;
}

void describe_steps(const VolumeFileFacts& facts, Description& out) {
  const auto& steps = facts.source.steps;
  const auto name = [](const std::string& path) { return fs::path(path).filename().string(); };
  out.json["steps"] = steps;
  out.json["steps_per_s"] = facts.session.steps_per_s;
  if (steps.size() < 2) return;
  const double rate = facts.session.steps_per_s;
  out.row("steps", fmt::format("{}: {} .. {}, {}", steps.size(), name(steps.front()), name(steps.back()),
                               rate > 0 ? fmt::format("{:.4g} a second (--series-rate)", rate) : "standing still"));
}

}  // namespace

Result<VolumeFileFacts> inspect_volume(const std::string& path, const VolumeOptions& options,
                                       const PlacementOptions& placement, const Progress& progress) {
  VolumeFileFacts facts;
  facts.path = path;
  const auto source = find_volume(path, options);
  if (!source) return source.error();
  facts.source = *source;
  if (auto status = check_steps(facts.source); !status) return status.error();
  facts.steps_read = 0;
  const StepReader read = [&](size_t step, const ReadProgress& told) {
    auto volume = read_volume(*source, step, told);
    if (volume && step == 0) take(*volume, facts);
    facts.steps_read += volume.ok();
    return volume;
  };
  const Progress silent = [](const char*, double) {};
  const auto store =
      VolumeStore::make(read, source->steps.size(), path, options, placement, progress ? progress : silent);
  if (!store) return store.error();
  facts.session = (*store)->session();
  if (!facts.volume.array.empty())
    if (const auto header = read_volume_header(source->steps[0], options.raw, options.array))
      facts.arrays = header->arrays;
  std::error_code error;
  for (const std::string& file : source->files()) facts.file_bytes += fs::file_size(file, error);
  facts.up = up_of_volume(placement);
  facts.up_reason = placement.up == "auto" ? "volumes stand on z" : "--up";
  facts.transfer =
      options.transfer.empty() ? std::string(volume::fitting_preset(facts.session.range)) : options.transfer;
  facts.transfer_reason = !options.transfer.empty()        ? "--tf"
                          : facts.session.range.hounsfield ? "fits Hounsfield units"
                                                           : "fits values of no known unit";
  for (size_t i = 0; source->dicom && i < source->dicom->all.size(); ++i)
    facts.series.push_back(text_of(source->dicom->all[i], i));
  return facts;
}

Description describe(const VolumeFileFacts& facts) {
  Description out("volume", fmt::format("{}: a volume{}", facts.path,
                                        facts.source.steps.size() > 1 ? " that changes with time" : ""));
  out.row("format", fmt::format("{}, {}", facts.volume.format, bytes_text(facts.file_bytes)));
  out.json["path"] = facts.path;
  out.json["name"] = facts.source.name;
  out.json["format"] = facts.volume.format;
  out.json["bytes"] = facts.file_bytes;
  describe_grid(facts, out);
  describe_arrays(facts, out);
  describe_values(facts, out);
  describe_steps(facts, out);
  describe_room(out, facts.session.grid.box_room(), facts.up, facts.up_reason);
  describe_choices(facts, out);
  for (size_t i = 0; i < facts.series.size() && facts.series.size() > 1; ++i)
    out.row(i == 0 ? "series" : "", facts.series[i]);
  if (!facts.series.empty()) out.json["series"] = facts.series;
  if (!facts.volume.remark.empty()) out.row("remark", facts.volume.remark);
  if (!facts.volume.remark.empty()) out.json["remark"] = facts.volume.remark;
  return out;
}

}  // namespace telesplat::data
