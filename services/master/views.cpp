#include "services/master/views.h"

#include <algorithm>
#include <utility>

#include "common/core/check.h"

namespace telesplat::master {

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
