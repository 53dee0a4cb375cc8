#include "services/packer/points/link_meter.h"

#include <algorithm>
#include <cmath>

namespace telesplat::packer {

void LinkMeter::published(Sequence sequence, uint64_t bytes, double now_s) {
  bytes_ += bytes;
  published_.push_back({sequence, bytes_, now_s});
  if (published_.size() <= kMostRemembered) return;
  forgotten_bytes_ = published_.front().bytes_so_far;
  published_.pop_front();
}

// Returns the newest remembered event that is not newer than `sequence`.
std::deque<LinkMeter::Published>::const_iterator LinkMeter::find(Sequence sequence) const {
  const auto after = std::upper_bound(published_.begin(), published_.end(), sequence,
                                      [](Sequence s, const Published& p) { return s < p.sequence; });
  return after == published_.begin() ? published_.end() : std::prev(after);
}

double LinkMeter::Viewer::rtt_s() const {
  if (least_rtt_s == 0 || least_before_s == 0) return std::max(least_rtt_s, least_before_s);
  return std::min(least_rtt_s, least_before_s);
}

void LinkMeter::learn_rtt(Viewer& v, double rtt_s, double now_s) {
  if (now_s - v.window_from_s > kRttWindow_s) {
    v.least_before_s = v.least_rtt_s;
    v.least_rtt_s = 0;
    v.window_from_s = now_s;
  }
  if (rtt_s > 0) v.least_rtt_s = v.least_rtt_s == 0 ? rtt_s : std::min(v.least_rtt_s, rtt_s);
}

// From one receipt to the next the link was busy if the newest event that arrived in between had been published before
// the earlier receipt was given: then this event, and all before it, waited for the link or were on it. Times in which
// the link was idle say nothing about its rate.
void LinkMeter::learn_rate(Viewer& v, const Receipt& now, double published_s) {
  const double span_s = now.viewer_s - v.last.viewer_s;
  const uint64_t bytes = now.bytes_so_far - v.last.bytes_so_far;
  if (span_s <= 0 || span_s > kSilence_s || bytes < kLeastBusyBytes || published_s > v.last.arrived_s - v.rtt_s())
    return;
  const double keep = std::exp(-span_s / kRateWindow_s);
  v.busy_bytes = keep * v.busy_bytes + double(bytes);
  v.busy_s = keep * v.busy_s + span_s;
}

void LinkMeter::received(InstanceId viewer, Sequence newest, double viewer_s, double now_s) {
  // A model without events, such as another data set's, leaves no viewer behind; its receipts count, too.
  const Sequence last = published_.empty() ? Sequence{} : published_.back().sequence;
  if (newest > last || !std::isfinite(viewer_s)) return;
  const auto event = find(newest);  // end(): the viewer has no event that is remembered
  const Receipt receipt{newest, event == published_.end() ? forgotten_bytes_ : event->bytes_so_far, viewer_s, now_s};
  const double rtt_s = event == published_.end() ? 0 : now_s - event->at_s;
  auto known = viewers_.find(viewer);
  if (known == viewers_.end()) {
    if (viewers_.size() >= kMostViewers) return;
    known = viewers_.emplace(viewer, Viewer{.window_from_s = now_s}).first;
    known->second.last = receipt;
    known->second.moved_s = now_s;
    const auto replay = std::ranges::find(replays_, viewer, [](const auto& r) { return r.first; });
    if (replay != replays_.end()) {
      known->second.replayed_until = replay->second;
      replays_.erase(replay);
    }
    if (newest >= known->second.replayed_until) learn_rtt(known->second, rtt_s, now_s);
    return;
  }
  Viewer& v = known->second;
  if (newest > v.last.newest) {
    // Receipts during a replay, and the first one after it, measure nothing.
    if (v.last.newest >= v.replayed_until) {
      learn_rtt(v, rtt_s, now_s);
      learn_rate(v, receipt, now_s - rtt_s);
    }
    v.last = receipt;
    v.moved_s = now_s;
  } else if (newest == v.last.newest) {
    // No event came meanwhile: the next interval starts here.
    v.last.viewer_s = viewer_s;
    v.last.arrived_s = now_s;
  }
}

void LinkMeter::replayed(InstanceId viewer) {
  if (published_.empty()) return;
  const Sequence until = published_.back().sequence;
  if (const auto known = viewers_.find(viewer); known != viewers_.end()) {
    known->second.replayed_until = until;
    return;
  }
  std::erase_if(replays_, [&](const auto& r) { return r.first == viewer; });
  if (replays_.size() >= kMostViewers) replays_.pop_front();  // its viewer most likely never sends a receipt
  replays_.emplace_back(viewer, until);
}

void LinkMeter::expire(double now_s) {
  std::erase_if(viewers_, [&](const auto& v) { return now_s - v.second.last.arrived_s > kSilence_s; });
}

void LinkMeter::clear() {
  published_.clear();
  viewers_.clear();
  replays_.clear();
  bytes_ = forgotten_bytes_ = 0;
}

double LinkMeter::slowest_bytes_s() const {
  double out = 0;
  for (const auto& [id, v] : viewers_)
    if (v.busy_s >= kBusyEnough_s && (out == 0 || v.busy_bytes / v.busy_s < out)) out = v.busy_bytes / v.busy_s;
  return out;
}

bool LinkMeter::all_free(double most_s, uint64_t least, double now_s) const {
  return std::all_of(viewers_.begin(), viewers_.end(), [&](const auto& v) {
    const auto f = figures(v.first, now_s);
    return !f || f->backlog_bytes <= std::max(least, static_cast<uint64_t>(most_s * f->rate_bytes_s));
  });
}

std::optional<LinkFigures> LinkMeter::figures(InstanceId viewer, double now_s) const {
  const auto found = viewers_.find(viewer);
  if (found == viewers_.end()) return std::nullopt;
  const Viewer& v = found->second;
  LinkFigures out{.backlog_bytes = bytes_ - v.last.bytes_so_far, .rtt_s = v.rtt_s()};
  if (v.busy_s > 0) out.rate_bytes_s = v.busy_bytes / v.busy_s;
  const auto oldest = std::upper_bound(published_.begin(), published_.end(), v.last.newest,
                                       [](Sequence s, const Published& p) { return s < p.sequence; });
  if (oldest != published_.end()) out.oldest_s = std::max(0.0, now_s - std::max(oldest->at_s, v.moved_s));
  return out;
}

}  // namespace telesplat::packer
