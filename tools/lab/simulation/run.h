// Runs one scenario from its beginning to its end.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tools/lab/simulation/checks.h"

namespace telesplat::simulation {

/// others: watch too. folder: of the record, where the scenario has one; made and removed.
Outcome run_scenario(const Scenario& scenario, const std::vector<Observer*>& others = {});

/// The result of one child.
struct Ran {
  Outcome outcome;
  bool crashed = false;  ///< the process that simulated it ended by a signal or a CHECK
};

/// Runs scenarios in processes of their own, `at_once` at a time, and tells of each as it ends, in their order of
/// ending. done returns false to begin no more.
void run_children(const std::vector<Scenario>& scenarios, int at_once,
                  const std::function<bool(const Scenario&, const Ran&)>& done);

/// Takes events away as long as the same check fails. Returns the scenario with what is left.
Scenario shrink(const Scenario& scenario, const std::function<void(const Scenario&)>& on_smaller);

}  // namespace telesplat::simulation
