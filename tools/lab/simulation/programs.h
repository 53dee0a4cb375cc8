// The services of a session as a simulation runs them: what each process consists of, with its options.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/net/turns.h"
#include "tools/lab/simulation/scenario.h"
#include "tools/lab/simulation/scenes/surface.h"
#include "tools/lab/simulation/viewer.h"

namespace telesplat::simulation {

/// The program of a process with one role.
class Program {
 public:
  virtual ~Program() = default;
  virtual net::Turns& turns() = 0;
  virtual int exit_code() const { return 0; }
  /// After its last turn.
  virtual Status finish() { return ok_status(); }
  virtual SimulatedViewer* viewer() { return nullptr; }
};

struct Surroundings {
  const Scenario& scenario;
  Show show = Show::kSpheres;                 ///< data servers show this
  int number = 0;                             ///< likewise: which of them it is
  std::string name;                           ///< the process' name
  std::string folder;                         ///< the record's folder; empty: no record
  bool first = true;                          ///< its first life
  std::function<void(double seconds)> spend;  ///< the process works for so long
  std::function<double()> slowness;           ///< times by which its work takes longer now
};

/// Returns the surface that is sampled for this show; nothing: it is no surface.
std::optional<Surface> surface_of(Show show);

inline constexpr const char* kMasterEndpoint = "tcp://127.0.0.1:7700";

/// Begins a process. The context must outlive it. Error: it cannot begin.
Result<std::unique_ptr<Program>> make_program(Role role, net::Context& context, const Surroundings& surroundings);

}  // namespace telesplat::simulation
