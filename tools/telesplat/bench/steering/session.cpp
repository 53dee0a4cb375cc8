#include "tools/telesplat/bench/steering/session.h"

#include <time.h>

#include <algorithm>
#include <bit>

#include "client/viewer/points/still_picture.h"
#include "client/viewer/render/supersampler.h"
#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/core/clock.h"
#include "common/splat/reference/reference_depth.h"

namespace telesplat::launcher {
namespace {

constexpr int kTile = 256;     // as the master cuts frames
constexpr int kSubPixels = 4;  // of a still picture, on each axis

// Processor time of all threads: sampling, coding and packing are done one after the other.
double processor_ms() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) * 1e3 + double(t.tv_nsec) * 1e-6;
}

// Adds what `work` took to `ms`.
auto timed(double& ms, auto work) {
  const double begin = processor_ms();
  auto out = work();
  ms += processor_ms() - begin;
  return out;
}

packer::Config packer_config(const packer::PlanConfig& plan) {
  packer::Config out;
  out.model = plan.model;
  out.relative_epsilon = plan.relative_epsilon;
  out.nearest_sample = plan.nearest_sample;
  out.threads = plan.threads;
  return out;
}

uint64_t pixels(const geometry::Camera& c) { return uint64_t(c.width) * uint64_t(c.height); }

// The rectangles of a frame that is sampled whole.
std::vector<geometry::Rect> whole_tiles(const geometry::Camera& c) {
  std::vector<geometry::Rect> out;
  for (int y = 0; y < c.height; y += kTile)
    for (int x = 0; x < c.width; x += kTile)
      out.push_back({x, y, std::min(kTile, c.width - x), std::min(kTile, c.height - y)});
  return out;
}

}  // namespace

SteeredSession::SteeredSession(const SteeredSessionConfig& config, DirectScene& scene)
    : config_(config),
      scene_(scene),
      packer_(packer_config(config.plan), kEpoch),
      planner_(config.plan),
      renderer_(viewer::make_cpu_renderer(config.plan.threads)) {
  cache_.begin_replica(config.plan.model, kEpoch);
  if (config.steering) packer_.watch(&planner_);
}

Result<ViewCost> SteeredSession::view(double t_s, const geometry::Camera& camera, double footprint,
                                      const image::DepthImage* whole) {
  footprint_ = footprint;
  ViewCost cost;
  cost.t_s = t_s;
  cost.rays_full = pixels(camera);
  cost.still = request_.camera == camera && frames_ > 0;
  exhausted_ = !config_.steering;  // as the master: until the next request
  request_.frame = cost.frame = FrameId{++frames_};
  request_.epoch = kEpoch;
  request_.viewer = kViewer;
  request_.request = request_.request.next();
  request_.camera = camera;
  request_.extra = false, request_.round = 0, request_.most_rays = 0;
  request_.still = cost.still;
  request_.tile_size = kTile;
  const wire::Plan first = plan(t_s, cost);
  cost.full = first.full;
  if (whole) find_needed(camera, *whole);
  cast_.reset(camera.width, camera.height);
  if (const Status s = sample_frame(first, t_s, cost); !s) return s.error();
  if (whole) audit(cost);
  finish(cost);
  return cost;
}

Result<ViewCost> SteeredSession::extra(double t_s, uint64_t most_rays) {
  ViewCost cost;
  cost.t_s = t_s;
  request_.frame = cost.frame = FrameId{++frames_};
  request_.extra = true;
  request_.round = round_++;
  request_.most_rays = most_rays;
  const wire::Plan more = plan(t_s, cost);
  exhausted_ = more.tiles.empty();
  if (!exhausted_)
    if (const Status s = sample_frame(more, t_s, cost); !s) return s.error();
  finish(cost);
  return cost;
}

void SteeredSession::finish(ViewCost& cost) {
  cost.points = packer_.model().points();
  rays_ += double(cost.rays), sampling_s_ += (cost.sample_cpu_ms + cost.encode_cpu_ms) * 1e-3;
  cache_.summarise(~size_t{0});
  cache_.free_dropped();
}

wire::Plan SteeredSession::plan(double now_s, ViewCost& cost) {
  wire::Plan out;
  out.frame = request_.frame, out.epoch = request_.epoch, out.camera = request_.camera;
  out.full = true;
  if (!config_.steering) return out;
  const double begin_s = monotonic_s();
  out = planner_.plan(packer_.model(), packer_.sequence(), request_, now_s);
  cost.plan_ms += (monotonic_s() - begin_s) * 1e3;
  for (const auto& [name, value] : out.figures) cost.figures[name] += value;
  return out;
}

Status SteeredSession::sample_frame(const wire::Plan& plan, double now_s, ViewCost& cost) {
  packer::SampledTile tile;
  tile.frame = request_.frame, tile.epoch = kEpoch, tile.viewer = kViewer, tile.request = request_.request;
  tile.camera = plan.camera, tile.extra = request_.extra;
  if (plan.full) {
    const auto rects = whole_tiles(plan.camera);
    tile.tiles_in_frame = uint32_t(rects.size());
    for (const geometry::Rect& rect : rects) {
      tile.rect = rect;
      if (const Status s = sample_tile(tile, nullptr, now_s, cost); !s) return s;
      ++tile.tile;
    }
    return ok_status();
  }
  if (plan.tiles.empty() && !request_.extra) {
    const auto event = packer_.complete_empty(std::move(tile), now_s);
    return event ? ok_status() : Status(event.error());
  }
  size_t words = 0;
  tile.tiles_in_frame = uint32_t(plan.tiles.size() / wire::kPlanNumbers);
  for (size_t i = 0; i < plan.tiles.size(); i += wire::kPlanNumbers) {
    const uint32_t* n = plan.tiles.data() + i;
    tile.rect = {int(n[0]), int(n[1]), int(n[2]), int(n[3])};
    std::optional<image::PixelMask> mask;
    if (n[5] > 0) {
      auto decoded = codec::decode_mask({plan.masks.data() + words, n[5]}, tile.rect.width, tile.rect.height);
      if (!decoded) return decoded.error();
      mask = std::move(*decoded);
      words += n[5];
    }
    if (const Status s = sample_tile(tile, mask ? &*mask : nullptr, now_s, cost); !s) return s;
    ++tile.tile;
  }
  cost.mask_bytes += 4 * words;
  return ok_status();
}

Status SteeredSession::sample_tile(packer::SampledTile tile, const image::PixelMask* mask, double now_s,
                                   ViewCost& cost) {
  const double footprint_px = footprint_ > 0 ? footprint_ * tile.camera.focal_x() : 1;
  auto sampled = timed(cost.sample_cpu_ms,
                       [&] { return scene_.sample_tile(tile.camera, tile.rect, mask, tile.epoch, footprint_px); });
  if (!sampled) return sampled.error();
  cost.rays += mask ? mask->count() : uint64_t(tile.rect.width) * uint64_t(tile.rect.height);
  if (!tile.extra) note_cast(tile.rect, mask);
  const auto stream = timed(cost.encode_cpu_ms, [&] { return codec::encode(*sampled); });
  cost.bytes += stream.size();
  ++cost.tiles;
  auto decoded = timed(cost.pack_cpu_ms, [&] { return codec::decode(stream); });
  if (!decoded) return decoded.error();
  tile.image = std::move(*decoded);
  auto event = timed(cost.pack_cpu_ms, [&] {
    if (!config_.steering) return packer_.submit(std::move(tile), now_s);
    planner_.take(tile, mask == nullptr, now_s);
    tile.missed = planner_.missed(tile);
    const auto reference = planner_.reference(tile);
    return packer_.submit(std::move(tile), now_s, {}, {}, reference);
  });
  if (!event) return event.error();
  if (*event)
    if (const Status s = insert(**event, cost); !s) return s;
  if (config_.steering) forget();
  return ok_status();
}

double SteeredSession::settle() {
  double ms = 0;
  return timed(ms, [&] { return planner_.settle(); }) ? std::max(ms, 1e-3) : 0;
}

// What is disproved, and what a head left behind.
void SteeredSession::forget() {
  for (const auto& events : {packer_.forget(planner_.disproved()), packer_.forget_superseded()})
    for (const packer::Event& event : events) cache_.forget(event.sequence, event.clusters, event.frames);
}

void SteeredSession::note_cast(const geometry::Rect& rect, const image::PixelMask* mask) {
  for (int y = 0; y < rect.height; ++y)
    for (int x = 0; x < rect.width; ++x)
      if (!mask || mask->at(x, y)) cast_.set(rect.x + x, rect.y + y);
}

Status SteeredSession::insert(const packer::Event& event, ViewCost& cost) {
  cost.samples += event.samples, cost.kept += event.kept,
      cost.sent_bytes += event.blob->size() + 4 * event.missed.size();
  if (!event.is_told()) return ok_status();
  return timed(cost.insert_cpu_ms, [&]() -> Status {
    auto decoded = codec::decode(*event.blob);
    if (!decoded) return decoded.error();
    if (!event.missed.empty()) {
      const auto missed = codec::decode_mask(event.missed, event.missed_rect.width, event.missed_rect.height);
      if (!missed) return missed.error();
      fine_rays_.add({kEpoch, event.camera, event.missed_rect, &*missed, event.rect, &*decoded});
    }
    cache_.insert(
        points::prepare_patch(cache_.config(), event.sequence, event.camera, event.rect, *decoded, event.tag()),
        kEpoch);
    return ok_status();
  });
}

void SteeredSession::find_needed(const geometry::Camera& camera, const image::DepthImage& whole) {
  std::vector<float> reference_m;
  splat::render_reference_depth(packer_.model(), camera, config_.plan.threads, reference_m);
  image::DepthImage lacked = whole;
  splat::eliminate_redundancy(camera, {0, 0, camera.width, camera.height}, reference_m, config_.plan.relative_epsilon,
                              lacked, config_.plan.nearest_sample);
  needed_.reset(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x)
      if (lacked.depth[size_t(y) * camera.width + x] != 0) needed_.set(x, y);
}

void SteeredSession::audit(ViewCost& cost) const {
  cost.needed = needed_.count();
  for (int y = 0; y < cast_.height(); ++y)
    for (size_t w = 0; w < cast_.words_per_row(); ++w) {
      const uint64_t cast = cast_.row(y)[w], needed = needed_.row(y)[w];
      cost.missed += uint64_t(std::popcount(needed & ~cast));
      cost.vain += uint64_t(std::popcount(cast & ~needed));
    }
}

const image::View& SteeredSession::draw(const geometry::Camera& camera, bool refined) {
  frame_.width = camera.width, frame_.height = camera.height;
  frame_.colour.resize(pixels(camera));
  frame_.depth_m.resize(pixels(camera));
  splat::SelectionOptions selection;
  selection.scale = splat::suitable_scale(config_.render.kernel);
  const image::Shading shading(image::ShadingParameters{}, camera);
  // A summary that is wanted is made before the next frame: a display draws all the time.
  for (int pass = 0; pass < 2; ++pass) {
    cache_.select(camera, selection, list_);
    if (pass == 1)
      renderer_->render(list_, camera, config_.render, shading,
                        {camera.width, camera.height, frame_.colour.data(), frame_.depth_m.data()});
    cache_.end_frame();
    cache_.summarise(~size_t{0});
  }
  if (refined) refine(camera, selection, shading);
  for (uint32_t& c : frame_.colour) c &= 0xffffff;
  return frame_;
}

// As displays do it, all tiles at once.
void SteeredSession::refine(const geometry::Camera& camera, const splat::SelectionOptions& selection,
                            const image::Shading& shading) {
  viewer::Supersampler supersampler(*renderer_, kSubPixels);
  const auto select = [&](const geometry::Camera& c, const splat::SelectionOptions& o, splat::DrawList& list) {
    cache_.select(c, o, list);
  };
  viewer::StillPicture picture;
  picture.begin(camera);
  while (const auto tile = picture.next(0)) {
    const bool drawn = supersampler.draw({select, selection, config_.render, shading, &fine_rays_}, camera,
                                         picture.rect(*tile), picture.pixels(*tile), size_t(camera.width));
    cache_.end_frame();
    picture.done(*tile, drawn, 0);
  }
  picture.put_over(frame_);
}

}  // namespace telesplat::launcher
