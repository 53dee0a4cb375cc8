#include "services/packer/points/event.h"

#include <fmt/format.h>

namespace telesplat::packer {

std::string name_of(const FramePart& part, std::string_view noun) {
  return fmt::format("{} {} of frame {}", noun, part.tile, part.frame.value);
}

std::string describe(const geometry::Rect& r) {
  return fmt::format("{}x{} pixels at ({}, {})", r.width, r.height, r.x, r.y);
}

Status check(const FramePart& part, std::string_view noun) {
  if (const Status camera = geometry::validate(part.camera); !camera)
    return Error{fmt::format("{}: {}", name_of(part, noun), camera.error().text)};
  if (part.tiles_in_frame > kMaxTilesInFrame || part.tile >= part.tiles_in_frame)
    return Error{fmt::format("frame {} has no {} {} of {} (at most {})", part.frame.value, noun, part.tile,
                             part.tiles_in_frame, kMaxTilesInFrame)};
  if (!geometry::contains({0, 0, part.camera.width, part.camera.height}, part.rect))
    return Error{fmt::format("{}: {} do not lie in the frame's {}x{}", name_of(part, noun), describe(part.rect),
                             part.camera.width, part.camera.height)};
  return ok_status();
}

}  // namespace telesplat::packer
