// A Julia set that changes with time: parameters and a timeline together.
#pragma once

#include <functional>

#include "common/julia/parameters.h"
#include "common/julia/timeline.h"

namespace telesplat::julia {

/// `start` with the timeline's values at t_s. Error: as set() and validate().
Result<Parameters> parameters_at(const Parameters& start, const Timeline& timeline, double t_s);

/// The instants at which an animation is checked in advance: its key frames and `count` more, evenly spaced over its
/// longest track. Only 0 without an animation.
std::vector<double> instants(const Timeline& timeline, int count);

/// Checks that each name is a parameter that can be animated (animates, not whole), and that all parameters are valid
/// at instants(timeline, 256). Error: names parameter, value, limit and time.
Status validate(const Parameters& start, const Timeline& timeline);

/// Union of bounds() at instants(timeline, 24), computed in one thread a core. If it is empty at any of them, `box` is
/// empty and `empty_at_s` is that time. Precondition: validate(start, timeline). progress(done, of) is called from the
/// calling thread.
struct AnimatedBounds {
  geometry::DBox box;
  double empty_at_s = -1;
};
AnimatedBounds animated_bounds(const Parameters& start, const Timeline& timeline,
                               const std::function<void(size_t, size_t)>& progress = {});

}  // namespace telesplat::julia
