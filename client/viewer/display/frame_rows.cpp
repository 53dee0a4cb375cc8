#include "client/viewer/display/frame_rows.h"

#include <cmath>
#include <utility>

namespace telesplat::viewer {

constexpr double kPicturePeriod_s = 2.5;

void FrameRows::add(const MeasuredFrame& m, double to_master_s) {
  flush();
  row_ = m;
  if (!wall_) flush();
  if (m.wait_s > 0) spans_.add("wait for update", m.begin_s - m.wait_s + to_master_s, m.begin_s + to_master_s, 0);
  const uint64_t shown = m.drawn.update.request.value;
  spans_.add("display frame", m.begin_s + to_master_s, m.end_s + to_master_s, 0,
             {.request = shown ? double(shown) : -1});
}

void FrameRows::note_skew(uint64_t wall_frame, double skew_s) {
  if (row_ && wall_frame > 0 && wall_frame == row_->swap.frame) row_->swap.skew_s = skew_s;
}

void FrameRows::flush() {
  if (row_) frames_.add(frame_row(*row_));
  row_.reset();
}

uint32_t KeptFrames::use_of(uint64_t number, double t_s, bool last) const {
  if (!spool_) return 0;
  uint32_t use = 0;
  if (o_.kept.picture_every ? number % o_.kept.picture_every == 0 : t_s >= next_picture_s_ || last)
    use |= o_.kept.exr ? kPicture | kExr : kPicture;
  if (o_.transparent && (use & kPicture)) use |= kTransparent;
  if (o_.kept.verify_every && (number % o_.kept.verify_every < o_.kept.verify_row || last)) use |= kVerify;
  return use;
}

void KeptFrames::on_picture(double t_s) {
  next_picture_s_ = (std::floor(t_s / kPicturePeriod_s) + 1) * kPicturePeriod_s;
}

// A picture that stands needs no refresh.
void FrameClock::seen(MeasuredFrame& m, double now_s, double refresh_s) {
  m.seen = {.at_s = now_s, .refresh_s = refresh_s};
  if (!m.drawn.still) m.seen.missed = refreshes_missed(seen_s_, now_s, refresh_s);
  seen_before_s_ = std::exchange(seen_s_, now_s);
}

double FrameClock::next_s(double begin_s, double target_fps) {
  const double period_s = 1.0 / target_fps;
  due_s_ = begin_s - due_s_ < period_s ? due_s_ + period_s : begin_s + period_s;
  return due_s_;
}

}  // namespace telesplat::viewer
