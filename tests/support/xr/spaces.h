// Poses of the head and its eyes.
#pragma once

#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test {

/// Returns the head's middle in the stage, at t_s of the monotonic clock.
geometry::Pose head_at(const Runtime& runtime, double t_s);
/// Returns an eye (left 0, right 1) of a head at that pose.
XrView eye_at(const Runtime& runtime, int eye, const geometry::Pose& head);
/// True if the headset knows its place now.
bool tracked(const Runtime& runtime);

}  // namespace telesplat::xr_test
