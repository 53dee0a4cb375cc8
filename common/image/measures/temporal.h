// Measures in time: changes from one displayed frame to the next that the data do not cause (docs/quality.md).
#pragma once

#include <cstddef>

#include "common/geometry/camera.h"
#include "common/image/measures/reference.h"

namespace telesplat::image {

/// A displayed frame beside its reference, of equal size and both with depth. The referenced objects outlive it.
struct VerifiedFrame {
  const geometry::Camera& camera;
  const Reference& reference;
  const View& displayed;
};

/// In steps of 255, means over red, green and blue of |change of the display - change of the reference|.
struct Unsteadiness {
  double flicker = 0;  ///< mean over pixels that count (quality.h) in either frame
  /// The 99.9th percentile (nearest rank) over blocks of 8 x 8 pixels in which any counts; a block has the mean over
  /// its pixels.
  double popping = 0;
  size_t pixels = 0;  ///< pixels that count; if 0, all figures are undefined
};

/// Compares two frames that were displayed one after the other. Precondition: equal sizes.
Unsteadiness unsteadiness(const VerifiedFrame& before, const VerifiedFrame& after);

/// Fate of the holes of a frame in the next one.
struct HoleFates {
  size_t followed = 0;  ///< holes of the first frame whose place is in sight in the second
  size_t closed = 0;    ///< those that are closed there
};

/// A hole's place is the point of the reference's surface there. It is in sight if it lies in the second frame's
/// picture and the reference's depth there is the same to 1 %; it is closed if neither its pixel nor one of the eight
/// around it is a hole. Precondition: surfaces, whose depth is metres.
HoleFates follow_holes(const VerifiedFrame& before, const VerifiedFrame& after);

}  // namespace telesplat::image
