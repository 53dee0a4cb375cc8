// What the person who starts the master can choose, and what a session makes of it: what was not given is decided by
// the kind of scene (scene::Policy), here and nowhere else. Everyone else is told the outcome.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "common/julia/timeline.h"
#include "common/scene/kind.h"
#include "services/master/gate/gate.h"
#include "services/master/views.h"

namespace telesplat::master {

/// Whether a view arrives coarse first.
enum class Progressive {
  kAuto,  ///< as the kind of scene has it
  kOn,
  kOff
};

/// What the packer does with samples of what the model shows already.
enum class Redundancy {
  kAuto,       ///< as the kind of scene has it
  kEliminate,  ///< does not pack them
  kKeep        ///< packs everything; viewers draw the best patches
};

/// Whether the packer is asked which rays of a view its model lacks, before they are cast.
enum class Steering {
  kAuto,  ///< where the packer eliminates redundancy
  kOn,
  kOff
};

/// As --progressive, --packing.redundancy and --steering take them.
const char* name_of(Progressive progressive);
const char* name_of(Redundancy redundancy);
const char* name_of(Steering steering);

/// Views are drawn at the servers and come as pictures (docs/coupling.md).
struct ImageOptions {
  std::string shading;                 ///< one of image::kShadingNames; empty: views come as the kind of scene has it
  std::string background = "#141820";  ///< as image::parse_background() takes it
  int quality = 80;                    ///< of JPEG, 1 to 100
  int samples = 1;                     ///< rays a pixel: 1, 4 or 16
  bool on() const { return !shading.empty(); }
};

struct MasterOptions {
  ScheduleOptions schedule;
  ImageOptions images;
  Limits limits;
  Progressive progressive = Progressive::kAuto;
  Redundancy redundancy = Redundancy::kAuto;
  Steering steering = Steering::kAuto;
  julia::Timeline animation;  ///< of the scene's parameters, from the first view on; empty: what the data server says
  std::string clip;           ///< what is cut away as it begins, as scene::parse_clip() takes it; empty: nothing
  uint64_t octree_depth = 0;  ///< 0: as the kind of scene has it
  /// packing.* and sampling.* values for the packer, volume.layers of a volume's frames; passed on in every welcome.
  /// packing.max_points that is not there is as the kind of scene has it.
  std::map<std::string, double> settings;
  double silent_after_s = 5.0;  ///< a process that reports nothing for so long is taken for dead
};

/// kind: of the session's scene; nullopt: none is known yet, or one that this program does not know. It is treated as a
/// mesh.
uint64_t octree_depth(const MasterOptions& options, std::optional<scene::Kind> kind);
bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind);
bool keeps_redundant(const MasterOptions& options, std::optional<scene::Kind> kind);
bool steers(const MasterOptions& options, std::optional<scene::Kind> kind);
/// As everyone is told them (docs/protocol.md): the given ones, packing.keep_redundant, packing.max_points,
/// packing.max_rate_mbit if one is wished, sampling.steering and viewer.least_sampling; picture.quality, .samples,
/// .shading (its place among image::kShadingNames) and .background (0xRRGGBB) where views come as pictures.
std::map<std::string, double> settings(const MasterOptions& options, std::optional<scene::Kind> kind);

}  // namespace telesplat::master
