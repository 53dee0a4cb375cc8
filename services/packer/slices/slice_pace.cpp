#include "services/packer/slices/slice_pace.h"

namespace telesplat::packer {

void SlicePace::sent(FrameId frame, uint64_t bytes, double now_s) {
  under_way_.push_back({frame, bytes, now_s, frame <= newest_});
  newest_ = std::max(newest_, frame);
  if (wished_ > 0) wish_s_ = std::max(wish_s_, now_s) + static_cast<double>(bytes) / wished_;
}

// A frame that followed another one closely took the link from the end of that one on; any other one also took a round
// trip, so that what it tells is no more than the link carries.
void SlicePace::acknowledged(FrameId frame, double now_s) {
  const auto found =
      std::find_if(under_way_.begin(), under_way_.end(), [&](const Sent& s) { return s.frame == frame; });
  if (found == under_way_.end()) return;
  const double took_s = now_s - std::max(found->sent_s, last_s_);
  const auto bytes = static_cast<double>(found->bytes);
  const bool tells = !found->again && took_s >= kLeast_s;
  under_way_.erase(found);
  last_s_ = now_s;
  if (!tells) return;
  if (now_s - window_s_ > kWindow_s) before_ = most_, most_ = 0, window_s_ = now_s;
  most_ = std::max(most_, bytes / took_s);
}

double SlicePace::link_free_s() const {
  const double rate = rate_bytes_s();
  if (under_way_.empty() || rate <= 0) return 0;
  double bytes = 0;
  for (const Sent& s : under_way_) bytes += static_cast<double>(s.bytes);
  const double needs_s = bytes / rate;
  return needs_s < kShort_s ? 0 : std::max(under_way_.front().sent_s, last_s_) + kShare * needs_s;
}

}  // namespace telesplat::packer
