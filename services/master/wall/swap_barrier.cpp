#include "services/master/wall/swap_barrier.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace telesplat::master {
namespace {

constexpr size_t kFramesRemembered = 8;  // frames kept until all viewers report their presentation
constexpr double kPeriodShare = 0.1;     // share of the newest frame in between_s_
constexpr double kSourcePatience_s = 1;  // until the wall shows another packer's model without a viewer that lacks it
constexpr uint64_t kMostFirstFrame = uint64_t{1} << 52;  // wire::check() refuses 2^53 and more
constexpr double kLeadGrows = 0.5, kLeadShrinks = 0.99;

// Bit n of a mask of frames is the frame n before the newest. Returns the mask of the same frames for
// another newest one.
uint64_t seen_from(uint64_t newest, const wire::ShownState& state) {
  const uint64_t earlier = newest > state.newest ? newest - state.newest : 0;
  const uint64_t later = state.newest > newest ? state.newest - newest : 0;
  if (earlier > 63 || later > 63) return 0;
  return later > 0 ? state.held >> later : state.held << earlier;
}

}  // namespace

double SwapBarrier::frame_s() const {
  double period_s = 1e-3;
  for (const auto& [id, m] : members_) period_s = std::max(period_s, m.said.period_s);
  return std::min(std::max(period_s, between_s_), kMostFrame_s);
}

// Time at which ready viewers have waited one frame longer than to the end of their last frame.
double SwapBarrier::deadline_s() const {
  double period_s = 0;
  for (const auto& [id, m] : members_) period_s = std::max(period_s, m.said.period_s);
  return std::max(ready_s_, last_.at_s + std::min(period_s, kMostFrame_s)) + frame_s();
}

bool SwapBarrier::gathered(double now_s) const {
  if (now_s >= first_s_ + kGather_s) return true;
  return std::all_of(members_.begin(), members_.end(),
                     [&](const auto& m) { return members_.size() >= m.second.said.viewers; });
}

// True if no viewer is waited for any more. If all were late, so that no viewer is waited_for, all must be ready.
bool SwapBarrier::complete() const {
  const bool any = std::any_of(members_.begin(), members_.end(), [](const auto& m) { return m.second.waited_for; });
  return std::all_of(members_.begin(), members_.end(),
                     [&](const auto& m) { return m.second.ready || (any && !m.second.waited_for); });
}

void SwapBarrier::note_presented(const wire::SwapReady& m) {
  // Ignore frames that were not due yet, and those too old to remember.
  if (m.presented == 0 || m.presented >= frame_ || m.presented + kFramesRemembered < frame_) return;
  const auto before = members_.find(m.viewer);
  if (before != members_.end() && before->second.said.presented == m.presented) return;  // reported again
  Presented& p = presented_[m.presented];
  p.first_s = p.viewers == 0 ? m.presented_s : std::min(p.first_s, m.presented_s);
  p.last_s = p.viewers == 0 ? m.presented_s : std::max(p.last_s, m.presented_s);
  ++p.viewers;
  while (presented_.size() > kFramesRemembered) presented_.erase(presented_.begin());
}

void SwapBarrier::on(const std::string& peer, const wire::SwapReady& m, double now_s) {
  if (members_.empty()) first_s_ = now_s, begun_ = false;
  // A restarted viewer takes the place of the old one with its number.
  std::erase_if(members_, [&](const auto& o) { return o.first != m.viewer && o.second.said.number == m.number; });
  note_presented(m);
  const auto [place, fresh] = members_.try_emplace(m.viewer);
  Member& member = place->second;
  const bool again = !fresh && member.said.frame == m.frame;  // it got no answer
  member.peer = peer;
  member.said = m;
  if (fresh) member.waited_for = !begun_;
  lead_s_ = m.late_s > 0 ? std::min(lead_s_ + kLeadGrows * m.late_s, kMostLead_s) : lead_s_;
  if (begun_ && m.frame < frame_) {
    // It is late, or new: it goes on with the others. If they could have waited that long, it counts as in time.
    const bool little = !again && m.frame == last_.frame && now_s <= deadline_before_s_;
    note_pace(member, m.frame, little);
    if (fresh || again || member.told < last_.frame) tell(member, last_);
    return go_on(now_s);
  }
  if (!std::exchange(member.ready, true)) ready_s_ = now_s;
  go_on(now_s);
}

// Notes whether a viewer was in time for this frame; one that was so for kInTime frames is waited for again.
void SwapBarrier::note_pace(Member& member, uint64_t frame, bool in_time) {
  if (member.waited_for) return;
  const bool next = member.in_time_for + 1 == frame;  // else it was absent meanwhile
  member.in_time = !in_time ? 0 : next ? member.in_time + 1 : 1;
  if (in_time) member.in_time_for = frame;
  member.waited_for = member.in_time >= kInTime;
}

// As forget(), by the viewer's routing id.
void SwapBarrier::unreachable(const std::string& peer, double now_s) {
  if (std::erase_if(members_, [&](const auto& m) { return m.second.peer == peer; }) > 0) go_on(now_s);
}

void SwapBarrier::forget(InstanceId viewer, double now_s) {
  if (members_.erase(viewer) > 0) go_on(now_s);
}

void SwapBarrier::tick(double now_s) { go_on(now_s); }

std::optional<double> SwapBarrier::due_s() const {
  if (members_.empty()) return std::nullopt;
  if (!begun_) return first_s_ + kGather_s;
  const bool any = std::any_of(members_.begin(), members_.end(), [](const auto& m) { return m.second.ready; });
  return any ? std::optional(deadline_s()) : std::nullopt;
}

void SwapBarrier::go_on(double now_s) {
  if (std::none_of(members_.begin(), members_.end(), [](const auto& m) { return m.second.ready; })) return;
  if (!begun_) {
    if (!gathered(now_s)) return;
    begun_ = true;
    // Viewers that another master led have frame numbers already: go on from the highest. Years of frames remain.
    for (const auto& [id, m] : members_)
      if (m.said.frame <= kMostFirstFrame) frame_ = std::max(frame_, m.said.frame);
    return swap(now_s);
  }
  if (complete()) return swap(now_s);
  if (now_s < deadline_s()) return;
  ++figures_.incomplete;
  leave_out_the_late();
  swap(now_s);
}

void SwapBarrier::leave_out_the_late() {
  for (auto& [id, m] : members_)
    if (!m.ready) m.waited_for = false, m.in_time = 0;
}

const SwapBarrier::Member& SwapBarrier::leader() const {
  const auto rank = [](const Member& m) { return std::pair(!m.ready, m.said.number); };
  return std::min_element(members_.begin(), members_.end(),
                          [&](const auto& a, const auto& b) { return rank(a.second) < rank(b.second); })
      ->second;
}

// Returns the state of the viewer with the lowest number among those that have the most common source.
const wire::ShownState& SwapBarrier::first_of_most(const std::vector<const Member*>& members) {
  const auto having = [&](InstanceId source) {
    return std::count_if(members.begin(), members.end(), [&](const auto* m) { return m->said.state.source == source; });
  };
  const auto rank = [&](const Member* m) { return std::pair(-having(m->said.state.source), m->said.number); };
  const auto first = std::min_element(members.begin(), members.end(),
                                      [&](const Member* a, const Member* b) { return rank(a) < rank(b); });
  return (*first)->said.state;
}

// Chooses the newest state that all viewers in time can show. Numbers of one source never fall.
void SwapBarrier::choose_state(double now_s) {
  wire::ShownState& state = last_.state;
  for (auto& [id, m] : members_) {
    if (!m.ready || !m.behind) continue;
    m.caught_up = m.said.state.source == state.source && m.said.state.newest >= state.newest ? m.caught_up + 1 : 0;
    m.behind = m.caught_up < kInTime;
  }
  std::vector<const Member*> counted, ready;
  for (const auto& [id, m] : members_) {
    if (m.ready) ready.push_back(&m);
    if (m.ready && m.waited_for && !m.behind) counted.push_back(&m);
  }
  // A viewer that has received nothing yet does not count, as long as another one has received something.
  const auto empty = [](const Member* m) { return m->said.state.source.value == 0; };
  if (!std::all_of(ready.begin(), ready.end(), empty)) {
    std::erase_if(counted, empty);
    std::erase_if(ready, empty);
  }
  if (counted.empty()) counted = std::move(ready);
  const wire::ShownState& first = first_of_most(counted);
  uint64_t least = std::numeric_limits<uint64_t>::max(), most = 0, replica = least, held = least;
  bool one_source = true;
  for (const Member* m : counted) {
    const wire::ShownState& own = m->said.state;
    one_source = one_source && own.source == first.source;
    if (own.source != first.source) continue;
    least = std::min(least, own.newest), most = std::max(most, own.newest);
    replica = std::min(replica, own.replica);
    held &= seen_from(first.newest, own);
  }
  // Viewers may lack different frames, so not all need have the least of their newest ones: take one that all have.
  if (first.held != 0 && held != 0)
    least = first.newest - uint64_t(std::countr_zero(held));
  else if (first.held != 0 && state.source == first.source)
    least = state.newest;
  if (!one_source) {
    if (source_differs_s_ < 0) source_differs_s_ = now_s;
    if (state.source.value != 0 && now_s - source_differs_s_ < kSourcePatience_s) return;
  } else {
    source_differs_s_ = -1;
  }
  if (state.source != first.source) {
    state = {first.source, least, replica};
    reached_.clear();
  }
  if (reached_.empty() || reached_.back().newest < most) reached_.push_back({now_s, most});
  // A state that a viewer had kModelPatience_s ago is shown, even if others lack it.
  while (!reached_.empty() && reached_.front().at_s <= now_s - kModelPatience_s) {
    if (least < reached_.front().newest) note_behind(least = reached_.front().newest);
    reached_.pop_front();
  }
  state.newest = std::max(state.newest, least);
  state.replica = std::max(state.replica, replica);
}

// Marks viewers that lack state `newest` as behind: the others do not wait for them.
void SwapBarrier::note_behind(uint64_t newest) {
  for (auto& [id, m] : members_)
    if (m.ready && m.said.state.source == last_.state.source && m.said.state.newest < newest)
      m.behind = true, m.caught_up = 0;
}

void SwapBarrier::tell(Member& member, const wire::Swap& swap) {
  member.told = swap.frame;
  outgoing_.push_back({member.peer, swap});
}

void SwapBarrier::swap(double now_s) {
  double period_s = 0;
  for (const auto& [id, m] : members_) period_s = std::max(period_s, m.said.period_s);
  const double before_s = last_.at_s;
  deadline_before_s_ = deadline_s();
  const Member& first = leader();
  last_.master = master_;
  last_.frame = frame_;
  last_.at_s = std::max(now_s + lead_s_, figures_.frames > 0 ? before_s + std::min(period_s, kMostFrame_s) : 0);
  last_.t_s = first.said.t_s;
  last_.head = first.said.head;
  if (first.said.asks) ++last_.ask, last_.ask_head = first.said.ahead;
  choose_state(now_s);
  last_.viewers =
      uint64_t(std::count_if(members_.begin(), members_.end(), [](const auto& m) { return m.second.ready; }));
  if (figures_.frames > 0) {
    const double between_s = std::min(last_.at_s - before_s, kMostFrame_s);
    between_s_ = between_s_ == 0 ? between_s : (1 - kPeriodShare) * between_s_ + kPeriodShare * between_s;
  }
  lead_s_ = std::max(kLead_s, lead_s_ * kLeadShrinks);
  // The frame before: all ready viewers have reported when they presented it.
  if (const auto p = presented_.find(frame_ - 1); frame_ > 0 && p != presented_.end() && p->second.viewers > 1) {
    last_.skew_frame = p->first;
    last_.skew_s = p->second.last_s - p->second.first_s;
  }
  for (auto& [id, m] : members_) {
    if (m.ready) note_pace(m, frame_, true);
    m.ready = false;
    tell(m, last_);
  }
  ++figures_.frames;
  ++frame_;
}

std::vector<SwapBarrier::Outgoing> SwapBarrier::take_outgoing() { return std::exchange(outgoing_, {}); }

}  // namespace telesplat::master
