#include "client/viewer/pictures/picture_gatherer.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/image/jpeg.h"

namespace telesplat::viewer {

PictureGatherer::Open& PictureGatherer::open(const wire::Picture& tile) {
  const auto known = std::ranges::find_if(open_, [&](const Open& o) { return o.picture->frame == tile.frame; });
  if (known != open_.end()) return *known;
  if (open_.size() >= kMostOpen) open_.pop_front();
  auto picture = std::make_shared<ShownPicture>(ShownPicture{
      .epoch = tile.epoch, .frame = tile.frame, .request = tile.request, .camera = tile.camera, .view = {}});
  picture->view.width = tile.camera.width, picture->view.height = tile.camera.height;
  picture->view.colour.resize(size_t(tile.camera.width) * size_t(tile.camera.height));
  return open_.emplace_back(Open{std::move(picture), tile.tiles_in_frame, {}});
}

Result<std::shared_ptr<const ShownPicture>> PictureGatherer::add(const wire::Picture& tile) {
  if (const int64_t pixels = int64_t{tile.camera.width} * tile.camera.height; pixels > kMaxPixels)
    return Error{fmt::format("a picture of {} pixels, limit {}", pixels, kMaxPixels)};
  if (tile.request <= newest_) return std::shared_ptr<const ShownPicture>();
  Open& o = open(tile);
  if (o.picture->request != tile.request || o.picture->camera != tile.camera || o.tiles != tile.tiles_in_frame)
    return Error{fmt::format("a tile of another view than the others of frame {}", tile.frame.value)};
  image::View& view = o.picture->view;
  uint32_t* to = view.colour.data() + size_t(tile.rect.y) * size_t(view.width) + size_t(tile.rect.x);
  if (const Status s = image::decode_jpeg(tile.image, tile.rect.width, tile.rect.height, to, view.width); !s)
    return s.error();
  o.here.insert(tile.tile);
  if (o.here.size() < o.tiles) return std::shared_ptr<const ShownPicture>();
  std::shared_ptr<const ShownPicture> out = std::move(o.picture);
  newest_ = out->request;
  std::erase_if(open_, [&](const Open& other) { return !other.picture || other.picture->request <= newest_; });
  return out;
}

}  // namespace telesplat::viewer
