// The part of the schedule that follows viewers' links: what waits for them, and what has waited too long.
#include <algorithm>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {

bool FrameSchedule::may_lease(const Frame& f, double now_s) const {
  return open(f.request.viewer, now_s) && (!f.extra || gate_.idle(now_s));
}

// What a link would carry for long arrives coarse first, so that there is something to see.
bool FrameSchedule::arrives_coarse(const wire::ViewRequest& view) const {
  if (cut_.coarse) return true;
  const auto pixels = static_cast<double>(view.camera.width) * static_cast<double>(view.camera.height);
  return cut_.coarse_if_slow && gate_.takes_s(view.viewer, pixels).value_or(0) > kCoarseFrom_s;
}

// Nothing is lost by it: what came stays, and the newer view's plan asks for what is still lacking in that view.
bool FrameSchedule::is_overtaken(const Frame& f, double now_s) const {
  if (f.extra || f.step != 1 || f.request.buffers > 0 || open(f.request.viewer, now_s)) return false;
  if (!f.tiles.open() || !f.tiles.whole_blocks() || now_s - f.begun_s < kOvertaken_s) return false;
  const wire::ViewRequest* newer = waiting_of(f.request.viewer);
  if (!newer || newer->camera == f.request.camera) return false;
  return std::none_of(frames_.begin(), frames_.end(), [&](const Frame& coarse) {
    return coarse.step != 1 && coarse.request.viewer == f.request.viewer && coarse.request.request == f.request.request;
  });
}

void FrameSchedule::end_overtaken(double now_s) {
  for (Frame& f : frames_)
    if (is_overtaken(f, now_s)) f.tiles.close();
  end_closed();
}

std::vector<wire::FrameEnd> FrameSchedule::take_ends(double now_s) {
  for (wire::FrameEnd& end : ends_) end.moments.leased_s = now_s;  // what is left out waited until now
  return std::exchange(ends_, {});
}

// A view of another viewer waits, whose link takes more.
bool FrameSchedule::other_waits(InstanceId viewer, double now_s) const {
  return view_waits([&](InstanceId other) { return other != viewer && gate_.open(other, now_s); });
}

// Nothing is put back for the viewer's own sake: its samples would be made, and sent, once more. What is out of such a
// frame still comes; its viewer's requests wait until the link takes more.
void FrameSchedule::put_back_held(double now_s) {
  std::vector<wire::ViewRequest> held;
  for (Frame& f : frames_) {
    if (f.extra || !f.tiles.open() || f.tiles.any_out() || open(f.request.viewer, now_s))
      f.held_from_s = 0;
    else if (f.held_from_s == 0)
      f.held_from_s = now_s;
    else if (f.step == 1 && now_s - f.held_from_s > kHeld_s && other_waits(f.request.viewer, now_s))
      held.push_back(f.request);
  }
  for (const auto& view : held)
    std::erase_if(frames_, [&](const Frame& f) {
      if (f.extra || f.request.viewer != view.viewer || f.request.request != view.request) return false;
      if (f.step == 1) put_back(f.id);
      return true;
    });
}

}  // namespace telesplat::master
