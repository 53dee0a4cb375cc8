#include "services/master/views.h"

#include <algorithm>
#include <utility>

#include "common/core/check.h"

namespace telesplat::master {

size_t views_at_once(int frames_in_flight, uint64_t buffers) {
  return std::max(size_t(frames_in_flight), size_t(std::min(buffers, kBufferedInFlight)));
}

void ViewQueue::add(const wire::ViewRequest& request) {
  auto& requests = viewers_[request.viewer].requests;
  if (request.buffers == 0) {
    requests.assign(1, request);
    return;
  }
  // A viewer that was asynchronous does not want its earlier request any more.
  std::erase_if(requests, [](const wire::ViewRequest& r) { return r.buffers == 0; });
  for (wire::ViewRequest& r : requests)
    if (r.request == request.request) return void(r = request);  // the view wanted now
  if (requests.size() >= std::min(request.buffers, wire::kMaxBuffers)) return;
  requests.push_back(request);
}

void ViewQueue::put_back(const wire::ViewRequest& request) {
  auto& requests = viewers_[request.viewer].requests;
  // A viewer whose newest request is asynchronous waits for nothing older.
  if (requests.empty() || (request.buffers > 0 && requests.back().buffers > 0)) requests.push_front(request);
}

size_t ViewQueue::waiting(InstanceId viewer) const {
  const auto found = viewers_.find(viewer);
  return found == viewers_.end() ? 0 : found->second.requests.size();
}

const wire::ViewRequest* ViewQueue::first(InstanceId viewer) const {
  const auto found = viewers_.find(viewer);
  return found == viewers_.end() ? nullptr : &found->second.requests.front();
}

size_t ViewQueue::waiting() const {
  size_t out = 0;
  for (const auto& [id, v] : viewers_) out += v.requests.size();
  return out;
}

void ViewQueue::begin_turns() {
  for (auto& [id, v] : viewers_) v.turn = true;
}

bool ViewQueue::turn_waiting() const {
  return std::any_of(viewers_.begin(), viewers_.end(), [](const auto& v) { return v.second.turn; });
}

const wire::ViewRequest* ViewQueue::next(bool turns_only, const std::function<bool(InstanceId)>& served,
                                         const std::function<double(InstanceId)>& spent) const {
  const wire::ViewRequest* out = nullptr;
  double least = 0;
  auto v = viewers_.upper_bound(last_);
  for (size_t n = 0; n < viewers_.size(); ++n, ++v) {
    if (v == viewers_.end()) v = viewers_.begin();
    if ((turns_only && !v->second.turn) || !served(v->first)) continue;
    const double rays = spent(v->first);
    if (out && rays >= least) continue;
    out = &v->second.requests.front();
    least = rays;
  }
  return out;
}

wire::ViewRequest ViewQueue::take(InstanceId viewer) {
  const auto v = viewers_.find(viewer);
  CHECK(v != viewers_.end());
  const wire::ViewRequest out = v->second.requests.front();
  v->second.requests.pop_front();
  v->second.turn = false;
  if (v->second.requests.empty()) viewers_.erase(v);
  last_ = viewer;
  return out;
}

std::vector<wire::ViewRequest> ViewQueue::take_all(const std::function<bool(const wire::ViewRequest&)>& wanted,
                                                   size_t most) {
  std::vector<wire::ViewRequest> out;
  const InstanceId last = last_;
  for (auto v = viewers_.begin(); v != viewers_.end() && out.size() < most;) {
    const auto next = std::next(v);
    if (wanted(v->second.requests.front())) out.push_back(take(v->first));
    v = next;
  }
  last_ = last;
  return out;
}

void Views::request_view(const wire::ViewRequest& request) {
  const auto same = [&](const wire::ViewRequest& r) {
    return r.viewer == request.viewer && r.request == request.request;
  };
  if (request.buffers > 0 && std::any_of(in_flight_.begin(), in_flight_.end(), [&](const Begun& f) {
        return std::any_of(f.views.begin(), f.views.end(), same);
      }))
    return;
  waiting_.add(request);
}

void Views::forget_viewer(InstanceId viewer) {
  waiting_.forget(viewer);
  spending_.forget(viewer);
  for (Begun& f : in_flight_)
    if (std::any_of(f.views.begin(), f.views.end(), [&](const auto& v) { return v.viewer == viewer; }))
      f.left.push_back(viewer);
}

void Views::take_over(Views& from) {
  CHECK(from.in_flight_.empty());
  waiting_ = std::exchange(from.waiting_, {});
  spending_ = from.spending_;
  next_frame_ = from.next_frame_, next_lease_ = from.next_lease_;
}

FrameId Views::next_frame() { return std::exchange(next_frame_, next_frame_.next()); }
LeaseId Views::next_lease() { return std::exchange(next_lease_, next_lease_.next()); }

bool Views::another_waits() const {
  return !in_flight_.empty() && view_waits([this](InstanceId viewer) {
    return std::none_of(in_flight_.begin(), in_flight_.end(), [&](const Begun& f) {
      return spending_.person(f.views.front().viewer) == spending_.person(viewer);
    });
  });
}

bool Views::leaves_a_place(InstanceId viewer, uint64_t buffers, double now_s) const {
  if (!spending_.others_ask(viewer, now_s)) return true;
  const auto own = std::count_if(in_flight_.begin(), in_flight_.end(), [&](const Begun& f) {
    return spending_.person(f.views.front().viewer) == spending_.person(viewer);
  });
  return size_t(own) < std::max<size_t>(1, views_at_once(options_.frames_in_flight, buffers) - 1);
}

std::optional<wire::ViewRequest> Views::take_view(bool turns_only, double now_s, InFlight allowed,
                                                  const std::function<bool(InstanceId)>& ready) {
  const auto served = [&](InstanceId viewer) {
    if (ready && !ready(viewer)) return false;
    if (!leaves_a_place(viewer, waiting_.first(viewer)->buffers, now_s)) return false;
    return allowed == InFlight::kAny || std::none_of(in_flight_.begin(), in_flight_.end(), [&](const Begun& f) {
             return std::any_of(f.views.begin(), f.views.end(), [&](const auto& v) { return v.viewer == viewer; });
           });
  };
  const wire::ViewRequest* next =
      waiting_.next(turns_only, served, [&](InstanceId viewer) { return spending_.spent(viewer, now_s); });
  if (!next || views_in_flight() >= views_at_once(options_.frames_in_flight, next->buffers)) return std::nullopt;
  return waiting_.take(next->viewer);
}

void Views::begin(FrameId frame, const std::vector<wire::ViewRequest>& views) {
  in_flight_.push_back({frame, views, {}});
}

std::vector<Views::Begun>::iterator Views::find(FrameId frame) {
  const auto found =
      std::find_if(in_flight_.begin(), in_flight_.end(), [&](const Begun& f) { return f.frame == frame; });
  CHECK(found != in_flight_.end());
  return found;
}

void Views::complete(FrameId frame, bool whole) {
  in_flight_.erase(find(frame));
  completed_ += whole;
}

bool Views::left(FrameId frame) {
  const Begun& f = *find(frame);
  return std::all_of(f.views.begin(), f.views.end(),
                     [&](const auto& v) { return std::find(f.left.begin(), f.left.end(), v.viewer) != f.left.end(); });
}

void Views::put_back(FrameId frame) {
  const auto found = find(frame);
  const Begun dropped = std::move(*found);
  in_flight_.erase(found);
  for (const auto& view : dropped.views)
    if (std::find(dropped.left.begin(), dropped.left.end(), view.viewer) == dropped.left.end()) waiting_.put_back(view);
}

}  // namespace telesplat::master
