// What patches tell of rays that met nothing, or met something after all.
#pragma once

#include "client/viewer/render/fine_rays.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Of a viewer's own patches: rays finer than its views, and what its views found where those had met nothing. image:
/// the patch's, decoded. Error: the mask cannot be decoded; nothing was added.
Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays);

}  // namespace telesplat::viewer
