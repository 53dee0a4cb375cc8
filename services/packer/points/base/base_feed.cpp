#include "services/packer/points/base/base_feed.h"

#include <algorithm>
#include <utility>

#include "common/core/log.h"
#include "common/scene/base.h"

namespace telesplat::packer {
namespace {

constexpr uint64_t kPartsAtOnce = 8;  // in answer to one request: about 200 kB

}  // namespace

void BaseFeed::follow(const wire::Welcome& session, bool anew) {
  const scene::SessionView view(session);
  const std::string endpoint = view.endpoint("chunks");
  const glm::vec3 size = session.box_room.size();
  Scene scene{view.fact("content_hash"), view.fact(scene::kColouringFact), scene::base_triangles(session),
              std::max({size.x, size.y, size.z})};
  if (!wanted_ || scene.content_hash.empty() || !(scene.largest_m > 0)) scene.most = 0;
  // The base stays while its data server is away: then there is no endpoint.
  if (scene.most > 0 && !endpoint.empty()) fetch_.connect(endpoint);
  if (scene == scene_) {
    if (anew && base_) base_->show_all(), publish(true);
    return;
  }
  scene_ = std::move(scene);
  drop();
  colours_.reset();
  if (scene_.most == 0) return;
  std::string array;
  if (!scene_.colouring.empty()) {
    const auto colouring = scene::colouring_from_text(scene_.colouring);
    if (!colouring) return log::error("the base has no colours: {}", colouring.error().text);
    array = colouring->array;
    colours_ = scene::make_table(*colouring);
  }
  fetch_.begin({session.epoch, array, scene_.most, scene_.largest_m}, colours_ ? &*colours_ : nullptr);
}

void BaseFeed::drop() {
  fetch_.stop();
  if (!base_) return;
  base_.reset();
  ++number_;
  outlets_.publish(begin());
}

void BaseFeed::receive() {
  auto made = fetch_.receive();
  if (!made) return;
  base_.emplace(*std::move(made));
  ++number_;
  log::info("the base has {} triangles in {} parts, {} of them coarse ones", base_->triangles(), base_->parts(),
            base_->coarse_parts());
  publish(true);
}

void BaseFeed::tick(InstanceId packer, double now_s) {
  if (std::exchange(packer_, packer) != packer && base_) publish(true);
  fetch_.tick(now_s);
}

void BaseFeed::answer(const wire::BaseRequest& request, const std::string& peer) const {
  if (!base_ || packer_.value == 0) return;
  const bool begins = request.base != number_;  // it knows another base, or none yet
  if (begins) outlets_.send(begin(), peer);
  const uint64_t first = begins ? 0 : request.part, parts = std::min(request.parts, kPartsAtOnce);
  if (first == 0) outlets_.send(wire::BaseHidden{packer_, number_, published_, true, base_->hidden()}, peer);
  for (uint64_t n = first; n < std::min<uint64_t>(first + parts, base_->parts()); ++n) {
    wire::BasePart part = base_->part(n);
    part.packer = packer_, part.base = number_;
    outlets_.send(part, peer);
  }
}

wire::BaseBegin BaseFeed::begin() const {
  return {packer_, number_, base_ ? base_->coarse_parts() : 0, base_ ? base_->parts() : 0};
}

void BaseFeed::note(const SampledTile& tile, bool whole, const image::PixelMask* cast) {
  noted_.reset();
  if (!base_ || (!whole && !cast)) return;
  noted_ = {tile, whole ? std::nullopt : std::optional(*cast)};
}

void BaseFeed::take_noted() {
  if (!noted_ || !base_) return;
  base_->hide(noted_->tile, noted_->cast ? &*noted_->cast : nullptr);
  noted_.reset();
  publish(false);
}

void BaseFeed::forgotten(const Event& event, const points::PointModel& model) {
  if (!base_) return;
  for (const points::ClusterKey key : event.clusters)
    if (!model.find(key)) base_->show(points::leaf_box(model.config(), key));
}

void BaseFeed::publish() {
  if (number_ == 0 || packer_.value == 0) return;
  outlets_.publish(begin());
  if (base_) publish(false);
}

// whole: tells of all hidden triangles.
void BaseFeed::publish(bool whole) {
  if (packer_.value == 0) return;
  if (whole) outlets_.publish(begin());
  std::vector<uint32_t> words = base_->take_changes();
  if (whole) words = base_->hidden();
  if (words.empty() && !whole) return;
  outlets_.publish(wire::BaseHidden{packer_, number_, ++published_, whole, std::move(words)});
}

}  // namespace telesplat::packer
