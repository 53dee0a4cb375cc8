// Plans rays beyond what a view asks for: from beside it, so that a movement of the head uncovers nothing unknown, and
// finer ones.
#include <algorithm>
#include <bit>
#include <cmath>
#include <mutex>
#include <utility>

#include "common/wire/short_camera.h"
#include "services/packer/points/plan/planner.h"

namespace telesplat::packer {
namespace {

constexpr double kMostFull = 0.85;  // share of the model's limit of points from which on no extra rays are planned
constexpr unsigned kDirections = 8;
// Rays from beside a view while the head moves, as a share of its pixels: the next view has edges of its own.
constexpr double kMovingCells = 0.05;
// Tiles that have not come after this time are planned again.
constexpr double kLost_s = 0.5;
// Views from beside: they reach this share farther on each side, and a sample this near, in pixels, suffices.
constexpr double kWider = 0.04;
constexpr float kNearestFromBeside = 1.5f;
// Tolerance of depth there, as a fraction: coarse splats stand out that far before the samples that they hide, and rays
// at them brought only known points.
constexpr float kEpsilonFromBeside = 0.02f;
// Longest step aside, in distances to the nearest surface in view: a head moves no farther at once. With 0.5 a model
// grows a little less, and moving bones have holes in 0.095 % of their pixels instead of 0.059 %.
constexpr double kStepAside = 1;
// Shown pixels are cast from beside only if the view itself sees their place at most this many times as coarsely.
constexpr double kCloser = 1.5;
constexpr int kNearEdge = 32;  // pixels around an edge; a word of a mask is twice as wide
// The surfaces of a view that stands still are judged at most this often: again each time all of its finer rays are
// cast, since the points found by these have edges of their own.
constexpr int kMostLooks = 3;
// Tiles of a finer view that are searched before rays are counted again.
constexpr size_t kTilesAtOnce = 8;
// Size of the parts of a finer view whose points are chosen and binned at once: for the whole view, choosing its points
// takes longer than searching as much as one plan has room for.
constexpr int kRegionWidth = 8 * kPlanTileWidth, kRegionHeight = 8 * kPlanTileHeight;

// Returns the i-th direction in the camera's plane, the sides first.
glm::dvec3 direction(unsigned i) {
  constexpr double kDiagonal = 0.70710678;
  constexpr glm::dvec3 kTable[kDirections] = {{1, 0, 0},
                                              {-1, 0, 0},
                                              {0, 1, 0},
                                              {0, -1, 0},
                                              {kDiagonal, kDiagonal, 0},
                                              {-kDiagonal, -kDiagonal, 0},
                                              {-kDiagonal, kDiagonal, 0},
                                              {kDiagonal, -kDiagonal, 0}};
  return kTable[i % kDirections];
}

geometry::Camera widened(const geometry::Camera& camera) {
  const auto room = [](int side) {
    return std::min(static_cast<int>(kWider * side), (geometry::kMaxImageSide - side) / 2);
  };
  const int x = room(camera.width), y = room(camera.height);
  return geometry::crop(camera, {-x, -y, camera.width + 2 * x, camera.height + 2 * y});
}

// Returns the same frustum with `times` as many pixels on each axis.
geometry::Camera finer_camera(const geometry::Camera& camera, int times) {
  geometry::Camera out = camera;
  out.width *= times, out.height *= times;
  return out;
}

// A movement uncovers places beside edges. Elsewhere the unknown is only space between the eye and known surfaces that
// no view has looked into: the next view that looks there will find out.
void drop_far_from_edges(const ViewMap& map, image::PixelMask& cast) {
  const auto word_of = [&](const image::PixelMask& mask, int y, size_t w) {
    return y < mask.height() ? mask.row(y)[w] : 0;
  };
  for (int y0 = 0; y0 < cast.height(); y0 += kNearEdge)
    for (size_t w = 0; w < cast.words_per_row(); ++w) {
      uint64_t edges = 0;
      for (int y = y0; y < y0 + kNearEdge; ++y) edges |= word_of(map.edge, y, w);
      if (edges != 0) continue;
      for (int y = y0; y < std::min(y0 + kNearEdge, cast.height()); ++y) cast.row(y)[w] &= ~map.covered.row(y)[w];
    }
}

// Drops shown pixels from the rays of a view from beside, unless their place lies in the view's own frustum (hidden
// there or not) and at a similar distance. They are known, only not as finely as from where no viewer stands. Each
// place beside a walk is another one and much nearer to some surface: walking around the bones again and again, nine
// tenths of the new points came from there.
void drop_beyond_view(const ViewMap& map, const geometry::Camera& view, image::PixelMask& cast) {
  const auto t = view.room_to_pixel();
  for (int y = 0; y < cast.height(); ++y)
    for (size_t w = 0; w < cast.words_per_row(); ++w)
      for (uint64_t rest = cast.row(y)[w] & map.covered.row(y)[w]; rest != 0; rest &= rest - 1) {
        const int x = static_cast<int>(w) * 64 + std::countr_zero(rest);
        const double depth_m = map.depth_m[static_cast<size_t>(y) * static_cast<size_t>(cast.width()) + x];
        const glm::dvec4 place(map.camera.unproject(x + 0.5, y + 0.5, depth_m), 1);
        const double view_m = glm::dot(t.w, place), left = glm::dot(t.x, place), top = glm::dot(t.y, place);
        const bool inside = left >= 0 && top >= 0 && left < view_m * view.width && top < view_m * view.height;
        if (!(view_m >= view.near_m && inside && view_m <= kCloser * depth_m)) cast.row(y)[w] &= ~(rest & -rest);
      }
}

bool any(const image::PixelMask& mask, const geometry::Rect& r) {
  for (int y = r.y; y < r.y + r.height; ++y)
    for (int w = r.x >> 6; w <= (r.x + r.width - 1) >> 6; ++w)
      if (mask.row(y)[w] != 0) return true;
  return false;
}

}  // namespace

void Planner::plan_extra(Question& q, ViewerView& view) {
  // This planner has not planned this view, as after a restart.
  if (!view.known || !(view.camera == q.request.camera)) {
    follow(q.request.camera, view);
    view.still = q.request.still;
  }
  if (q.model.points() == 0) return;
  // Near its limit the model would make room for extra points by forgetting points that the view needs.
  if (config_.max_points > 0 &&
      static_cast<double>(q.model.points()) > kMostFull * static_cast<double>(config_.max_points))
    return;
  view.still = view.still || q.request.still;
  if (q.request.most_rays > 0) q.most_rays = q.request.most_rays;
  if (plan_lost(q, view)) return;
  const bool cells_first = q.request.round % 2 == 0;
  if (cells_first && plan_cells(q, view)) return;
  if (plan_fine(q, view)) return;
  if (!cells_first) plan_cells(q, view);
}

// Plans tiles of extra frames again that were given up for the view's tiles: the search plans each tile only once.
bool Planner::plan_lost(Question& q, ViewerView& view) {
  for (PlannedFrame& frame : shelf_.frames()) {
    if (frame.viewer != view.viewer || frame.kind == PlannedFrame::Kind::kView || frame.complete()) continue;
    if (q.now_s - frame.planned_s < kLost_s) continue;
    LostTiles lost{frame.camera, frame.kind, {}};
    for (size_t i = 0; i < frame.tiles.size(); ++i)
      if (!frame.returned[i]) lost.tiles.push_back(std::exchange(frame.tiles[i], {frame.tiles[i].rect, {}, 0}));
    // Tiles that come late have no mask any more: their samples are compared with the model.
    frame.returned.assign(frame.tiles.size(), true);
    frame.map = nullptr;
    frame.left = 0;
    frame.came_m.clear();  // settled: there is nothing to learn from it
    if (frame.kind == PlannedFrame::Kind::kFine && frame.base == view.camera) view.lost.push_back(std::move(lost));
  }
  if (view.lost.empty()) return false;
  LostTiles lost = std::move(view.lost.front());
  view.lost.pop_front();
  double rays = 0;
  for (const RayTile& tile : lost.tiles) rays += static_cast<double>(tile.rays);
  q.plan.figures["rays.refinement"] = rays;
  return issue(q, std::move(lost.tiles), {.kind = lost.kind, .camera = lost.camera, .base = view.camera}) > 0;
}

bool Planner::plan_cells(Question& q, ViewerView& view) {
  if (!(config_.view_cell_m > 0)) return false;
  if (!view.still) {
    const auto most = static_cast<uint64_t>(kMovingCells * view.camera.width * view.camera.height);
    if (view.cell_rays >= most) return false;
    q.most_rays = std::min(q.most_rays, most - view.cell_rays);
  }
  // A moving head has moved on before all directions had their turn.
  const unsigned tries = view.still ? kDirections : 1;
  for (unsigned i = 0; i < tries; ++i) {
    const unsigned turn = view.cell_turn % kDirections;
    if (!(view.cells_done >> turn & 1) && q.breaks_off()) return true;
    ++view.cell_turn;
    if (view.cells_done >> turn & 1) continue;
    view.cells_done |= 1u << turn;
    if (plan_cell(q, view, turn)) return true;
  }
  return false;
}

// From beside, the surroundings of a near surface look entirely different: a head close to a mesh that was looked at
// from 20 cm aside added 400,000 points a round, on and on.
double Planner::step_aside_m(const ViewerView& view) const {
  if (!view.map) return config_.view_cell_m;
  const auto& depth_m = view.map->depth_m;
  const auto nearest = std::min_element(depth_m.begin(), depth_m.end());
  return nearest == depth_m.end() ? config_.view_cell_m : std::min(config_.view_cell_m, kStepAside * double{*nearest});
}

bool Planner::plan_cell(Question& q, ViewerView& view, unsigned turn) {
  // As many rays on each axis as the view has: with half of them points beyond silhouettes are larger there than the
  // surfaces they belong to, which cost a moving head 1.1 dB.
  geometry::Camera camera = widened(view.camera);
  const double moved = glm::length(view.movement_m);
  // Every other view from beside lies where the head is going.
  const bool ahead = !view.still && moved > 1e-4 && turn % 2 == 0;
  camera.pose.position_room +=
      step_aside_m(view) * (ahead ? view.movement_m / moved : camera.pose.orientation * direction(turn));
  camera = wire::shortened(camera);
  // A head does not go into unseen space, as inside a solid: the inside shows another surface, and near.
  if (!geometry::validate(camera) || known_empty_.unseen_at(camera.pose.position_room)) return false;
  q.look_at(camera);
  const std::shared_ptr<ViewMap> map = new_map();
  render_view_map(q.model, camera, {kEpsilonFromBeside, kNearestFromBeside}, keys_, *map);
  image::PixelMask cast;
  known_empty_.project(camera, map->depth_m, config_.threads, cast);
  drop_far_from_edges(*map, cast);
  PlannedFrame frame{.kind = PlannedFrame::Kind::kCell, .camera = camera, .base = view.camera, .map = map};
  frame.firm.reset(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (size_t w = 0; w < cast.words_per_row(); ++w) {
      frame.firm.row(y)[w] = map->covered.row(y)[w] & ~cast.row(y)[w];  // no unseen space before it
      cast.row(y)[w] |= map->lacking.row(y)[w];
    }
  drop_beyond_view(*map, view.camera, cast);
  for (int y = 0; y < camera.height; ++y)
    for (size_t w = 0; w < cast.words_per_row(); ++w) frame.firm.row(y)[w] &= ~cast.row(y)[w];
  std::vector<RayTile> tiles = cut_tiles(cast, {0, 0, camera.width, camera.height}, q.limits());
  sort_by_distance_to_centre(tiles, camera.width, camera.height);
  uint64_t rays = 0;
  size_t count = 0;
  while (count < tiles.size() && !q.enough(rays)) rays += tiles[count++].rays;
  // The rest is found again when this direction has its next turn.
  if (count < tiles.size()) view.cells_done &= ~(1u << turn);
  tiles.resize(count);
  view.cell_rays += rays;
  q.plan.figures["rays.cell"] = static_cast<double>(rays);
  return issue(q, std::move(tiles), std::move(frame)) > 0;
}

bool Planner::plan_fine(Question& q, ViewerView& view) {
  if (!view.still) return false;
  if (q.breaks_off()) return true;
  if (!view.fine_map) look_closer(q, view);
  if (plan_stages(q, view)) return true;
  if (view.fine_changes == changes_ || view.looks >= kMostLooks) return false;
  if (q.breaks_off()) return true;
  look_closer(q, view);
  return plan_stages(q, view);
}

// Maps the view first, then the surfaces that finer rays have added to it.
void Planner::look_closer(Question& q, ViewerView& view) {
  if (view.looks++ == 0) {
    map_view(q, view);
    view.fine_map = view.map;
  } else {
    view.fine_map = nullptr;
    const std::shared_ptr<ViewMap> map = new_map();
    render_view_map(q.model, view.camera, test_, keys_, *map, true);
    view.fine_map = map;
  }
  view.fine_changes = changes_;
}

bool Planner::plan_stages(Question& q, ViewerView& view) {
  const std::shared_ptr<const ViewMap> map = view.fine_map;
  const int most = config_.still_rays;
  // Pixels with weak contrast get all of their rays at once: each further pass would change them little, but makes
  // another patch per cluster for packer and viewers to merge.
  const int weak = most >= 16 ? 2 : 1;
  // Pixels at edges get all of the finest rays, also where the model has samples: a sample does not say where a ray
  // passes beside its surface.
  const FineStage stages[] = {{0, map->edge, 1, most < 16},
                              {1, map->edge, 2, true},
                              {2, map->strong, 1, false},
                              {3, map->strong, 2, false},
                              {4, map->weak, weak, false}};
  for (const FineStage& stage : stages)
    if (most >= 1 << 2 * stage.finer && plan_fine(q, view, stage)) return true;
  return false;
}

namespace {

// Part of a finer view whose points are chosen together.
struct Region {
  geometry::Rect rect;  // in the finer view
  double distance2;     // to the view's middle, squared, in pixels
};

// Returns the regions with pixels that have not had these rays, from the middle outwards.
std::vector<Region> regions_of(const image::PixelMask& open, const geometry::Camera& fine, int times) {
  const splat::TileGrid grid{fine.width, fine.height, kRegionWidth, kRegionHeight};
  std::vector<Region> regions;
  for (int i = 0; i < grid.count(); ++i) {
    const geometry::Rect r = grid.rect(i);
    if (!any(open, {r.x / times, r.y / times, r.width / times, r.height / times})) continue;
    const double dx = r.x + 0.5 * r.width - 0.5 * fine.width, dy = r.y + 0.5 * r.height - 0.5 * fine.height;
    regions.push_back({r, dx * dx + dy * dy});
  }
  std::stable_sort(regions.begin(), regions.end(),
                   [](const Region& a, const Region& b) { return a.distance2 < b.distance2; });
  return regions;
}

// Part of a view that is searched with finer rays.
struct Part {
  geometry::Rect rect;  // in the view
  int tile;             // number of its tile in the region
};

// Returns the parts of a region with pixels that have not had these rays.
std::vector<Part> parts_of(const image::PixelMask& open, const geometry::Rect& region, int times) {
  const splat::TileGrid grid{region.width, region.height, kPlanTileWidth, kPlanTileHeight};
  std::vector<Part> parts;
  for (int i = 0; i < grid.count(); ++i) {
    const geometry::Rect r = grid.rect(i);
    const geometry::Rect in_view{(region.x + r.x) / times, (region.y + r.y) / times, r.width / times, r.height / times};
    if (any(open, in_view)) parts.push_back({in_view, i});
  }
  return parts;
}

// Returns the rays in the pixels `wanted` of a part (a mask as large). all: every ray; else those without a sample.
image::PixelMask fine_rays(const splat::ViewKeys::Tile& tile, const PixelJudge& judge, const image::PixelMask& wanted,
                           int times, bool all) {
  ViewMap local;
  reset_masks(tile.rect.width, tile.rect.height, local);
  if (!all) judge.judge(tile, 0, 0, local);
  image::PixelMask rays(tile.rect.width, tile.rect.height);
  for (int y = 0; y < wanted.height(); ++y) {
    image::for_each_set(wanted.row(y), wanted.words_per_row(), [&](size_t x) {
      for (int dy = 0; dy < times; ++dy)
        for (int dx = 0; dx < times; ++dx) rays.set(static_cast<int>(x) * times + dx, y * times + dy);
    });
    if (all) continue;
    for (int row = y * times; row < (y + 1) * times; ++row)
      for (size_t w = 0; w < rays.words_per_row(); ++w)
        rays.row(row)[w] &= ~local.covered.row(row)[w] | local.lacking.row(row)[w];
  }
  return rays;
}

}  // namespace

// Searches one region until there are enough rays, or the piece ends. Its tiles are cut from all rays found in it:
// packer and viewers pay for each tile.
void Planner::look_into(Question& q, const geometry::Rect& region, FineSearch& search) {
  const int times = search.camera.width / search.open.width();
  const std::vector<Part> parts = parts_of(search.open, region, times);
  const geometry::Camera camera = geometry::crop(search.camera, region);
  keys_.begin(q.model, camera, kPlanTileWidth, kPlanTileHeight, true);
  const PixelJudge judge(camera, test_, keys_.rim());
  image::PixelMask cast(region.width, region.height);
  std::mutex mutex;
  for (size_t first = 0; first < parts.size() && !q.enough(search.rays); first += kTilesAtOnce) {
    if (first > 0 && q.breaks_off()) break;
    const std::span<const Part> some(parts.data() + first, std::min(kTilesAtOnce, parts.size() - first));
    std::vector<int> indices;
    for (const Part& part : some) indices.push_back(part.tile);
    keys_.draw(indices, [&](const splat::ViewKeys::Tile& tile) {
      const geometry::Rect& part =
          std::find_if(some.begin(), some.end(), [&](const Part& p) { return p.tile == tile.index; })->rect;
      const image::PixelMask wanted = fine_rays(tile, judge, cropped(search.open, part), times, search.all);
      const std::lock_guard lock(mutex);
      merge(wanted, tile.rect.x, tile.rect.y, cast);
      search.rays += wanted.count();
    });
    for (const Part& part : some) merge(cropped(search.open, part.rect), part.rect.x, part.rect.y, search.refined);
    q.looked_at += some.size() * uint64_t{kPlanTileWidth} * uint64_t{kPlanTileHeight};
  }
  for (RayTile& tile : cut_tiles(cast, {0, 0, region.width, region.height}, q.limits())) {
    tile.rect.x += region.x, tile.rect.y += region.y;
    search.tiles.push_back(std::move(tile));
  }
}

bool Planner::plan_fine(Question& q, ViewerView& view, const FineStage& stage) {
  const int times = 1 << stage.finer;
  FineSearch search{.camera = finer_camera(view.camera, times),
                    .all = stage.all,
                    .open = stage.wanted,
                    .refined = view.refined[static_cast<size_t>(stage.finer)],
                    .tiles = view.found[stage.number]};
  if (!geometry::validate(search.camera)) return false;
  for (int y = 0; y < search.open.height(); ++y)
    for (size_t w = 0; w < search.open.words_per_row(); ++w) search.open.row(y)[w] &= ~search.refined.row(y)[w];
  const std::vector<Region> regions = regions_of(search.open, search.camera, times);
  if (regions.empty() && search.tiles.empty()) return false;
  if (!regions.empty() && q.breaks_off()) return true;

  for (const RayTile& tile : search.tiles) search.rays += tile.rays;
  for (const Region& region : regions) {
    if (q.enough(search.rays) || (&region != &regions.front() && q.breaks_off())) break;
    look_into(q, region.rect, search);
  }
  if (q.unfinished && !q.enough(search.rays)) return true;
  sort_by_distance_to_centre(search.tiles, search.camera.width, search.camera.height);
  q.plan.figures["rays.refinement"] = static_cast<double>(search.rays);
  return issue(q, std::exchange(search.tiles, {}),
               {.kind = PlannedFrame::Kind::kFine, .camera = search.camera, .base = view.camera}) > 0 ||
         q.unfinished;
}

}  // namespace telesplat::packer
