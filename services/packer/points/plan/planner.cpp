#include "services/packer/points/plan/planner.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace telesplat::packer {
namespace {

// The pixels of a view are checked in turn, in sets of 1 / (validation * kSets) of them: up to kSets sets per plan,
// fewer where plans follow each other in less than kTurn_s, and where the head stands still.
constexpr int kSets = 8, kStillSets = 4;
constexpr double kTurn_s = 0.25;
// Known empty pixels are checked this many times as seldom.
constexpr int kEmptyShare = 4;

// Sampling, coding and packing one ray of a mask takes about four times as long as one of a whole tile.
constexpr uint64_t kScattered = 4;

bool never_cast(RayClass c) { return c == RayClass::kGood || c == RayClass::kKnownEmpty; }

uint64_t last_word_mask(int width) { return (width & 63) == 0 ? ~uint64_t{0} : (uint64_t{1} << (width & 63)) - 1; }

}  // namespace

// The pixels of a view that are cast, each for one reason.
struct Planner::ViewClasses {
  image::PixelMask cast, firm;
  // Rays of `cast` that only refine shown surfaces, with nothing unseen before them; and those that are put off.
  image::PixelMask sparse, edge, put_off;
  std::map<std::string, double> figures;
  uint64_t needed = 0;  // rays cast for other reasons than validation
};

Planner::Planner(const PlanConfig& c)
    : config_(c),
      test_{c.relative_epsilon, c.nearest_sample},
      keys_(c.threads),
      known_empty_(c.model),
      blue_noise_(std::max(c.validation, 1) * kSets),
      validation_(c.model) {}

size_t Planner::issue(Question& q, std::vector<RayTile> tiles, PlannedFrame frame) {
  tiles.resize(add_tiles(tiles, config_.threads, q.plan));
  frame.id = q.request.frame;
  frame.viewer = q.request.viewer;
  frame.planned_s = q.now_s;
  frame.left = tiles.size();
  frame.returned.assign(tiles.size(), false);
  frame.tiles = std::move(tiles);
  if (frame.kind != PlannedFrame::Kind::kFine) frame.came_m.resize(frame.tiles.size());
  q.plan.camera = frame.camera;
  q.plan.figures["mask_bytes"] = 4.0 * static_cast<double>(q.plan.masks.size());
  const size_t count = frame.tiles.size();
  if (count > 0) shelf_.add(std::move(frame));
  return count;
}

// Reuses the memory of maps that are no longer in use: allocating it anew costs as much as filling it.
std::shared_ptr<ViewMap> Planner::new_map() {
  size_t pixels = 0;
  std::erase_if(maps_, [&](const auto& map) {
    pixels += map->depth_m.capacity();
    return map.use_count() == 1 && pixels > ViewerViews::kMaxMapPixels;
  });
  for (const auto& map : maps_)
    if (map.use_count() == 1) return map;
  if (maps_.size() < ViewerViews::kMaxMaps) return maps_.emplace_back(std::make_shared<ViewMap>());
  return std::make_shared<ViewMap>();
}

// Renders the view's map, unless neither view nor model has changed.
void Planner::map_view(Question& q, ViewerView& view) {
  if (view.map && view.map_changes == changes_) return;
  view.map = new_map();
  render_view_map(q.model, view.camera, test_, keys_, *view.map);
  view.map_changes = changes_;
}

uint64_t Planner::validation_sets(const Question& q, ViewerView& view) const {
  if (config_.validation == 0) return 0;
  return view.validation.take_due(kSets, kTurn_s, view.still ? kStillSets : kSets, q.now_s);
}

Planner::ViewClasses Planner::classify(Question& q, ViewerView& view) {
  const ViewMap& map = *view.map;
  const int width = map.camera.width, height = map.camera.height;
  ViewClasses out;
  for (image::PixelMask* mask : {&out.cast, &out.firm, &out.sparse, &out.edge}) mask->reset(width, height);
  image::PixelMask may_hold, stale(width, height);
  known_empty_.project(map.camera, map.depth_m, config_.threads, may_hold);
  validation_.mark_stale(map.camera, q.now_s, stale);
  std::array<uint64_t, kRayClasses> pixels{}, rays{};
  const uint64_t picks = validation_sets(q, view);
  for (int y = 0; y < height; ++y) {
    uint64_t picked = 0, picked_empty = 0;
    for (uint64_t i = 0; i < picks; ++i) picked |= blue_noise_.row(y, view.validation.round + i);
    for (uint64_t r = view.validation.round; r < view.validation.round + picks; ++r)
      if (r % kEmptyShare == 0) picked_empty |= blue_noise_.row(y, r / kEmptyShare);
    for (size_t w = 0; w < map.covered.words_per_row(); ++w) {
      const uint64_t inside = w + 1 == map.covered.words_per_row() ? last_word_mask(width) : ~uint64_t{0};
      const uint64_t covered = map.covered.row(y)[w], lacking = map.lacking.row(y)[w], edge = map.edge.row(y)[w];
      const uint64_t holds = may_hold.row(y)[w], old = stale.row(y)[w], done = view.done.row(y)[w];
      uint64_t left = inside, cast = 0;
      const auto take = [&](RayClass reason, uint64_t members, uint64_t chosen) {
        const auto c = static_cast<size_t>(reason);
        members &= left;
        left &= ~members;
        pixels[c] += static_cast<uint64_t>(std::popcount(members));
        rays[c] += static_cast<uint64_t>(std::popcount(members & chosen));
        cast |= members & chosen;
      };
      // Doubted pixels are included: rays there are evidence.
      const uint64_t good = covered & ~lacking & ~holds, empty = ~covered & ~holds & inside;
      take(RayClass::kStale, old, ~uint64_t{0});
      take(RayClass::kNothing, ~covered & holds, ~done);
      const uint64_t before = cast;
      take(RayClass::kEdge, lacking & edge, ~done);
      const uint64_t edge_cast = cast & ~before;
      take(RayClass::kSparse, lacking, ~done);
      out.edge.row(y)[w] = edge_cast & ~holds;
      out.sparse.row(y)[w] = cast & ~before & ~edge_cast & ~holds;
      take(RayClass::kUnproven, holds, ~done);
      out.firm.row(y)[w] = (good & ~edge) | empty;
      out.needed += static_cast<uint64_t>(std::popcount(cast));
      const uint64_t checked = left & ((covered & picked) | (~covered & picked_empty));
      rays[static_cast<size_t>(RayClass::kValidation)] += static_cast<uint64_t>(std::popcount(checked));
      cast |= checked;
      take(RayClass::kKnownEmpty, ~covered, 0);
      take(RayClass::kGood, ~uint64_t{0}, 0);
      out.cast.row(y)[w] = cast;
    }
  }
  view.validation.round += picks;
  for (size_t i = 0; i < kRayClasses; ++i) {
    const auto c = static_cast<RayClass>(i);
    if (c != RayClass::kValidation) out.figures[fmt::format("pixels.{}", name_of(c))] = static_cast<double>(pixels[i]);
    if (!never_cast(c)) out.figures[fmt::format("rays.{}", name_of(c))] = static_cast<double>(rays[i]);
  }
  return out;
}

// The master samples the whole view. The planner learns from its tiles as they come.
void Planner::plan_full(Question& q, const ViewerView& view) {
  q.plan.full = true;
  q.plan.camera = view.camera;
}

// Puts off rays at surfaces that are shown already, though coarsely; fewer of those at edges than of those between.
void Planner::put_off(uint64_t most_rays, ViewClasses& classes) {
  constexpr uint64_t kEdges = 4;  // times as many rays may stay at edges (PlanRequest::most_rays)
  const uint64_t sparse = put_off_rays(classes.sparse, most_rays, classes.cast);
  const uint64_t edge = put_off_rays(classes.edge, kEdges * std::min(most_rays, ~uint64_t{0} / kEdges), classes.cast);
  if (sparse + edge == 0) return;
  classes.put_off.reset(classes.cast.width(), classes.cast.height());
  for (int y = 0; y < classes.cast.height(); ++y)
    for (size_t w = 0; w < classes.cast.words_per_row(); ++w) {
      const uint64_t left = (classes.sparse.row(y)[w] | classes.edge.row(y)[w]) & ~classes.cast.row(y)[w];
      classes.put_off.row(y)[w] = left;
    }
  classes.needed -= sparse + edge;
  classes.figures["rays.sparse"] -= static_cast<double>(sparse);
  classes.figures["rays.edge"] -= static_cast<double>(edge);
  classes.figures["rays.put_off"] = static_cast<double>(sparse + edge);
}

void Planner::plan_view(Question& q, ViewerView& view) {
  follow(q.request.camera, view);
  if (q.model.points() == 0) return plan_full(q, view);
  map_view(q, view);
  ViewClasses classes = classify(q, view);
  if (q.request.most_rays > 0) put_off(q.request.most_rays, classes);
  q.plan.figures = std::move(classes.figures);
  const auto all = static_cast<uint64_t>(view.camera.width) * static_cast<uint64_t>(view.camera.height);
  if (classes.needed > all / kScattered) return plan_full(q, view);

  std::vector<RayTile> tiles = cut_tiles(classes.cast, {0, 0, view.camera.width, view.camera.height}, q.limits());
  sort_by_distance_to_centre(tiles, view.camera.width, view.camera.height);
  PlannedFrame frame{
      .camera = view.camera, .map = view.map, .firm = std::move(classes.firm), .put_off = std::move(classes.put_off)};
  issue(q, std::move(tiles), std::move(frame));
}

wire::Plan Planner::plan(const points::PointModel& model, Sequence sequence, const wire::PlanRequest& request,
                         double now_s) {
  for (;;)
    if (auto plan = plan_piece(model, sequence, request, now_s)) return *std::move(plan);
}

std::optional<wire::Plan> Planner::plan_piece(const points::PointModel& model, Sequence sequence,
                                              const wire::PlanRequest& request, double now_s) {
  settle_old(now_s);
  Question q{model, sequence, request, now_s};
  q.plan.frame = request.frame;
  q.plan.epoch = request.epoch;
  q.plan.camera = request.camera;
  if (!geometry::validate(request.camera)) return std::move(q.plan);
  if (uint64_t(request.camera.width) * uint64_t(request.camera.height) > kMaxPixels) {
    q.plan.full = !request.extra;
    return std::move(q.plan);
  }
  ViewerView& view = viewers_.use(request.viewer);
  if (request.extra)
    plan_extra(q, view);
  else
    plan_view(q, view);
  if (q.plan.tiles.empty() && q.unfinished) return std::nullopt;
  return std::move(q.plan);
}

void Planner::inserted(const points::PreparedPatch& patch) {
  changes_ += !patch.mosaics.empty();
  known_empty_.add(patch);
  note_inserted(patch, config_.model, shelf_);
}

void Planner::forgotten(std::span<const points::ClusterKey> clusters) {
  ++changes_;  // single patches may be gone without a whole cluster
  if (clusters.empty()) return;
  known_empty_.forget(clusters);
  validation_.forgotten(clusters);
  for (PlannedFrame& frame : shelf_.frames()) frame.nearest_known = false;
  viewers_.forgotten(config_.model, config_.view_cell_m, clusters);
}

void Planner::cleared() {
  ++changes_;
  known_empty_.clear();
  validation_.clear();
  viewers_.clear();
  shelf_.clear();
}

}  // namespace telesplat::packer
