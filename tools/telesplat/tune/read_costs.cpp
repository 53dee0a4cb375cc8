// A run folder's tables, as far as they tell of costs.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tools/common/json_file.h"
#include "tools/telesplat/report/reading/loose_table.h"
#include "tools/telesplat/sweep/figures.h"
#include "tools/telesplat/tune/costs.h"

namespace telesplat::launcher {
namespace {

using Values = std::vector<double>;
using Tile = std::pair<double, double>;  // frame and number

// What a patch held, by the tile with which it went out.
struct Patch {
  double bytes, points;
};
using Patches = std::map<Tile, Patch>;

Result<Patches> read_tiles(const std::string& path, bool slices, CostSamples& out) {
  const auto table =
      LooseTable::read(path, {"frame", "tile", "samples", "kept", "rays", "bytes_sampled", "bytes_sent", "step",
                              "extra", "sample_begin_s", "sample_end_s", "encode_end_s", "receive_s", "packed_s"});
  if (!table) return table.error();
  const auto column = [&](const char* name) -> const Values& { return table->numbers(name); };
  Patches patches;
  auto& tiles = out.tiles;
  for (size_t i = 0; i < table->rows(); ++i) {
    const double work = slices ? column("samples")[i] : column("rays")[i], kept = column("kept")[i];
    const double begin_s = column("sample_begin_s")[i], sampled_s = column("sample_end_s")[i];
    const double encoded_s = column("encode_end_s")[i], bytes = column("bytes_sent")[i];
    const double packing_s = column("packed_s")[i] - column("receive_s")[i];
    const bool whole = std::isfinite(work + kept + begin_s + sampled_s + encoded_s + packing_s);
    if (!whole || column("step")[i] > 1 || column("extra")[i] > 0) continue;
    tiles.work.push_back(work);
    tiles.samples.push_back(slices ? kept : column("samples")[i]);
    tiles.kept.push_back(kept);
    tiles.bytes_sampled.push_back(column("bytes_sampled")[i]);
    tiles.bytes_sent.push_back(std::isfinite(bytes) ? bytes : 0);
    tiles.sampling_s.push_back(sampled_s - begin_s);
    tiles.encoding_s.push_back(encoded_s - sampled_s);
    tiles.packing_s.push_back(packing_s);
    if (bytes > 0) patches[{column("frame")[i], column("tile")[i]}] = {bytes, kept};
  }
  if (tiles.work.empty()) return Error{fmt::format("{}: has no tile of full resolution", path)};
  return patches;
}

void read_plans(const std::string& path, CostSamples& out) {
  const auto table = LooseTable::read(path, {"extra", "plan_ms", "rays_cast", "rays_full", "rays_validation", "tiles"});
  if (!table) return;  // nothing is steered
  for (size_t i = 0; i < table->rows(); ++i) {
    const double full = table->numbers("rays_full")[i], cast = table->numbers("rays_cast")[i];
    const double plan_ms = table->numbers("plan_ms")[i];
    if (table->numbers("extra")[i] > 0 || !(full > 0) || !std::isfinite(cast + plan_ms)) continue;
    // Nothing was known of the view, as of the first one: that is no view of a steady walk.
    if (cast >= full) continue;
    out.plans.pixels.push_back(full);
    out.plans.seconds.push_back(plan_ms * 1e-3);
    out.plans.cast.push_back(cast);
    out.plans.checked.push_back(table->numbers("rays_validation")[i]);
    out.plans.tiles.push_back(table->numbers("tiles")[i]);
  }
}

void read_stages(const std::string& path, const Patches& patches, CostSamples& out) {
  const auto table =
      LooseTable::read(path, {"frame", "tile", "lease_network_ms", "patch_network_ms", "decoding_ms", "insertion_ms"});
  if (!table) return;
  for (size_t i = 0; i < table->rows(); ++i) {
    const double lease_ms = table->numbers("lease_network_ms")[i];
    if (lease_ms > 0) out.stages.lease_network_s.push_back(lease_ms * 1e-3);
    const auto patch = patches.find({table->numbers("frame")[i], table->numbers("tile")[i]});
    const double way_ms = table->numbers("patch_network_ms")[i];
    const double decode_ms = table->numbers("decoding_ms")[i] + table->numbers("insertion_ms")[i];
    if (patch == patches.end() || !std::isfinite(way_ms + decode_ms)) continue;
    out.stages.patch_network_s.push_back(way_ms * 1e-3);
    out.stages.patch_bytes.push_back(patch->second.bytes);
    out.stages.decode_s.push_back(decode_ms * 1e-3);
    out.stages.patch_points.push_back(patch->second.points);
  }
}

void read_frames(const std::string& path, CostSamples& out) {
  const std::vector<std::string> parts{"project_cpu_ms", "resolve_cpu_ms", "fill_cpu_ms", "smooth_cpu_ms",
                                       "antialias_cpu_ms"};
  std::vector<std::string> names{"select_ms", "construction_ms", "points_drawn"};
  names.insert(names.end(), parts.begin(), parts.end());
  const auto table = LooseTable::read(path, names);
  if (!table) return;
  for (size_t i = 0; i < table->rows(); ++i) {
    double draw_ms = 0;
    for (const std::string& part : parts) draw_ms += table->numbers(part)[i];
    const double select_ms = table->numbers("select_ms")[i], all_ms = table->numbers("construction_ms")[i];
    const double points = table->numbers("points_drawn")[i];
    if (!std::isfinite(draw_ms + select_ms + all_ms + points) || draw_ms <= 0) continue;
    out.frames.select_s.push_back(select_ms * 1e-3);
    out.frames.draw_s.push_back(draw_ms * 1e-3);
    out.frames.construction_s.push_back(all_ms * 1e-3);
    out.frames.points.push_back(points);
  }
}

void read_updates(const std::string& path, double display_width, CostSamples& out) {
  const auto table = LooseTable::read(path, {"samples", "points", "sampling_width"});
  if (!table) return;
  for (size_t i = 0; i < table->rows(); ++i) {
    const double width = table->numbers("sampling_width")[i];
    if (width > 0 && display_width > 0) out.scales.push_back(width / display_width);
    out.update_work.push_back(table->numbers("samples")[i]);
    out.update_pixels.push_back(table->numbers("points")[i]);
  }
}

}  // namespace

Result<CostSamples> read_costs(const std::string& directory, bool slices) {
  const auto summary = tools::read_json_object(directory + "/summary.json");
  if (!summary) return summary.error();
  const Figures figures = flatten(*summary);
  const auto figure = [&](const char* name) {
    const double* found = find(figures, name);
    return found ? *found : 0.0;
  };
  CostSamples out;
  out.samplers = std::max(1, int(figure("samplers")));
  out.updates_per_s = figure("updates_per_s");
  const auto patches = read_tiles(directory + "/tiles.csv", slices, out);
  if (!patches) return patches.error();
  read_plans(directory + "/plans.csv", out);
  read_stages(directory + "/stages.csv", *patches, out);
  read_frames(directory + "/frames.csv", out);
  read_updates(directory + "/updates.csv", figure("size.0"), out);
  return out;
}

}  // namespace telesplat::launcher
