// The time that a scenario's faults may hold up a session.
#pragma once

#include <initializer_list>
#include <vector>

#include "tools/lab/simulation/scenario.h"

namespace telesplat::simulation {

inline constexpr double kRecovers_s = 6;  ///< the effects of a fault may last this long after it

class Excuses {
 public:
  /// The scenario must outlive it.
  explicit Excuses(const Scenario& scenario);

  /// True if a fault may hold up all viewers within this time, s.
  bool disturbed(double from_s, double until_s) const;
  /// True if a sampler fails within this time, s, while another one works, which takes over.
  bool delayed(double from_s, double until_s) const;
  /// True while the data servers change to another scene.
  bool changes_show(double now_s) const;
  /// True if the scenario has one of these faults.
  bool has(std::initializer_list<Fault> faults) const;

 private:
  const Scenario& scenario_;
  std::vector<Event> excuses_, delays_;
};

}  // namespace telesplat::simulation
