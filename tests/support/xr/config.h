// Options of the test runtime: TELESPLAT_XR_TEST="key=value;key=value".
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "common/core/result.h"
#include "common/geometry/trajectory.h"

namespace telesplat::xr_test {

/// Times count from the begin of the first session; each fault happens once.
struct Config {
  geometry::Trajectory head = geometry::Trajectory::orbit();  ///< in the stage
  double rate_hz = 72;
  int width = 1024, height = 1024;    ///< recommended for an eye
  double fov_deg = 90, cant_deg = 0;  ///< for an eye; cant: how far it looks outwards
  double eye_distance_m = 0.063;
  std::string out;   ///< folder for pictures and tables; empty: writes none
  int every = 0;     ///< writes the pictures of every N-th frame; 0: of no frame
  bool exr = false;  ///< also as EXR with depth
  bool stage = true, depth = true, hands = true;
  std::optional<double> lost_s, gone_s, exit_s;  ///< session lost, instance lost, the person quits
  std::optional<std::pair<double, double>> hidden_s, untracked_s, pressed_s;  ///< from, to
  int discard_every = 0;  ///< every N-th xrBeginFrame reports that the frame before was discarded
  std::optional<double> recentre_s;
  glm::dvec3 recentre_by_m{0.0};  ///< the move of the space's origin
  std::string fails;              ///< the function that fails once
  double fails_s = 0;
};

/// Keys: trajectory=orbit|still|FILE, rate, size=WxH, fov, cant, eyes (distance), out, every, exr=on, stage=off,
/// depth=off, hands=off, lost=T, gone=T, exit=T, hidden=T-T, untracked=T-T, pressed=T-T, discard=N, recentre=T:X,Y,Z,
/// fails=FUNCTION@T. Error: names the key and its value.
Result<Config> parse_config(const std::string& text);

}  // namespace telesplat::xr_test
