#include "services/packer/points/base/base_feed.h"

#include <algorithm>
#include <utility>

#include "common/core/log.h"
#include "common/scene/base.h"

namespace telesplat::packer {
namespace {

constexpr uint64_t kPartsAtOnce = 8;   // in answer to one request: about 200 kB
constexpr size_t kMostWaiting = 1024;  // parts that viewers wait for; they ask again
constexpr uint64_t kHeld = 2;          // triangles that are held, over those that a viewer asks for

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
  fetch_.begin({session.epoch, array});
}

void BaseFeed::drop() {
  fetch_.stop();
  waiting_.clear();
  if (!base_) return;
  base_.reset();
  ++number_;
  outlets_.publish(summary());
}

void BaseFeed::receive() {
  fetch_.receive({[this](std::vector<geometry::ChunkInfo> nodes) { begin(std::move(nodes)); },
                  [this](ChunkId chunk, const auto& held) { take(chunk, held); }});
}

void BaseFeed::begin(std::vector<geometry::ChunkInfo> nodes) {
  const uint64_t parts = wire::first_base_parts(nodes).back();
  if (parts == 0 || parts > wire::kMaxBaseParts)
    return log::warn("viewers have no base: it has {} parts, limits 1 and {}", parts, wire::kMaxBaseParts);
  base_.emplace(std::move(nodes), scene_.largest_m, colours_ ? &*colours_ : nullptr);
  ++number_;
  log::info("the base has {} nodes in {} parts", base_->nodes().size(), base_->parts());
  publish(true);
}

void BaseFeed::take(ChunkId chunk, const Result<geometry::HeldChunk>& held) {
  if (!base_) return;
  const auto node = static_cast<uint32_t>(chunk.value);
  if (!held || !base_->add(node, held->view)) {
    log::warn("viewers have no base: chunk {} {}", chunk.value, held ? "is not what the list says" : held.error().text);
    return drop();
  }
  std::erase_if(waiting_, [&](const Waiting& w) {
    if (base_->node_of(w.part) != node) return false;
    send_part(w.part, w.peer);
    return true;
  });
  base_->keep_within(kHeld * scene_.most);
}

void BaseFeed::tick(InstanceId packer, double now_s) {
  if (std::exchange(packer_, packer) != packer && base_) publish(true);
  fetch_.tick(now_s);
}

void BaseFeed::send_part(uint64_t part, const std::string& peer) {
  wire::BasePart out = base_->part(part);
  out.packer = packer_, out.base = number_;
  outlets_.send(out, peer);
}

void BaseFeed::answer(const wire::BaseRequest& request, const std::string& peer) {
  if (!base_ || packer_.value == 0) return;
  if (request.base != number_) outlets_.send(wire::BaseTree{packer_, number_, base_->nodes()}, peer);
  if (request.base != number_ || request.parts == 0) {
    outlets_.send(wire::BaseHidden{packer_, number_, published_, true, base_->hidden()}, peer);
    return;
  }
  for (uint64_t n = request.part; n < std::min(request.part + std::min(request.parts, kPartsAtOnce), base_->parts());
       ++n) {
    const uint32_t node = base_->node_of(n);
    if (base_->has(node)) {
      send_part(n, peer);
      continue;
    }
    fetch_.want(ChunkId{node});
    if (std::ranges::any_of(waiting_, [&](const Waiting& w) { return w.part == n && w.peer == peer; })) continue;
    if (waiting_.size() == kMostWaiting) waiting_.pop_front();
    waiting_.push_back({n, peer});
  }
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
  outlets_.publish(summary());
  if (base_) publish(false);
}

// whole: tells of all hidden triangles.
void BaseFeed::publish(bool whole) {
  if (packer_.value == 0) return;
  if (whole) outlets_.publish(summary());
  std::vector<uint32_t> words = base_->take_changes();
  if (whole) words = base_->hidden();
  if (words.empty() && !whole) return;
  outlets_.publish(wire::BaseHidden{packer_, number_, ++published_, whole, std::move(words)});
}

}  // namespace telesplat::packer
