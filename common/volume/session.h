// Description of a volume scene, as sent in Hello and Welcome: numbers in `parameters`, texts in `facts`. Step and
// transfer function change with the epoch.
#pragma once

#include <map>
#include <string>

#include "common/volume/grid.h"
#include "common/volume/transfer/function.h"

namespace telesplat::volume {

inline constexpr size_t kMaxArrayName = 200;

struct Session {
  Grid grid;
  Levels levels;
  ValueRange range;
  std::string array;          ///< the file's array, if named; facts["volume_array"]; at most kMaxArrayName bytes
  TransferFunction transfer;  ///< facts["transfer"]: its text form
  bool lit = true;            ///< voxels have normals from their gradient and are shaded
  int steps = 1;              ///< steps of a time-varying volume
  int step = 0;               ///< parameters["volume.step"]: the step that this epoch shows
  double steps_per_s = 0;     ///< speed of playing; 0: stands still
  int part = 0,
      parts =
          1;  ///< in a data server's hello: it holds the slices [size_z * part / parts, size_z * (part + 1) / parts)
  bool operator==(const Session&) const = default;
};

/// "volume.size.x" ... "volume.m00" ... "volume.levels.lo" ... "volume.step", "volume.steps", "volume.part" ...
std::map<std::string, double> to_parameters(const Session& session);
/// "transfer".
std::map<std::string, std::string> to_facts(const Session& session);
/// Ignores other names. Error: a value is missing or beyond its limits.
Result<Session> read_session(const std::map<std::string, double>& parameters,
                             const std::map<std::string, std::string>& facts);

inline constexpr int kMaxSteps = 4096;

}  // namespace telesplat::volume
