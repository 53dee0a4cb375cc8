// What eyes see of a panel through its line screen: simulated, for calibration, documents and tests.
#pragma once

#include "client/stereo/autostereo/panel.h"
#include "common/image/file.h"

namespace telesplat::stereo {

/// How much of a subpixel an eye sees, 0 to 1: the share of its width from which light reaches the eye through a slit
/// (or by way of a lens).
double visible_share(const Panel& panel, const glm::dvec3& eye, int x, int y, int subpixel);

/// What an eye at this place sees of the picture on the panel. Eyes do not resolve lines: a pixel's channel is the mean
/// of that channel around it, over a pitch to each side of its row, weighted by what is visible of it; as bright as if
/// all of it were. Preconditions: the panel and the eye validate; the picture has the panel's size.
image::View seen_by(const Panel& panel, const glm::dvec3& eye, const image::View& picture);

struct SeenShares {
  double crosstalk = 0;  ///< of the light that an eye sees: how much is of subpixels that belong to the other one
  double dark = 0;       ///< of the subpixels: how many belong to nobody
};
/// For a picture that was made for `made_for`, seen from there: rows about the middle of the panel.
SeenShares seen_shares(const Panel& panel, const Eyes& made_for);

}  // namespace telesplat::stereo
