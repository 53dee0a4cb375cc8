#include "services/packer/points/event_log.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <tuple>

#include "common/codec/depth_codec.h"

namespace telesplat::packer {
namespace {

// Memory of a map node's links and of the allocator's headers for node and blob.
constexpr uint64_t kNodeBytes = 96;
constexpr uint64_t kForgetBytes = 40;  // a hash node and its bucket

bool by_sequence(const Event& a, const Event& b) { return a.sequence < b.sequence; }

// Returns the event without its points and missed rays.
Event bare(const Event& event) {
  static const auto kNothing = std::make_shared<const std::vector<uint8_t>>(codec::encode(image::DepthImage(1, 1)));
  Event out = event;
  out.blob = kNothing;
  out.samples = out.kept = 0;
  out.rect = {event.rect.x, event.rect.y, 1, 1};
  out.missed = {};
  return out;
}

}  // namespace

uint64_t EventLog::Patch::bytes() const {
  return sizeof(Patch) + kNodeBytes + alive * sizeof(Sequence) + event.blob->capacity() +
         (refinement ? refinement->capacity() : 0) + event.missed.capacity() * sizeof event.missed[0] +
         forgotten.capacity() * sizeof forgotten[0] + patch_forgotten.capacity() * sizeof patch_forgotten[0];
}

uint64_t EventLog::bytes() const {
  return patch_bytes_ + (patches_of_.size() + last_forget_.size()) * kForgetBytes +
         patches_forgotten_ * (sizeof(points::ClusterKey) + sizeof(uint32_t));
}

void EventLog::add_patch(const Event& event, std::span<const points::ClusterKey> clusters) {
  if (clusters.empty()) return;
  const Patch& patch = patches_.emplace_hint(patches_.end(), event.sequence, Patch{event, clusters.size()})->second;
  patch_bytes_ += patch.bytes();
  for (const points::ClusterKey key : clusters) patches_of_[key].push_back(event.sequence);
}

void EventLog::drop_part(Sequence sequence_of_patch, points::ClusterKey key, Sequence sequence, bool patch_alone) {
  const auto found = patches_.find(sequence_of_patch);
  CHECK(found != patches_.end());  // a patch stays in the log as long as it has points in the model
  Patch& patch = found->second;
  patch_bytes_ -= patch.bytes();
  if (--patch.alive == 0) {
    patches_.erase(found);
    return;
  }
  if (patch_alone)
    patch.patch_forgotten.emplace_back(sequence, key);
  else
    patch.forgotten.push_back(key);
  patch_bytes_ += patch.bytes();
}

void EventLog::add_forget(Sequence sequence, std::span<const points::ClusterKey> clusters) {
  for (const points::ClusterKey key : clusters) {
    last_forget_[key] = sequence;
    const auto found = patches_of_.find(key);
    CHECK(found != patches_of_.end());
    for (const Sequence patch : found->second) drop_part(patch, key, sequence, false);
    patches_of_.erase(found);
  }
}

void EventLog::add_patch_forget(const Event& event, std::span<const points::Cluster> dropped) {
  for (const points::Cluster& cluster : dropped) {
    const auto found = patches_of_.find(cluster.key);
    CHECK(found != patches_of_.end());
    const uint32_t tag = cluster.mosaics.front().frame_tag();
    std::erase_if(found->second, [&](Sequence patch) {
      if (patches_.at(patch).event.tag().value != tag) return false;
      drop_part(patch, cluster.key, event.sequence, true);
      return true;
    });
    if (found->second.empty()) patches_of_.erase(found);
  }
  patch_forgets_.push_back(event);
  patches_forgotten_ += event.clusters.size();
  while (patches_forgotten_ > max_patches_) {
    patches_forgotten_ -= patch_forgets_.front().clusters.size();
    horizon_ = patch_forgets_.front().sequence;
    patch_forgets_.pop_front();
  }
}

bool EventLog::is_whole(Sequence patch) const {
  const auto found = patches_.find(patch);
  return found != patches_.end() && found->second.forgotten.empty() && found->second.patch_forgotten.empty();
}

void EventLog::add_refinement(const Event& event) {
  CHECK(is_whole(event.refines));
  Patch& patch = patches_.at(event.refines);
  patch_bytes_ -= patch.bytes();
  patch.refined = event.sequence;
  patch.refinement = event.blob;
  patch_bytes_ += patch.bytes();
}

bool EventLog::remembers(Sequence after) const {
  return after.value == 0 || after >= horizon_ || (epoch_ && after < epoch_->sequence);
}

void EventLog::add_epoch(const Event& event) {
  patches_.clear();
  patches_of_.clear();
  last_forget_.clear();
  patch_forgets_.clear();
  patch_bytes_ = patches_forgotten_ = 0;
  horizon_ = {};
  epoch_ = event;
}

std::vector<Event> EventLog::since(Sequence after) const {
  std::vector<Event> out;
  Replay all = replay(after, {std::numeric_limits<uint64_t>::max()});
  while (auto event = next(all)) out.push_back(*std::move(event));
  return out;
}

EventLog::Replay EventLog::replay(Sequence after, Sequence until) const {
  Replay out{.after = after, .until = until, .others = {}, .epoch = {}};
  bool from_nothing = after.value == 0;
  if (epoch_ && after < epoch_->sequence) {
    out.others.push_back(*epoch_);
    out.after = epoch_->sequence;
    from_nothing = true;
  }
  const auto first = static_cast<ptrdiff_t>(out.others.size());
  for (const bool patches_alone : {false, true}) {
    std::vector<Event> more = patches_alone ? patch_forgets(out.after, from_nothing) : forgets(out.after, from_nothing);
    std::move(more.begin(), more.end(), std::back_inserter(out.others));
  }
  std::vector<Event> refined = refinements(out.after);
  std::move(refined.begin(), refined.end(), std::back_inserter(out.others));
  std::sort(out.others.begin() + first, out.others.end(), by_sequence);
  return out;
}

// Each sequence names one event. A point-free copy of a patch in `others` is skipped if the patch is in the log.
std::optional<Event> EventLog::next(Replay& replay) const {
  auto patch = patches_.upper_bound(replay.after);
  if (patch != patches_.end() && patch->first > replay.until) patch = patches_.end();
  auto& others = replay.others;
  Event out;
  if (!others.empty() && (patch == patches_.end() || others.front().sequence < patch->first)) {
    out = std::move(others.front());
    others.pop_front();
  } else if (patch != patches_.end()) {
    if (!others.empty() && others.front().sequence == patch->first) others.pop_front();
    out = patch->second.event;
  } else {
    return std::nullopt;
  }
  replay.after = std::max(replay.after, out.sequence);
  return out;
}

// from_nothing: the replica is empty apart from the kept patches that it will get.
std::vector<Event> EventLog::forgets(Sequence after, bool from_nothing) const {
  std::vector<std::pair<Sequence, points::ClusterKey>> keys;
  if (from_nothing) {
    for (const auto& [sequence, patch] : patches_)
      for (const points::ClusterKey key : patch.forgotten) keys.emplace_back(last_forget_.at(key), key);
  } else {
    for (const auto& [key, sequence] : last_forget_)
      if (sequence > after) keys.emplace_back(sequence, key);
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());

  std::vector<Event> out;
  for (const auto& [sequence, key] : keys) {
    if (out.empty() || out.back().sequence != sequence) {
      Event& event = out.emplace_back();
      event.sequence = sequence;
      event.kind = Event::Kind::kForget;
    }
    out.back().clusters.push_back(key);
  }
  return out;
}

std::vector<Event> EventLog::patch_forgets(Sequence after, bool from_nothing) const {
  std::vector<Event> out;
  if (!from_nothing) {
    for (const Event& event : patch_forgets_)
      if (event.sequence > after) out.push_back(event);
    return out;
  }
  std::vector<std::tuple<Sequence, points::ClusterKey, uint32_t>> keys;
  for (const auto& [sequence, patch] : patches_)
    for (const auto& [forgotten, key] : patch.patch_forgotten)
      keys.emplace_back(forgotten, key, static_cast<uint32_t>(patch.event.tag().value));
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  for (const auto& [sequence, key, frame] : keys) {
    if (out.empty() || out.back().sequence != sequence) {
      Event& event = out.emplace_back();
      event.sequence = sequence;
      event.kind = Event::Kind::kForget;
    }
    out.back().clusters.push_back(key);
    out.back().frames.push_back(frame);
  }
  return out;
}

std::vector<Event> EventLog::refinements(Sequence after) const {
  std::vector<Event> out;
  for (const auto& [sequence, patch] : patches_) {
    if (patch.refined <= after) continue;
    Event& event = out.emplace_back();
    event.sequence = patch.refined;
    event.kind = Event::Kind::kRefine;
    event.refines = sequence;
    event.blob = patch.refinement;
  }
  return out;
}

void Completions::add(const Event& event) {
  if (event.kind == Event::Kind::kEpoch) return clear();
  if (event.kind != Event::Kind::kPatch || !event.frame_complete || event.step > 1 || event.extra) return;
  auto& views = of_[event.viewer];
  views.push_back(bare(event));
  if (views.size() > kMostViews) views.pop_front();
  if (of_.size() <= kMostViewers) return;
  of_.erase(std::min_element(of_.begin(), of_.end(), [](const auto& a, const auto& b) {
    return a.second.back().sequence < b.second.back().sequence;
  }));
}

void Completions::fill(std::deque<Event>& events, InstanceId viewer, Sequence after) const {
  const auto found = of_.find(viewer);
  if (found == of_.end()) return;
  for (const Event& view : found->second) {
    if (view.sequence <= after) continue;
    const auto place = std::lower_bound(events.begin(), events.end(), view, by_sequence);
    if (place == events.end() || place->sequence != view.sequence) events.insert(place, view);
  }
}

std::unordered_set<Sequence> oldest_patches(const std::unordered_map<Sequence, double>& used_s, const EventLog& log,
                                            uint64_t max_bytes) {
  std::unordered_set<Sequence> chosen;
  uint64_t bytes = log.patch_bytes();
  if (bytes <= max_bytes) return chosen;
  std::vector<std::pair<double, Sequence>> oldest_first;
  for (const auto& [sequence, at_s] : used_s) oldest_first.emplace_back(at_s, sequence);
  std::sort(oldest_first.begin(), oldest_first.end());
  const uint64_t limit = max_bytes / 10 * 9 + max_bytes % 10 * 9 / 10;
  for (const auto& [at_s, sequence] : oldest_first) {
    if (bytes <= limit) break;
    bytes -= log.patches().at(sequence).bytes();
    chosen.insert(sequence);
  }
  return chosen;
}

}  // namespace telesplat::packer
