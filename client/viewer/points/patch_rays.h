// What patches tell of rays that met nothing, or met something after all.
#pragma once

#include "client/viewer/render/fine_rays.h"
#include "common/points/point_model.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Rays finer than a viewer's views, of its own patches; and of all others what they found where those had met nothing.
/// image: the patch's, decoded. Error: the mask cannot be decoded; nothing was added.
Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays);

/// What points::prepare_patch() is told of the patch's frame.
inline FrameId tag_of(const wire::Patch& patch) { return points::tagged(patch.frame, patch.step, patch.rest); }

}  // namespace telesplat::viewer
