#include "client/viewer/cache/model_cache.h"

#include <iterator>

namespace telesplat::viewer {

void ModelCache::begin_replica(const points::ModelConfig& config) {
  auto fresh = std::make_unique<points::PointModel>(config);
  const std::lock_guard lock(mutex_);
  if (newest_) {
    if (!shown_)
      shown_ = std::move(newest_), applied_shown_ = applied_;
    else
      retired_models_.push_back(std::move(newest_));
  }
  newest_ = std::move(fresh);
  applied_ = {};
}

void ModelCache::insert(points::PreparedPatch patch) {
  const std::lock_guard lock(mutex_);
  applied_ = patch.sequence;
  newest_->insert(std::move(patch));
  ++patches_;
}

void ModelCache::forget(Sequence sequence, std::span<const points::ClusterKey> keys, std::span<const uint32_t> frames) {
  const std::lock_guard lock(mutex_);
  auto dropped = frames.empty() ? newest_->take_out(keys) : newest_->take_out(keys, frames);
  applied_ = sequence;
  std::move(dropped.begin(), dropped.end(), std::back_inserter(retired_clusters_));
}

void ModelCache::clear(Sequence sequence) {
  auto fresh = std::make_unique<points::PointModel>(newest_->config());
  const std::lock_guard lock(mutex_);
  retired_models_.push_back(std::exchange(newest_, std::move(fresh)));
  applied_ = sequence;
}

void ModelCache::show_newest() {
  const std::lock_guard lock(mutex_);
  if (shown_) retired_models_.push_back(std::move(shown_));
}

uint64_t ModelCache::digest() const {
  const std::lock_guard lock(mutex_);
  return newest_ ? newest_->digest() : 0;
}

void ModelCache::select(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out) {
  const std::lock_guard lock(mutex_);
  const points::PointModel* model = shown_ ? shown_.get() : newest_.get();
  if (model)
    splat::select_view(*model, camera, options, out);
  else
    out = {};
  out.applied = shown_ ? applied_shown_ : applied_;
}

void ModelCache::end_frame() {
  std::vector<std::unique_ptr<points::Cluster>> clusters;
  std::vector<std::unique_ptr<points::PointModel>> models;
  const std::lock_guard lock(mutex_);
  clusters.swap(retired_clusters_);
  models.swap(retired_models_);
}  // freed after the lock is released: destructors run in reverse order

ModelCache::Figures ModelCache::figures() const {
  const std::lock_guard lock(mutex_);
  return newest_ ? Figures{newest_->points(), newest_->bytes(), patches_} : Figures{};
}

}  // namespace telesplat::viewer
