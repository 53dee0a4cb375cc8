// A Julia set that changes with time: parameters and a timeline together.
#pragma once

#include <functional>

#include "common/julia/parameters.h"
#include "common/julia/timeline.h"

namespace telesplat::julia {

/// `start` with the timeline's values at t_s. Error: as set() and validate().
Result<Parameters> parameters_at(const Parameters& start, const Timeline& timeline, double t_s);

/// The instants at which an animation is looked at beforehand: its key frames and `count` more, evenly spaced over its
/// longest track. 0 alone where nothing is animated.
std::vector<double> instants(const Timeline& timeline, int count);

/// Each name a parameter that can be animated (animates, not whole), and at instants(timeline, 256) all parameters
/// valid. Error: names parameter, value, limit and time.
Status validate(const Parameters& start, const Timeline& timeline);

/// Union of bounds() at instants(timeline, 24), each in a thread of its own as far as there are cores; empty if it is
/// empty at any of them, `empty_at_s` then says when. Precondition: validate(start, timeline). progress(done, of) is
/// called from the calling thread.
struct AnimatedBounds {
  geometry::DBox box;
  double empty_at_s = -1;
};
AnimatedBounds animated_bounds(const Parameters& start, const Timeline& timeline,
                               const std::function<void(size_t, size_t)>& progress = {});

}  // namespace telesplat::julia
