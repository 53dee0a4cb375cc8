// A simulated session: its processes, links and scene, and the faults with their times. All of it is drawn from one
// seed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client/viewer/coupling/coupling.h"
#include "common/geometry/trajectory.h"
#include "common/wire/session_messages.h"
#include "tools/lab/simulation/network/network.h"

namespace telesplat::simulation {

enum class Role : uint8_t { kMaster, kData, kPacker, kSampler, kViewer };
inline constexpr std::string_view kRoleNames[] = {"master", "data", "packer", "sampler", "viewer"};

enum class Show : uint8_t { kSpheres, kTerrain, kBars, kJulia, kBall, kSeries, kMesh };
inline constexpr std::string_view kShowNames[] = {"spheres", "terrain", "fence", "julia", "ball", "series", "mesh"};
inline bool is_volume(Show show) { return show == Show::kBall || show == Show::kSeries; }

/// A fault, or an action of a person.
enum class Fault : uint8_t {
  kKill,           ///< SIGKILL; the launcher starts it again after `amount` s
  kTerminate,      ///< SIGTERM; likewise
  kStop,           ///< SIGSTOP, SIGCONT after `amount` s
  kBreak,          ///< resets connections between `a` and `b`
  kSilence,        ///< nothing passes between `a` and `b` for `amount` s
  kIsolate,        ///< nothing passes to or from `a` for `amount` s
  kClockStep,      ///< its clock jumps `amount` s forward, as after a virtual machine was moved
  kSlowLink,       ///< `amount` bytes a second to `a`, until the calm
  kSlowWork,       ///< a tile takes `a` this many times as long, until the calm
  kKillAtMessage,  ///< SIGKILL just before it sends its `amount`-th message from now on
  kDiskFull,       ///< files cannot grow for `amount` s
  kOrder,          ///< `telesplat ctl`: Event::order; amount 1: one that must be refused
  kShow,           ///< the data servers are killed, and after `amount` s others come with Event::show
  kLeave,          ///< viewer or sampler leaves for good
  kJoin,           ///< one more of role `a`
  kStranger,       ///< a peer without a part sends valid messages of any kind to `a`, `amount` of them
  kImpostor,  ///< a peer says hello as role `b` under a name that is in use, and falls silent; amount 1: as the very
              ///< process that was heard last; kData: with a damaged volume
  kIntruder,  ///< a process of role `a` begins whose key is of role `b`, or (kMaster) no key
};
inline constexpr std::string_view kFaultNames[] = {
    "kill",    "terminate", "stop",  "break", "silence", "isolate", "clock-step", "slow-link", "slow-work",
    "kill-at", "full",      "order", "show",  "leave",   "join",    "stranger",   "impostor",  "intruder"};

/// A part of a session: a role, and which one of it, from 0.
struct Part {
  Role role = Role::kMaster;
  int number = 0;
  auto operator<=>(const Part&) const = default;
};
std::string text_of(Part part);
inline constexpr int kFirstIntruder = 10;  ///< Part::number of those whose key is not of their role

struct Event {
  double at_s = 0;
  Fault fault = Fault::kKill;
  Part a, b;
  double amount = 0;
  std::string order = {};  ///< the command and its arguments: "set|c.y=0.3"
  Show show = Show::kSpheres;
};
wire::Control order_of(const Event& event);
/// "12.345 kill sampler-1 0.5".
std::string text_of(const Event& event);

/// Where a head is: it goes from place to place around the scene, and rests at the last one from `until_s` on.
geometry::Trajectory draw_head(uint64_t seed, double until_s);

struct Scenario {
  uint64_t seed = 0;
  double duration_s = 16;  ///< in its last calm_s nothing goes wrong, and heads stand still
  double calm_s = 6;
  Show show = Show::kSpheres;
  std::string file;                         ///< file of Show::kMesh
  std::vector<geometry::Trajectory> heads;  ///< movements of the first viewers; those of others are drawn
  int samplers = 2, viewers = 1;
  int data_servers = 1;         ///< each has a part of a volume, or all of another scene
  int width = 48, height = 36;  ///< display, pixels
  double display_hz = 20;
  viewer::CouplingState coupling;
  wire::SessionSettings settings;
  int tile_size = 32;
  double tile_s = 0.004;      ///< a tile of tile_size² pixels takes a sampler
  double log_limit_mb = 512;  ///< limit of the packer's log
  bool one_machine = true;    ///< with one clock; else each process has its own
  bool keys = false;
  bool records = false;  ///< in a folder
  LinkOptions links, to_viewers;
  std::vector<Event> events;  ///< in order of time
};

/// The scenario of a seed.
Scenario draw_scenario(uint64_t seed);
/// The same, of a session of `hours` with one viewer and two samplers.
Scenario draw_long(uint64_t seed, double hours);
/// One line a fact, for people.
std::string text_of(const Scenario& scenario);

}  // namespace telesplat::simulation
