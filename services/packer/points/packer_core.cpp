#include "services/packer/points/packer_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/codec/room_axes.h"
#include "common/geometry/camera.h"
#include "common/refinement/bounded_patches.h"
#include "services/packer/points/event_log.h"
#include "services/packer/points/frame_book.h"
#include "services/packer/points/obsolescence.h"

namespace telesplat::packer {
namespace {

constexpr uint32_t kMostRestNumber = points::kRestTag - 1;
// Viewers whose rests are kept: those of one user and a few guests.
constexpr size_t kMaxRests = 16;
constexpr double kUnheard_s = 60;  // older reports of drawn clusters count as out of date

uint32_t rest_tag(uint32_t rest) { return static_cast<uint32_t>(points::tagged({}, false, rest).value); }

// Defence in depth: the network code has checked tiles already.
Status check_tile(const SampledTile& t) {
  if (const Status part = check(t, "tile"); !part) return part;
  const size_t pixels = static_cast<size_t>(t.rect.width) * t.rect.height;
  if (pixels > codec::kMaxPixels)
    return Error{fmt::format("{} has {} pixels, at most {} are coded", name_of(t, "tile"), pixels, codec::kMaxPixels)};
  if (t.image.width != t.rect.width || t.image.height != t.rect.height || t.image.depth.size() != pixels ||
      t.image.colour.size() != pixels || t.image.normal.size() != pixels)
    return Error{fmt::format("{}: its image has {}x{} pixels, its rectangle {}x{}", name_of(t, "tile"), t.image.width,
                             t.image.height, t.rect.width, t.rect.height)};
  if (t.missed.width() > 0 && (t.missed.width() != t.rect.width || t.missed.height() != t.rect.height))
    return Error{fmt::format("{}: its mask has {}x{} pixels, its rectangle {}x{}", name_of(t, "tile"), t.missed.width(),
                             t.missed.height(), t.rect.width, t.rect.height)};
  return ok_status();
}

// decoded: unless null, it becomes the image that viewers decode.
std::shared_ptr<const std::vector<uint8_t>> encoded(const SampledTile& tile, const codec::ErrorBounds& bounds,
                                                    image::DepthImage* decoded) {
  return std::make_shared<const std::vector<uint8_t>>(
      codec::encode(tile.image, bounds, decoded, geometry::ray_axes(tile.camera, tile.rect)));
}

// Returns the smallest rectangle of the tile that holds all of its samples; one pixel if it has none.
geometry::Rect kept_in(const image::DepthImage& image) {
  int left = image.width, right = 0, top = image.height, bottom = 0;
  for (int y = 0; y < image.height; ++y) {
    const uint32_t* row = &image.depth[static_cast<size_t>(y) * image.width];
    const auto is_sample = [](uint32_t code) { return code != 0; };
    const auto first = static_cast<int>(std::find_if(row, row + image.width, is_sample) - row);
    if (first == image.width) continue;
    const auto behind = std::find_if(std::reverse_iterator(row + image.width), std::reverse_iterator(row), is_sample);
    left = std::min(left, first), right = std::max(right, static_cast<int>(behind.base() - row));
    top = std::min(top, y), bottom = y + 1;
  }
  return bottom == 0 ? geometry::Rect{0, 0, 1, 1} : geometry::Rect{left, top, right - left, bottom - top};
}

// Eliminated pixels need not be coded, decoded and searched: most rays of a planned tile only confirm the model.
void crop_to_kept(SampledTile& tile) {
  const geometry::Rect kept = kept_in(tile.image);
  if (kept.width == tile.rect.width && kept.height == tile.rect.height) return;
  image::DepthImage part(kept.width, kept.height);
  for (int y = 0; y < kept.height; ++y) {
    const size_t from = static_cast<size_t>(kept.y + y) * tile.rect.width + kept.x;
    const size_t to = static_cast<size_t>(y) * kept.width;
    std::copy_n(tile.image.depth.data() + from, kept.width, part.depth.data() + to);
    std::copy_n(tile.image.colour.data() + from, kept.width, part.colour.data() + to);
    std::copy_n(tile.image.normal.data() + from, kept.width, part.normal.data() + to);
  }
  tile.image = std::move(part);
  tile.rect = {tile.rect.x + kept.x, tile.rect.y + kept.y, kept.width, kept.height};
}

}  // namespace

struct PackerCore::Impl {
  const Config config;
  const Hooks hooks;
  EpochId epoch;
  Sequence sequence;  // the newest event's
  points::PointModel model{config.model};
  EventLog log{};
  FrameBook frames;
  Obsolescence obsolescence;             // kEliminate
  PatchObsolescence patch_obsolescence;  // kKeep
  std::optional<double> reported_s;      // last time a viewer reported the clusters that it drew
  Statistics statistics;
  ModelWatcher* watcher = nullptr;
  std::vector<float> reference_depth_m;               // kept for its memory
  std::vector<points::ClusterKey> clusters_of_patch;  // kept for its memory
  struct CoarsePass {
    FrameId frame;
    InstanceId viewer;
    RequestId request;
    std::vector<PatchKey> patches;
  };
  /// A place where a head rests, and the points that were cast for it.
  struct Rest {
    uint32_t number = 0;  // at least 1
    geometry::Pose pose;
    RequestId request;                      // the newest of its views
    std::set<points::ClusterKey> clusters;  // clusters that have its points
  };
  struct Refinable {
    std::shared_ptr<const std::vector<uint8_t>> stream;  // the refinement's
    std::vector<points::ClusterKey> clusters;
  };
  AllowedErrors allowed;
  refinement::RefinableBook<Refinable> refinables;
  std::deque<CoarsePass> coarse;     // coarse frames that no complete frame has replaced yet, oldest first
  std::map<InstanceId, Rest> rests;  // by viewer
  uint32_t newest_rest = 0;
  std::vector<PatchKey> superseded;  // patches that complete frames made superfluous

  Event next_event(Event::Kind kind) {
    Event event;
    event.sequence = sequence = sequence.next();
    event.kind = kind;
    event.epoch = epoch;
    return event;
  }

  bool keeps() const { return config.redundancy == Redundancy::kKeep; }

  splat::Elimination eliminate(SampledTile& tile, const std::optional<KnownReference>& known) {
    if (keeps()) {
      const auto nothing = static_cast<uint64_t>(std::count(tile.image.depth.begin(), tile.image.depth.end(), 0u));
      return {tile.image.pixels() - nothing, tile.image.pixels() - nothing};
    }
    if (known)
      return splat::eliminate_where_cast(tile.camera, tile.rect, *known, config.relative_epsilon, tile.image,
                                         config.nearest_sample);
    // The reference is rendered for this tile alone and as of now: it includes what other frames added or forgot
    // meanwhile, and clusters outside the tile's frustum cost next to nothing. It has one pixel more on each side,
    // inside the frame, for the tile's border.
    const geometry::Rect& r = tile.rect;
    const int left = std::min(r.x, 1), top = std::min(r.y, 1);
    const int right = std::min(tile.camera.width - r.x - r.width, 1),
              bottom = std::min(tile.camera.height - r.y - r.height, 1);
    const geometry::Rect around{r.x - left, r.y - top, r.width + left + right, r.height + top + bottom};
    const geometry::Camera view = geometry::crop(tile.camera, around);
    hooks.reference_depth(model, view, config.threads, reference_depth_m);
    return hooks.eliminate(view, {left, top, r.width, r.height}, reference_depth_m, config.relative_epsilon, tile.image,
                           config.nearest_sample);
  }

  using Stream = std::shared_ptr<const std::vector<uint8_t>>;

  void supersede(const CoarsePass& pass) {
    superseded.insert(superseded.end(), pass.patches.begin(), pass.patches.end());
  }

  // A coarse frame ends when a complete one answers the same request of its viewer, or a later one; coarse parts of a
  // frame when another one does.
  void note_pass(const Event& event, const points::PreparedPatch& patch) {
    if (event.provisional() && event.rest == 0) {
      auto at = std::find_if(coarse.begin(), coarse.end(), [&](const auto& pass) { return pass.frame == event.frame; });
      if (at == coarse.end()) at = coarse.insert(at, {event.frame, event.viewer, event.request, {}});
      auto& patches = at->patches;
      for (const auto& [key, mosaic] : patch.mosaics) patches.push_back({key, mosaic.frame_tag()});
      if (coarse.size() > kMaxOpenFrames) {
        if (!keeps()) supersede(coarse.front());  // provisional points must not stay
        coarse.pop_front();
      }
    }
    if (event.step == 1 && event.frame_complete && !event.extra && event.left_out == 0) {
      std::erase_if(coarse, [&](const CoarsePass& pass) {
        const bool over = pass.viewer == event.viewer && pass.request <= event.request && pass.frame != event.frame;
        if (over) supersede(pass);
        return over;
      });
    }
  }

  // Finer rays show a resting head more than its display resolves. Each resting place has its own number, and its
  // points are kept until the head has moved on.
  uint32_t rest_of(const SampledTile& tile) {
    const auto [at, is_new] = rests.try_emplace(tile.viewer);
    Rest& rest = at->second;
    if (!is_new && rest.pose == tile.camera.pose) {
      rest.request = std::max(rest.request, tile.request);
      return rest.number;
    }
    end_rest(rest);
    newest_rest = newest_rest % kMostRestNumber + 1;
    rest = {newest_rest, tile.camera.pose, tile.request, {}};
    if (rests.size() <= kMaxRests) return newest_rest;
    // Viewers leave without notice.
    const auto oldest = std::min_element(rests.begin(), rests.end(), [&](const auto& a, const auto& b) {
      return newest_rest - a.second.number > newest_rest - b.second.number;
    });
    end_rest(oldest->second);
    rests.erase(oldest);
    return newest_rest;
  }

  // True if the viewer's head rests elsewhere by now.
  bool comes_too_late(const SampledTile& tile) const {
    const auto at = rests.find(tile.viewer);
    return at != rests.end() && tile.request < at->second.request && !(at->second.pose == tile.camera.pose);
  }

  void end_rest(const Rest& rest) {
    for (const points::ClusterKey key : rest.clusters) superseded.push_back({key, rest_tag(rest.number)});
  }

  // A view from elsewhere is complete: end the viewer's old rest.
  void move_on(const SampledTile& tile) {
    const auto at = rests.find(tile.viewer);
    if (at == rests.end() || at->second.pose == tile.camera.pose) return;
    end_rest(at->second);
    rests.erase(at);
  }

  // Writes the tile's stream into the event, and replaces the tile's image by the decoded one. stream: of the exact
  // tile, or null. Returns the tile as sampled if a later refinement can use it.
  image::DepthImage code(Event& event, SampledTile& tile, Stream stream) {
    event.bounds = event.kept > 0 ? bounds_of(allowed, tile.camera) : codec::ErrorBounds{};
    uint32_t farthest = image::kMaxDepthCode;
    for (const uint32_t code : tile.image.depth)
      if (code != 0) farthest = std::min(farthest, code);
    if (event.kept > 0) event.farthest_m = image::decode_depth(farthest, tile.camera.near_m);
    if (event.bounds.exact()) {
      event.blob = stream ? std::move(stream) : encoded(tile, {}, nullptr);
      return {};
    }
    image::DepthImage decoded;
    event.blob = encoded(tile, event.bounds, &decoded);
    // A coarse pass is soon forgotten: it is not refined.
    event.refinable = !tile.provisional();
    ++statistics.patches_bounded;
    return std::exchange(tile.image, std::move(decoded));
  }

  std::optional<Event> refine(double drawn_since_s) {
    // Forgotten points may have come again unchanged, by another patch: only patches that are still whole are refined.
    auto next = refinables.take_newest([&](Sequence of, const Refinable& r) {
      if (!log.is_whole(of)) return false;
      return keeps() || std::any_of(r.clusters.begin(), r.clusters.end(), [&](points::ClusterKey key) {
               return obsolescence.accessed_since(key, drawn_since_s);
             });
    });
    if (!next) return std::nullopt;
    const Sequence of = next->first;
    const Event& patch = log.patches().at(of).event;
    const auto bounded = codec::decode(*patch.blob, patch.rect.width, patch.rect.height);
    CHECK(bounded.ok());
    const auto exact = codec::decode_refinement(*next->second.stream, *bounded);
    CHECK(exact.ok());
    Event event = next_event(Event::Kind::kRefine);
    event.refines = of;
    event.blob = std::move(next->second.stream);
    model.commit(points::plan_refinement(
        model, points::prepare_refinement(config.model, event.sequence, of,
                                          {patch.camera, patch.rect, *bounded, *exact, patch.tag()})));
    log.add_refinement(event);
    ++statistics.patches_refined;
    statistics.bytes_refined += event.blob->size();
    return event;
  }

  // Returns the unpublished event of a tile that changes nothing for viewers: over a third of all, where most is known.
  Event untold(const SampledTile& tile, const splat::Elimination& elimination, const FrameBook::Frame& frame) {
    static const auto nothing = std::make_shared<const std::vector<uint8_t>>();
    Event event;
    static_cast<FramePart&>(event) = tile;
    event.rect = {tile.rect.x, tile.rect.y, 1, 1};
    event.blob = nothing;
    event.frame_complete = frame.tiles_left == 0;
    event.samples = elimination.samples;
    event.frame_samples = frame.samples, event.frame_kept = frame.kept;
    ++statistics.tiles, ++statistics.tiles_untold;
    statistics.frames_complete += event.frame_complete;
    statistics.samples += event.samples;
    return event;
  }

  Event pack(SampledTile& tile, double now_s, Stream stream, const std::function<void(const Event&)>& publish,
             const std::optional<KnownReference>& known) {
    if (tile.missed.width() > 0 && comes_too_late(tile)) {
      tile.image = image::DepthImage(tile.rect.width, tile.rect.height);
      tile.missed = {};
    }
    const splat::Elimination elimination = eliminate(tile, known);
    const uint32_t rest = tile.missed.width() > 0 ? rest_of(tile) : 0;
    const FrameBook::Frame frame = frames.add(tile, elimination, rest != 0);
    if (!tile.extra && tile.step == 1 && frame.tiles_left == 0) move_on(tile);
    if (frame.nothing_new) {
      Event event = untold(tile, elimination, frame);
      if (publish) publish(event);
      return event;
    }
    Event event = next_event(Event::Kind::kPatch);
    if (rest != 0) event.missed = codec::encode_mask(tile.missed), event.missed_rect = tile.rect, event.rest = rest;
    if (!keeps()) crop_to_kept(tile);
    static_cast<FramePart&>(event) = tile;
    event.frame_complete = frame.tiles_left == 0;
    event.samples = elimination.samples, event.kept = elimination.kept;
    event.untold_samples = frame.untold - elimination.samples;
    event.frame_samples = frame.samples, event.frame_kept = frame.kept;
    const image::DepthImage exact = code(event, tile, keeps() ? std::move(stream) : nullptr);
    if (publish) publish(event);

    points::PreparedPatch patch =
        points::prepare_patch(config.model, event.sequence, tile.camera, tile.rect, tile.image, event.tag());
    clusters_of_patch.clear();
    for (const auto& [key, mosaic] : patch.mosaics) {
      clusters_of_patch.push_back(key);
      if (keeps())
        patch_obsolescence.added(key, mosaic, now_s);
      else
        obsolescence.accessed(key, now_s);
    }
    if (event.rest != 0) rests.at(event.viewer).clusters.insert(clusters_of_patch.begin(), clusters_of_patch.end());
    note_pass(event, patch);
    log.add_patch(event, clusters_of_patch);
    if (event.refinable && !clusters_of_patch.empty())
      refinables.add(event.sequence, event.blob->size(),
                     {std::make_shared<const std::vector<uint8_t>>(codec::encode_refinement(exact, tile.image)),
                      clusters_of_patch});
    statistics.points_outside += patch.outside;
    if (watcher) watcher->inserted(patch);
    model.insert(std::move(patch));

    ++statistics.tiles;
    statistics.frames_complete += event.frame_complete;
    statistics.samples += event.samples;
    statistics.kept += event.kept;
    return event;
  }

  void forget(std::span<const points::ClusterKey> keys, std::vector<Event>& out) {
    while (!keys.empty()) {
      const auto some = keys.first(std::min(keys.size(), kMaxForgetKeys));
      keys = keys.subspan(some.size());
      Event event = next_event(Event::Kind::kForget);
      event.clusters.assign(some.begin(), some.end());
      const uint64_t points = model.points();
      std::vector<points::ClusterKey> dropped;
      for (const points::Cluster& cluster : model.forget(some)) dropped.push_back(cluster.key);
      log.add_forget(event.sequence, dropped);
      if (watcher) watcher->forgotten(dropped);
      for (const points::ClusterKey key : some) obsolescence.forgotten(key);
      statistics.clusters_forgotten += dropped.size();
      statistics.points_forgotten += points - model.points();
      out.push_back(std::move(event));
    }
  }

  // Notes those of the clusters that have no patch left, after single patches were forgotten.
  void forget_emptied(std::span<const points::ClusterKey> keys) {
    if (keeps()) return;
    std::vector<points::ClusterKey> emptied;
    std::copy_if(keys.begin(), keys.end(), std::back_inserter(emptied),
                 [&](points::ClusterKey k) { return !model.find(k); });
    for (const points::ClusterKey key : emptied) obsolescence.forgotten(key);
    if (watcher) watcher->forgotten(emptied);
  }

  void forget_patches(std::span<const PatchKey> keys, std::vector<Event>& out) {
    while (!keys.empty()) {
      const auto some = keys.first(std::min(keys.size(), kMaxForgetKeys));
      keys = keys.subspan(some.size());
      Event event = next_event(Event::Kind::kForget);
      for (const PatchKey& key : some) {
        event.clusters.push_back(key.cluster);
        event.frames.push_back(key.frame);
        patch_obsolescence.forgotten(key);
      }
      const uint64_t points = model.points(), clusters = model.clusters().size();
      const std::vector<points::Cluster> dropped = model.forget(event.clusters, event.frames);
      log.add_patch_forget(event, dropped);
      forget_emptied(event.clusters);
      statistics.clusters_forgotten += clusters - model.clusters().size();
      statistics.patches_forgotten += dropped.size();
      statistics.points_forgotten += points - model.points();
      out.push_back(std::move(event));
    }
  }
};

PackerCore::PackerCore(const Config& config, EpochId epoch) : PackerCore(config, epoch, Hooks{}) {}
PackerCore::PackerCore(const Config& config, EpochId epoch, Hooks hooks)
    : impl_(new Impl{.config = config, .hooks = std::move(hooks), .epoch = epoch}) {
  // kKeep forgets single patches by their mosaics, so these must not be merged.
  CHECK(!(config.redundancy == Redundancy::kKeep && config.model.compact));
}
PackerCore::~PackerCore() = default;

Result<std::optional<Event>> PackerCore::submit(SampledTile tile, double now_s, Impl::Stream stream,
                                                const std::function<void(const Event&)>& publish,
                                                const std::optional<KnownReference>& reference) {
  Impl& i = *impl_;
  if (tile.epoch != i.epoch) {
    ++i.statistics.tiles_other_epoch;
    return std::optional<Event>();
  }
  Status good = check_tile(tile);
  if (good && i.frames.has(tile.frame, tile.tile)) {
    ++i.statistics.tiles_duplicate;
    return std::optional<Event>();
  }
  if (good) good = i.frames.check(tile);
  if (!good) {
    ++i.statistics.tiles_refused;
    return good.error();
  }
  return std::optional<Event>(i.pack(tile, now_s, std::move(stream), publish, reference));
}

Result<std::optional<Event>> PackerCore::complete_empty(FramePart frame, double now_s) {
  frame.tile = 0, frame.tiles_in_frame = 1;
  frame.rect = {0, 0, 1, 1};
  return submit({frame, image::DepthImage(1, 1)}, now_s);
}

Result<std::optional<Event>> PackerCore::end_frame(FramePart frame, double now_s) {
  const auto left = impl_->frames.left(frame.frame, std::max(frame.tiles_in_frame, 1u));
  if (!left) return std::optional<Event>();
  frame.tile = left->first, frame.tiles_in_frame = left->tiles_in_frame, frame.left_out = left->tiles;
  frame.rect = {0, 0, 1, 1};
  return submit({frame, image::DepthImage(1, 1)}, now_s);
}

void PackerCore::watch(ModelWatcher* watcher) { impl_->watcher = watcher; }

std::vector<Event> PackerCore::forget(std::span<const points::ClusterKey> clusters) {
  std::vector<Event> out;
  impl_->forget(clusters, out);
  return out;
}

void PackerCore::allow_errors(const AllowedErrors& allowed) { impl_->allowed = allowed; }
const AllowedErrors& PackerCore::allowed_errors() const { return impl_->allowed; }
std::optional<Event> PackerCore::refine(double drawn_since_s) { return impl_->refine(drawn_since_s); }

bool PackerCore::has(FrameId frame, uint32_t tile) const { return impl_->frames.has(frame, tile); }

void PackerCore::accessed(std::span<const points::ClusterKey> clusters, double now_s,
                          std::span<const uint32_t> frames) {
  CHECK(frames.empty() || frames.size() == clusters.size());
  Impl& i = *impl_;
  i.reported_s = now_s;
  for (size_t n = 0; n < clusters.size(); ++n) {
    if (!i.keeps()) {
      if (i.obsolescence.knows(clusters[n])) i.obsolescence.accessed(clusters[n], now_s);
    } else if (frames.empty()) {
      i.patch_obsolescence.accessed(clusters[n], now_s);
    } else {
      i.patch_obsolescence.accessed({clusters[n], frames[n]}, now_s);
    }
  }
}

std::vector<Event> PackerCore::tick(double now_s) {
  Impl& i = *impl_;
  const Config& c = i.config;
  std::vector<Event> out;
  // While no report gets through, it is unknown which clusters viewers draw: their time stops.
  const double known_s = i.reported_s ? std::max(*i.reported_s, now_s - kUnheard_s) : now_s;
  if (i.keeps()) {
    const PatchLimits limits{c.obsolete_after_s, c.patches_per_cluster, c.max_points};
    i.forget_patches(i.patch_obsolescence.choose(limits, known_s), out);
    if (c.max_log_bytes > 0) i.forget_patches(i.patch_obsolescence.choose_events(i.model, i.log, c.max_log_bytes), out);
  } else {
    i.forget(i.obsolescence.choose(i.model, known_s, c.obsolete_after_s, c.max_points), out);
    if (c.max_log_bytes > 0) i.forget(i.obsolescence.choose_patches(i.log, c.max_log_bytes), out);
  }
  return out;
}

std::vector<Event> PackerCore::forget_superseded() {
  std::vector<Event> out;
  std::vector<PatchKey> keys = std::exchange(impl_->superseded, {});
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  impl_->forget_patches(keys, out);
  return out;
}

void PackerCore::forget_frames() {
  impl_->frames.clear();
  if (!impl_->keeps())
    for (const auto& pass : impl_->coarse) impl_->supersede(pass);
  impl_->coarse.clear();
}

std::optional<Event> PackerCore::begin_epoch(EpochId epoch) {
  Impl& i = *impl_;
  if (epoch == i.epoch) return std::nullopt;
  i.epoch = epoch;
  Event event = i.next_event(Event::Kind::kEpoch);
  i.model.clear();
  i.frames.clear();
  i.obsolescence.clear();
  i.patch_obsolescence.clear();
  i.coarse.clear();
  i.rests.clear();
  i.superseded.clear();
  i.refinables.clear();
  i.log.add_epoch(event);
  if (i.watcher) i.watcher->cleared();
  return event;
}

std::vector<Event> PackerCore::events_since(Sequence after) const {
  CHECK(remembers(after));
  std::vector<Event> events = impl_->log.since(after);
  for (Event& event : events) event.epoch = impl_->epoch;
  return events;
}

EventLog::Replay PackerCore::replay(Sequence after) const {
  CHECK(remembers(after));
  EventLog::Replay out = impl_->log.replay(after, impl_->sequence);
  out.epoch = impl_->epoch;
  return out;
}

std::optional<Event> PackerCore::next(EventLog::Replay& replay) const {
  auto event = impl_->log.next(replay);
  if (event) event->epoch = replay.epoch;
  return event;
}

bool PackerCore::remembers(Sequence after) const { return impl_->log.remembers(after); }

Sequence PackerCore::sequence() const { return impl_->sequence; }
EpochId PackerCore::epoch() const { return impl_->epoch; }
Redundancy PackerCore::redundancy() const { return impl_->config.redundancy; }
const points::PointModel& PackerCore::model() const { return impl_->model; }
const Statistics& PackerCore::statistics() const { return impl_->statistics; }
uint64_t PackerCore::log_bytes() const { return impl_->log.bytes(); }

}  // namespace telesplat::packer
