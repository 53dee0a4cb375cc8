// The flags of telesplat-master.
#pragma once

#include <optional>
#include <string>

#include "common/julia/timeline.h"
#include "common/net/service.h"
#include "common/options/table.h"
#include "common/scene/kind.h"
#include "common/wire/session_messages.h"
#include "services/master/gate/gate.h"
#include "services/master/views.h"

namespace telesplat::master {

// Choices of the person who starts the master, and the settings that follow from them: the kind of scene
// (scene::Policy) decides what was not chosen, here and nowhere else. All other processes get the outcome.

/// Selects if views arrive coarse first.
enum class Progressive {
  kAuto,  ///< as the kind of scene wants it
  kOn,
  kOff
};

/// Returns the word that --progressive takes.
const char* name_of(Progressive progressive);

struct MasterOptions {
  ScheduleOptions schedule;
  wire::SessionSettings settings;  ///< those that do not depend on the scene
  Limits limits;
  Progressive progressive = Progressive::kAuto;
  julia::Timeline animation;  ///< changes the scene's parameters from the first view on; empty: the data server's
  std::string clip;           ///< first clip order, as scene::parse_clip() takes it; empty: nothing is cut away
  // Choosing among fewer, larger clusters is faster. A Julia set along a walk at 2560x1600 had 54 fps, 237 ms, 28.5 dB
  // and 0.9 % holes with 5 levels, 44 fps, 284 ms, 28.2 dB and 0.3 % with 6. For the isosurface of a bonsai after a
  // minute's orbit, choosing took 1.7 ms with 5 levels, 5.2 ms with 6; splatting took 10.6 ms and 13.4 ms.
  uint64_t octree_depth = 5;
  double silent_after_s = 5.0;  ///< a process that sends nothing for this time is taken for dead
};

/// True if views arrive coarse first. kind: the scene's; nullopt: not known yet, or not known to this program; it is
/// treated as a mesh.
bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind);
/// Returns the settings that all processes get: those of the options, and those that depend on others or on the scene.
wire::SessionSettings settings(const MasterOptions& options, std::optional<scene::Kind> kind);

struct MasterServiceOptions {
  net::ServiceOptions service;  ///< bind: the control socket's address
  MasterOptions master;
  std::string out;                                      ///< run folder; empty: no record is written
  bool overwrite = false;                               ///< `out` may hold a record already, which is replaced
  bool goes_on = false;                                 ///< `out` may hold a record already, which goes on
  double table_limit_mb = 2000, trace_limit_mb = 1000;  ///< limits for one file of the record, 10^6 bytes; 0: no limit
  std::string started_by = "hand";                      ///< as net::RunningSession has it
  int metrics_port = 0;                                 ///< HTTP port for programs that watch; 0: none
  std::string metrics_address = "127.0.0.1";
  std::string label;    ///< name of the run in reports; empty: none
  std::string animate;  ///< as julia::parse_timeline takes it; empty: the data server's animation
};

/// Flags that `telesplat run` has too: tiles, leases, packing. (There animations are flags of the data server.) Rows
/// point into `options`.
options::Table session_table(MasterServiceOptions& options);
/// Limits of what one process may ask of the master: --max-sampling-pixels and others, which `telesplat run` has too.
options::Table limit_table(MasterServiceOptions& options);
/// --table-limit-mb and --trace-limit-mb, which `telesplat run` has too.
options::Table record_table(MasterServiceOptions& options);
/// --metrics-port, which `telesplat run` has too.
options::Row metrics_port_row(MasterServiceOptions& options);
/// All flags.
options::Table table(MasterServiceOptions& options);

}  // namespace telesplat::master
