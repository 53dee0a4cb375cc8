// What `telesplat bench volume` found, as tables for people and programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::launcher {

/// One number of samplers and viewers.
struct VolumePoint {
  bool simulated = false;
  int samplers = 0, viewers = 0;
  double fps = 0;              ///< views constructed a second by a viewer, mean of all viewers
  double least_fps = 0;        ///< by the slowest viewer
  double sampling_ms = 0;      ///< a slab's splatting and encoding, median
  double packing_ms = 0;       ///< from a slab's arrival at the packer to its frame's leaving, median
  double construction_ms = 0;  ///< decoding and warping of a view: median; simulated: what was waited for
  double bytes_per_frame = 0;  ///< to a viewer, mean
};

struct VolumeReport {
  std::string volume, size;  ///< for people
  int cores = 0, buffers = 0;
  std::vector<VolumePoint> points;
};

/// Frames a second in a table of the thesis; none where it has no such number of servers and clients.
enum class VolumeTable { kFoot, kTree };  ///< tables 7.3 and 7.4
std::optional<double> thesis_fps(VolumeTable table, int servers, int clients);

/// Tables of frame rates, viewers down, samplers across, beside those of the thesis where they have that number.
std::string to_markdown(const VolumeReport& report);
/// Reads volume.csv, as write_report() writes it. Error: it is not there, or none.
Result<std::vector<VolumePoint>> read_points(const std::string& directory);
/// volume.csv and volume.md in `directory`.
Status write_report(const VolumeReport& report, const std::string& directory);

}  // namespace telesplat::launcher
