#include "client/viewer/points/model_cache.h"

#include <algorithm>
#include <iterator>

#include "common/core/check.h"
#include "common/splat/backdrop.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMaxSeen =
    1u << 21;  // 16 MiB; if the display draws more until the next report, only the first frames are reported

// More changes than this between two frames count as a change everywhere: 1.5 MB.
constexpr size_t kMostChanges = 1u << 16;

template <class T>
void move_to_end(std::vector<T>& from, std::vector<T>& to) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  from.clear();
}

}  // namespace

void AccessLog::add(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames) {
  CHECK(frames.empty() || frames.size() == clusters.size());
  if (clusters.empty()) return;
  if (with_frames_ == frames.empty()) {
    with_frames_ = !frames.empty();
    seen_.clear();
  }
  if (seen_.size() + clusters.size() > kMaxSeen) return;
  for (size_t i = 0; i < clusters.size(); ++i)
    seen_.push_back(uint64_t{clusters[i]} << 32 | (frames.empty() ? 0 : frames[i]));
}

std::vector<AccessLog::Report> AccessLog::reports() {
  std::sort(seen_.begin(), seen_.end());
  seen_.erase(std::unique(seen_.begin(), seen_.end()), seen_.end());
  std::vector<Report> out;
  for (size_t i = 0; i < seen_.size(); ++i) {
    if (i % kMaxInReport == 0) out.emplace_back();
    out.back().clusters.push_back(static_cast<uint32_t>(seen_[i] >> 32));
    if (with_frames_) out.back().frames.push_back(static_cast<uint32_t>(seen_[i]));
  }
  seen_.clear();  // its memory stays
  return out;
}

void ModelCache::drop(Replica& replica) {
  Dropped& dropped = dropped_of(replica.model.get());
  for (auto& [key, summary] : replica.summaries) dropped.summaries.push_back(std::move(summary));
  replica.summaries.clear();
  dropped.models.push_back(std::move(replica.model));
}

void ModelCache::note_change(const geometry::Box& box) {
  changes_.any = true;
  if (changes_.everywhere) return;
  if (changes_.boxes.size() < kMostChanges) return changes_.boxes.push_back(box);
  note_replica();
}

void ModelCache::note_change(points::ClusterKey key) {
  if (!changes_.everywhere) note_change(points::leaf_box(newest_.model->config(), key));
}

void ModelCache::note_replica() {
  changes_.any = changes_.everywhere = true;
  changes_.boxes.clear();
}

bool ModelCache::begin_replica(const points::ModelConfig& config, EpochId epoch, Sequence applied) {
  auto fresh = std::make_unique<points::PointModel>(config);
  const std::lock_guard lock(mutex_);
  if (newest_.model) {
    if (!older_.model && newest_.model->points() > 0)
      older_ = std::move(newest_);
    else
      drop(newest_);
  }
  newest_ = {std::move(fresh), epoch, applied, ++replicas_, {}, 0};
  wanted_.clear();
  if (!older_.model) note_replica();
  return older_.model != nullptr;
}

void ModelCache::insert(points::PreparedPatch patch, EpochId epoch) {
  points::Insertion insertion = newest_.model->plan(std::move(patch));
  const std::lock_guard lock(mutex_);
  CHECK(newest_.epoch == epoch || newest_.epoch.value == 0);
  newest_.epoch = epoch;
  commit(std::move(insertion));
  ++patches_;
}

void ModelCache::commit(points::Insertion insertion) {
  newest_.applied = insertion.sequence;
  changes_.any = true;
  for (const auto& change : insertion.changes) note_change(change.key);
  auto replaced = newest_.model->commit(std::move(insertion));
  move_to_end(replaced, dropped_of(newest_.model.get()).mosaics);
}

void ModelCache::refine(const points::PreparedRefinement& refinement) {
  points::Insertion insertion = points::plan_refinement(*newest_.model, refinement);
  const std::lock_guard lock(mutex_);
  commit(std::move(insertion));
}

void ModelCache::forget(Sequence sequence, std::span<const points::ClusterKey> keys, std::span<const uint32_t> frames) {
  const std::lock_guard lock(mutex_);
  auto dropped = frames.empty() ? newest_.model->take_out(keys) : newest_.model->take_out(keys, frames);
  newest_.applied = sequence;
  changes_.any = true;
  for (const points::ClusterKey key : keys) note_change(key);
  Dropped& place = dropped_of(newest_.model.get());
  move_to_end(dropped, place.clusters);
  for (const points::ClusterKey key : keys) {
    const points::ClusterKey brick = points::brick_key(key);
    const auto summary = newest_.summaries.find(brick);
    if (summary == newest_.summaries.end() || newest_.model->bricks().contains(brick)) continue;
    newest_.summary_bytes -= summary->second->bytes();
    place.summaries.push_back(std::move(summary->second));
    newest_.summaries.erase(summary);
  }
}

void ModelCache::show_newest() {
  const std::lock_guard lock(mutex_);
  if (!older_.model) return;
  drop(older_);
  note_replica();
}

void ModelCache::free_dropped() {
  Dropped free;  // freed after the lock is released
  const std::lock_guard lock(mutex_);
  std::swap(free, free_);
}

std::vector<points::ClusterKey> ModelCache::summarise(size_t most) {
  std::vector<points::ClusterKey> wanted, made;
  {
    const std::lock_guard lock(mutex_);
    std::swap(wanted, wanted_);
  }
  if (wanted.size() > most) wanted.resize(most);  // the display asks for the others again
  for (const points::ClusterKey key : wanted) {
    const auto brick = newest_.model->bricks().find(key);
    if (brick == newest_.model->bricks().end()) continue;
    // The display may have asked again while this summary was made.
    const auto held = newest_.summaries.find(key);
    if (held != newest_.summaries.end() && held->second->changes == brick->second->changes &&
        held->second->removals == brick->second->removals)
      continue;
    auto summary = points::summarise(*newest_.model, key, *brick->second, newest_.applied);
    const std::lock_guard lock(mutex_);
    auto& place = newest_.summaries[key];
    if (place) {
      newest_.summary_bytes -= place->bytes();
      dropped_of(newest_.model.get()).summaries.push_back(std::move(place));
    }
    place = std::move(summary);
    newest_.summary_bytes += place->bytes();
    note_change(brick->second->box_room);
    ++summaries_made_;
    made.push_back(key);
  }
  return made;
}

bool ModelCache::set_base(std::shared_ptr<const splat::BaseMesh> base) {
  const std::lock_guard lock(mutex_);
  if (!base && !base_.mesh) return false;
  base_.mesh = std::move(base);
  ++summaries_made_;
  note_replica();
  return true;
}

uint64_t ModelCache::digest() const { return newest_.model ? newest_.model->digest() : 0; }

void ModelCache::select_displayed(const geometry::Camera& camera, const splat::SelectionOptions& options,
                                  splat::DrawList& out) {
  const Replica& replica = displayed();
  if (replica.model)
    splat::select_view(*replica.model, camera, options, out, &replica.summaries);
  else
    out = {};
  out.applied = replica.applied;
  out.epoch = replica.epoch;
  out.replica = replica.number;
  out.summaries = summaries_made_;
  drawn_ = replica.model.get();
  out.base = base_.mesh;
}

void ModelCache::select(const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& out) {
  const std::lock_guard lock(mutex_);
  select_displayed(camera, options, out);
  base_.from = {camera.pose.position_room, splat::fine_enough(camera)};
  if (&displayed() == &newest_) wanted_ = out.summaries_wanted;
}

void ModelCache::select_part(const geometry::Camera& camera, const splat::SelectionOptions& options,
                             splat::DrawList& out) {
  const std::lock_guard lock(mutex_);
  select_displayed(camera, options, out);
}

void ModelCache::take_changes(Changes& out) {
  out.boxes.clear();
  const std::lock_guard lock(mutex_);
  std::swap(out, changes_);
  changes_.any = changes_.everywhere = false;
}

void ModelCache::end_frame() {
  const std::lock_guard lock(mutex_);
  drawn_ = nullptr;
  move_to_end(parked_.clusters, free_.clusters);
  move_to_end(parked_.mosaics, free_.mosaics);
  move_to_end(parked_.summaries, free_.summaries);
  move_to_end(parked_.models, free_.models);
}

ModelCache::Figures ModelCache::figures() const {
  const std::lock_guard lock(mutex_);
  if (!newest_.model) return {};
  return {newest_.model->points(), newest_.model->bytes() + newest_.summary_bytes, displayed().model->points(),
          patches_};
}

}  // namespace telesplat::viewer
