#include "services/master/slabs/schedule.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "common/core/check.h"

namespace telesplat::master {

namespace {

constexpr double kLeastSilent_s = 0.25;

// Returns a frame without a picture: one pixel that looks past the grid on the plane of one slice in front of the eye.
volume::ShearFrame empty_frame(const volume::Grid& grid, const glm::dvec3& eye_room) {
  volume::ShearFrame out;
  const glm::dvec4 eye = grid.room_to_index() * glm::dvec4(eye_room, 1);
  for (int a = 0; a < 3; ++a) out.eye[a] = std::isfinite(eye[a]) ? std::clamp(eye[a], -1e8, 1e8) : 0.0;
  // The axis along which some slice is farthest away.
  double farthest = -1;
  for (int a = 0; a < 3; ++a)
    for (const int direction : {1, -1}) {
      const double t = direction * ((direction > 0 ? grid.size[size_t(a)] - 1 : 0) - out.eye[a]);
      if (t > farthest) farthest = t, out.axis = a, out.direction = direction;
    }
  const int slice = out.direction > 0 ? grid.size[size_t(out.axis)] - 1 : 0;
  if (farthest < 1) out.eye[out.axis] = slice - out.direction;  // the eye is in the middle of a single voxel
  out.layers = {{slice, slice + 1, double(slice)}};
  // This slope meets the slice beyond the grid's farthest voxel.
  out.u0 = (std::abs(out.eye[out.u()]) + 2.0 * volume::kMaxSide) / out.t(slice);
  out.v0 = (std::abs(out.eye[out.v()]) + 2.0 * volume::kMaxSide) / out.t(slice);
  return out;
}

}  // namespace

volume::ShearFrame plan(const volume::Grid& grid, const std::vector<wire::ViewRequest>& requests, int layers) {
  CHECK(!requests.empty());
  std::vector<geometry::Camera> cameras;
  for (const auto& r : requests) cameras.push_back(r.camera);
  const auto planned = volume::plan_frame(grid, cameras, {.layers = layers});
  if (planned && volume::validate(*planned, grid)) return *planned;
  return empty_frame(grid, cameras[0].pose.position_room);
}

void VolumeSchedule::request_view(const wire::ViewRequest& request) {
  if (WallViews::concerns(request)) walls_.on(request);
  Views::request_view(request);
}

void VolumeSchedule::forget_viewer(InstanceId viewer) {
  walls_.forget(viewer);
  Views::forget_viewer(viewer);
}

bool VolumeSchedule::wait_for_others(InstanceId viewer, double now_s) const {
  const auto waiting = [this](InstanceId of) { return waiting_of(of); };
  const wire::ViewRequest* view = waiting(viewer);
  return view && WallViews::concerns(*view) && !walls_.ready(*view, waiting, now_s);
}

// True if `other` joins the frame of `first`: views of one ask of a wall do, and other views from the same eye.
bool VolumeSchedule::in_one_frame(const wire::ViewRequest& first, const wire::ViewRequest& other) const {
  if (other.viewer == first.viewer) return false;
  if (WallViews::concerns(other)) {
    if (!WallViews::concerns(first) || other.wall != first.wall || other.ask > first.ask) return false;
    if (WallViews::together(first, other)) return true;
  }
  return glm::distance(other.camera.pose.position_room, first.camera.pose.position_room) <= kSameEye_m;
}

bool VolumeSchedule::begin_frame(EpochId epoch, std::shared_ptr<const Partition> partition, bool turns_only,
                                 double now_s) {
  // Frames of one partition become complete in order, since every sampler has a part in each and works in order;
  // frames of two partitions might not.
  if (!partition || (!frames_.empty() && frames_.back().partition != partition)) return false;
  const auto first =
      take_view(turns_only, now_s, InFlight::kAny, [&](InstanceId viewer) { return !wait_for_others(viewer, now_s); });
  if (!first) return false;
  std::vector<wire::ViewRequest> requests{*first};
  for (auto& r :
       take_more([&](const wire::ViewRequest& other) { return in_one_frame(*first, other); }, wire::kMaxViews - 1))
    requests.push_back(std::move(r));
  if (WallViews::concerns(*first)) walls_.begun(requests);
  volume::ShearFrame shear = plan(grid_, requests, layers_);
  const size_t slabs = partition->slabs.size();
  for (wire::ViewRequest& r : requests) r.moments.begun_s = now_s;
  const FrameId id = next_frame();
  begin(id, requests);
  for (const auto& r : requests) spending().spend(r.viewer, double(r.camera.width) * r.camera.height, now_s);
  frames_.push_back(
      {id, epoch, std::move(partition), std::move(shear), std::move(requests), std::vector<SlabState>(slabs)});
  return true;
}

std::optional<wire::SliceLease> VolumeSchedule::lease(const std::string& sampler, double now_s) {
  for (Frame& f : frames_) {
    const auto slab = f.partition->slab_of(sampler);
    if (!slab || f.slabs[*slab].state != SlabState::State::kOpen) continue;
    const LeaseId id = next_lease();
    f.slabs[*slab] = {SlabState::State::kLeased, id, now_s, now_s + lease_time_s()};
    const SlabRange range = f.partition->slabs[*slab].range;
    wire::SliceLease out{.lease = id,
                         .frame = f.id,
                         .epoch = f.epoch,
                         .partition = f.partition->number,
                         .slab = *slab,
                         .slabs = f.slabs.size(),
                         .begin = uint64_t(range.begin),
                         .end = uint64_t(range.end),
                         .shear = f.shear,
                         .views = {},
                         .moments = {.leased_s = now_s}};
    for (const auto& r : f.requests) out.views.push_back({r.viewer, r.request, r.camera, r.buffers, r.moments});
    return out;
  }
  return std::nullopt;
}

void VolumeSchedule::extend(LeaseId lease, const std::string& sampler, double now_s) {
  for (Frame& f : frames_)
    for (size_t i = 0; i < f.slabs.size(); ++i) {
      SlabState& s = f.slabs[i];
      if (s.state != SlabState::State::kLeased || s.lease != lease || f.partition->slabs[i].sampler != sampler)
        continue;
      const double longest_s = std::max(s.leased_s + options().longest_fetch_s, s.expires_s);
      s.expires_s = std::min(now_s + lease_time_s(), longest_s);
    }
}

// Ends the frame: sampled again, its slab would most likely be refused again.
void VolumeSchedule::refused(const wire::TileRefused& m, const std::string& sampler) {
  const auto f = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id == m.frame; });
  if (f == frames_.end() || m.tile >= f->slabs.size()) return;
  const SlabState& slab = f->slabs[size_t(m.tile)];
  if (slab.state != SlabState::State::kLeased || slab.lease != m.lease) return;
  if (f->partition->slabs[size_t(m.tile)].sampler != sampler) return;
  complete(f->id, false);
  walls_.dropped(f->requests);
  frames_.erase(f);
  ++given_up_;
}

bool VolumeSchedule::tile_done(const wire::TileDone& m, double now_s) {
  const auto f = std::find_if(frames_.begin(), frames_.end(), [&](const Frame& frame) { return frame.id == m.frame; });
  if (f == frames_.end() || m.tile >= f->slabs.size()) return false;
  SlabState& slab = f->slabs[size_t(m.tile)];
  if (slab.state != SlabState::State::kLeased || slab.lease != m.lease) return false;
  slab.state = SlabState::State::kDone;
  slab_time_s_.add(now_s - slab.leased_s);
  if (std::all_of(f->slabs.begin(), f->slabs.end(),
                  [](const SlabState& s) { return s.state == SlabState::State::kDone; })) {
    complete(f->id);
    frames_.erase(f);
    patience_ = 1;
  }
  return true;
}

int VolumeSchedule::drop_where(const std::function<bool(const Frame&)>& lost) {
  // With a frame, drop later frames of its viewers that take views in order.
  std::vector<bool> dropped;
  std::set<InstanceId> in_order;
  for (const Frame& f : frames_) {
    dropped.push_back(lost(f) || std::any_of(f.requests.begin(), f.requests.end(),
                                             [&](const auto& r) { return in_order.contains(r.viewer); }));
    for (const auto& r : f.requests)
      if (dropped.back() && r.buffers > 0) in_order.insert(r.viewer);
  }
  int out = 0;
  // Newest first, so that the views wait in the order in which they were asked for.
  for (size_t i = frames_.size(); i-- > 0;) {
    if (!dropped[i]) continue;
    const Frame& f = frames_[i];
    for (const SlabState& s : f.slabs) out += s.state == SlabState::State::kLeased;
    put_back(f.id);
    walls_.dropped(f.requests);
    frames_.erase(frames_.begin() + std::ptrdiff_t(i));
  }
  return out;
}

int VolumeSchedule::expire(double now_s, const std::function<void(const std::string&)>& lost_sampler) {
  int expired = 0;
  std::set<std::string> lost;
  const auto ran_out = [&](const SlabState& s) { return s.state == SlabState::State::kLeased && now_s > s.expires_s; };
  for (const Frame& f : frames_)
    for (size_t i = 0; i < f.slabs.size(); ++i)
      if (ran_out(f.slabs[i])) ++expired, lost.insert(f.partition->slabs[i].sampler);
  if (expired == 0) return 0;
  released_ +=
      uint64_t(drop_where([&](const Frame& f) { return std::any_of(f.slabs.begin(), f.slabs.end(), ran_out); }));
  patience_ *= 2;
  for (const auto& sampler : lost) lost_sampler(sampler);
  return expired;
}

int VolumeSchedule::release_sampler(const std::string& sampler) {
  const int held = int(leases_of(sampler));
  released_ += uint64_t(drop_where([&](const Frame& f) {
    const auto slab = f.partition->slab_of(sampler);
    return slab && f.slabs[*slab].state != SlabState::State::kDone;
  }));
  return held;
}

void VolumeSchedule::drop_frames() {
  drop_where([](const Frame&) { return true; });
}

size_t VolumeSchedule::leases_of(const std::string& sampler) const {
  size_t out = 0;
  for (const Frame& f : frames_)
    if (const auto slab = f.partition->slab_of(sampler)) out += f.slabs[*slab].state == SlabState::State::kLeased;
  return out;
}

std::vector<std::string> VolumeSchedule::overdue(double now_s) const {
  std::vector<std::string> out;
  if (!slab_time_s_.known()) return out;
  const double after_s = std::max(kLeastSilent_s, 3 * slab_time_s_.value());
  for (const Frame& f : frames_)
    for (size_t i = 0; i < f.slabs.size(); ++i)
      if (f.slabs[i].state == SlabState::State::kLeased && now_s - f.slabs[i].leased_s > after_s)
        out.push_back(f.partition->slabs[i].sampler);
  return out;
}

double VolumeSchedule::lease_time_s() const {
  const double usual_s = std::max(options().lease_timeout_s, 4 * slab_time_s_.value());
  return std::min(usual_s * patience_, std::max(kLongestLease_s, options().lease_timeout_s));
}

namespace {

constexpr size_t kMaxWallsWaiting = 64;  // views of further walls are sampled as they come

}  // namespace

void WallViews::on(const wire::ViewRequest& view) {
  const double now_s = view.moments.received_s;
  if (walls_.size() >= kMaxWallsWaiting && !walls_.contains(view.wall)) return;
  const auto [place, fresh] = walls_.try_emplace(view.wall);
  Wall& wall = place->second;
  if (fresh) wall.first_s = wall.since_s = now_s, wall.ask = view.ask;
  wall.viewers = view.wall_viewers;
  // A viewer that comes while the others have frames does not know yet what they ask for.
  Member& member = wall.members.try_emplace(view.viewer, Member{.waited_for = !wall.under_way}).first->second;
  if (!member.since_s) member.since_s = now_s;
  // Views from viewers' own heads (ask 0) belong together until there are views of one head.
  const bool next = view.ask > wall.ask || (view.ask == 0 && wall.ask == 0 && wall.begun);
  if (!next) return;
  wall.ask = view.ask;
  wall.since_s = now_s;
  wall.begun = false;
}

void WallViews::forget(InstanceId viewer) {
  for (auto& [name, wall] : walls_) wall.members.erase(viewer);
  std::erase_if(walls_, [](const auto& w) { return w.second.members.empty(); });
}

bool WallViews::ready(const wire::ViewRequest& view, const Waiting& waiting, double now_s) const {
  const auto found = walls_.find(view.wall);
  if (found == walls_.end()) return true;
  const Wall& wall = found->second;
  if (wall.begun || view.ask != wall.ask) {
    const auto own = wall.members.find(view.viewer);
    return own == wall.members.end() || now_s >= own->second.since_s.value_or(now_s) + kLeftOver_s;
  }
  if (wall.members.size() < wall.viewers && now_s < wall.first_s + kGather_s) return false;
  if (now_s >= wall.since_s + kTogether_s) return true;
  return std::all_of(wall.members.begin(), wall.members.end(), [&](const auto& m) {
    const wire::ViewRequest* own = waiting(m.first);
    return !m.second.waited_for || (own && own->wall == view.wall && own->ask == wall.ask);
  });
}

void WallViews::begun(const std::vector<wire::ViewRequest>& views) {
  const auto found = walls_.find(views.front().wall);
  if (found == walls_.end()) return;
  Wall& wall = found->second;
  for (const auto& v : views)
    if (const auto m = wall.members.find(v.viewer); m != wall.members.end()) m->second.since_s.reset();
  if (wall.begun || wall.ask != views.front().ask) return;
  wall.begun = wall.under_way = true;
  for (auto& [viewer, member] : wall.members) {
    const bool in_time =
        std::any_of(views.begin(), views.end(), [&name = viewer](const auto& v) { return v.viewer == name; });
    member.in_time = in_time ? member.in_time + 1 : 0;
    member.waited_for = in_time && (member.waited_for || member.in_time >= kInTime);
  }
}

void WallViews::dropped(const std::vector<wire::ViewRequest>& views) {
  for (const auto& v : views)
    if (const auto found = walls_.find(v.wall); found != walls_.end() && found->second.ask == v.ask)
      found->second.begun = false;
}

}  // namespace telesplat::master
