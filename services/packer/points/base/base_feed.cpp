#include "services/packer/points/base/base_feed.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "common/core/log.h"
#include "common/net/dispatch.h"
#include "common/scene/base.h"

namespace telesplat::packer {
namespace {

// Time between two requests: the surfels are being made, or on their way.
constexpr double kLeastPatience_s = 0.25, kMostPatience_s = 16;
constexpr uint64_t kPartsAtOnce = 8;  // in answer to one request: about 400 kB

}  // namespace

void BaseFeed::follow(const wire::Welcome& session, const points::ModelConfig& model, bool anew) {
  const scene::SessionView view(session);
  const std::string endpoint = view.endpoint("chunks");
  Scene scene{view.fact("content_hash"), view.fact(scene::kColouringFact), scene::base_points(session), model};
  if (!context_ || scene.content_hash.empty()) scene.most = 0;
  // The base stays while its data server is away: then there is no endpoint.
  if (scene.most > 0 && !endpoint.empty() && endpoint != endpoint_) connect(endpoint);
  if (scene == scene_) {
    if (anew && base_) base_->show_all(), publish(true);
    return;
  }
  scene_ = std::move(scene);
  epoch_ = session.epoch;
  drop();
  array_.clear(), colours_.reset();
  if (scene_.most == 0) return;
  if (!scene_.colouring.empty()) {
    const auto colouring = scene::colouring_from_text(scene_.colouring);
    if (!colouring) return log::error("the base has no colours: {}", colouring.error().text);
    array_ = colouring->array;
    colours_ = scene::make_table(*colouring);
  }
  asks_ = true;
}

void BaseFeed::connect(const std::string& endpoint) {
  endpoint_ = endpoint;
  blocks_.emplace(*context_, net::Kind::kDealer, "packer:chunks",
                  net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                                     .patience_s = net::kBulkPatience_s,
                                     .watch_connecting = true,
                                     .toward = "data"});
  asked_s_ = -1e9;
  if (const Status s = blocks_->connect(endpoint_); !s) log::error("{}", s.error().text);
}

// Viewers drop a base when another number comes.
void BaseFeed::drop() {
  if (base_) outlets_.publish(wire::BaseHidden{packer_, ++number_, ++published_, true, {}});
  base_.reset();
  asks_ = false;
  asked_s_ = -1e9, patience_s_ = kLeastPatience_s;
}

std::vector<net::Socket*> BaseFeed::sockets() {
  return blocks_ ? std::vector<net::Socket*>{&*blocks_} : std::vector<net::Socket*>{};
}

void BaseFeed::receive() {
  if (!blocks_) return;
  while (const auto message = blocks_->receive())
    net::dispatch<wire::Surfels>(*blocks_, *message, [&](const wire::Surfels& m) {
      if (asks_ && m.epoch == epoch_ && m.array == array_) take_surfels(m);
    });
}

void BaseFeed::take_surfels(const wire::Surfels& m) {
  asks_ = false;
  if (m.data.empty()) return;
  // Fields may lie anywhere: surfels are read as aligned words.
  std::vector<uint32_t> words((m.data.size() + 3) / 4);
  std::memcpy(words.data(), m.data.data(), m.data.size());
  const auto set = geometry::SurfelView::validate(std::as_bytes(std::span(words)).first(m.data.size()));
  if (!set) return log::warn("the data server's surfels are refused: {}", set.error().text);
  if (set->scalars != colours_.has_value())
    return log::warn("the data server's surfels are refused: they hold {}", set->scalars ? "scalars" : "colours");
  base_.emplace(*set, scene_.model, colours_ ? &*colours_ : nullptr);
  ++number_;
  log::info("the base has {} surfels of {:.1f} mm in {} parts", base_->surfels(), set->spacing_m * 1e3f,
            base_->parts());
  publish(true);
}

void BaseFeed::tick(InstanceId packer, double now_s) {
  if (std::exchange(packer_, packer) != packer && base_) publish(true);
  if (!asks_ || !blocks_ || now_s - asked_s_ < patience_s_) return;
  if (asked_s_ > 0) patience_s_ = std::min(2 * patience_s_, kMostPatience_s);
  asked_s_ = now_s;
  blocks_->send(wire::SurfelRequest{epoch_, array_, scene_.most});
}

void BaseFeed::answer(const wire::BaseRequest& request, const std::string& peer) const {
  if (!base_ || packer_.value == 0) return;
  const bool begins = request.base != number_;  // it knows another base, or none yet
  const uint64_t first = begins ? 0 : request.part;
  if (first == 0) outlets_.send(wire::BaseHidden{packer_, number_, published_, true, base_->hidden()}, peer);
  const uint64_t parts = std::min(request.parts, kPartsAtOnce);
  for (uint64_t n = first; n < std::min<uint64_t>(first + parts, base_->parts()); ++n) {
    wire::BasePart part = base_->part(n);
    part.packer = packer_, part.base = number_;
    outlets_.send(part, peer);
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
  publish();
}

void BaseFeed::forgotten(const Event& event, const points::PointModel& model) {
  if (!base_) return;
  for (const points::ClusterKey key : event.clusters)
    if (!model.find(key)) base_->show(points::leaf_box(model.config(), key));
}

void BaseFeed::publish() {
  if (base_ && packer_.value != 0) publish(false);
}

void BaseFeed::publish(bool whole) {
  std::vector<uint32_t> words = base_->take_changes();
  if (whole) words = base_->hidden();
  if (words.empty() && !whole) return;
  outlets_.publish(wire::BaseHidden{packer_, number_, ++published_, whole, std::move(words)});
}

}  // namespace telesplat::packer
