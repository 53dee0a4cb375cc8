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

// What the person who starts the master can choose, and what a session makes of it: what was not given is decided by
// the kind of scene (scene::Policy), here and nowhere else. Everyone else is told the outcome.

/// Whether a view arrives coarse first.
enum class Progressive {
  kAuto,  ///< as the kind of scene has it
  kOn,
  kOff
};

/// As --progressive takes it.
const char* name_of(Progressive progressive);

struct MasterOptions {
  ScheduleOptions schedule;
  wire::SessionSettings settings;  ///< as far as they do not depend on the scene
  Limits limits;
  Progressive progressive = Progressive::kAuto;
  julia::Timeline animation;  ///< of the scene's parameters, from the first view on; empty: what the data server says
  std::string clip;           ///< what is cut away as it begins, as scene::parse_clip() takes it; empty: nothing
  // Fewer and larger clusters are chosen from sooner. A Julia set along a walk at 2560x1600 had 54 fps, 237 ms, 28.5 dB
  // and 0.9 % holes with 5 levels, 44 fps, 284 ms, 28.2 dB and 0.3 % with 6. The isosurface of a bonsai after a
  // minute's orbit was chosen from in 1.7 ms with 5 levels, 5.2 ms with 6, and splatted in 10.6 instead of 13.4 ms.
  uint64_t octree_depth = 5;
  double silent_after_s = 5.0;  ///< a process that reports nothing for so long is taken for dead
};

/// kind: of the session's scene; nullopt: none is known yet, or one that this program does not know. It is treated as a
/// mesh.
bool progressive(const MasterOptions& options, std::optional<scene::Kind> kind);
/// As everyone is told them: those of the options, with what depends on others and on the scene.
wire::SessionSettings settings(const MasterOptions& options, std::optional<scene::Kind> kind);

struct MasterServiceOptions {
  net::ServiceOptions service;  ///< bind: the control socket's address
  MasterOptions master;
  std::string out;                                      ///< run folder; empty: no record is written
  bool overwrite = false;                               ///< it may hold a record already, which is replaced
  bool goes_on = false;                                 ///< it may hold a record already, which goes on
  double table_limit_mb = 2000, trace_limit_mb = 1000;  ///< of a file of the record at most, 10^6 bytes; 0: no limit
  std::string started_by = "hand";                      ///< as net::RunningSession has it
  int metrics_port = 0;                                 ///< HTTP, for programs that watch; 0: none
  std::string metrics_address = "127.0.0.1";
  std::string label;    ///< of the record, in reports; empty: none
  std::string animate;  ///< as julia::parse_timeline takes it; empty: what the data server says
};

/// Flags that `telesplat run` has too: tiles, leases, packing. (There the data server is told of animations.) Rows
/// point into `options`.
options::Table session_table(MasterServiceOptions& options);
/// What one process may ask of the master: --max-sampling-pixels and others, which `telesplat run` has too.
options::Table limit_table(MasterServiceOptions& options);
/// --table-limit-mb and --trace-limit-mb, which `telesplat run` has too.
options::Table record_table(MasterServiceOptions& options);
/// --metrics-port, which `telesplat run` has too.
options::Row metrics_port_row(MasterServiceOptions& options);
/// All flags.
options::Table table(MasterServiceOptions& options);

}  // namespace telesplat::master
