#include "services/master/view_queue.h"

#include <algorithm>

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
  // A viewer that was asynchronous waits for nothing that it asked for before.
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

}  // namespace telesplat::master
