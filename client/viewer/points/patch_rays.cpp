#include "client/viewer/points/patch_rays.h"

#include "common/codec/mask_stream.h"

namespace telesplat::viewer {

Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays) {
  if (patch.missed.empty()) {
    rays.revise(patch.camera, patch.rect, image);
    return ok_status();
  }
  const auto missed = codec::decode_mask(patch.missed, patch.missed_rect.width, patch.missed_rect.height);
  if (!missed) return missed.error();
  rays.add({patch.epoch, patch.camera, patch.missed_rect, &*missed, patch.rect, &image});
  return ok_status();
}

}  // namespace telesplat::viewer
