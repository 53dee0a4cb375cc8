// Where the head and its eyes are.
#pragma once

#include "tests/support/xr/runtime.h"

namespace telesplat::xr_test {

/// The head's middle in the stage, at t_s of the monotonic clock.
geometry::Pose head_at(const Runtime& runtime, double t_s);
/// An eye (left 0, right 1) of a head at that pose.
XrView eye_at(const Runtime& runtime, int eye, const geometry::Pose& head);
/// Whether the headset knows where it is now.
bool tracked(const Runtime& runtime);

}  // namespace telesplat::xr_test
