#include "client/viewer/coupling/stall_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace telesplat::viewer {

bool StallWatch::waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling) {
  if (!since_s_) since_s_ = begin_s;
  if (!told_ && now_s - *since_s_ >= kLong_s) {
    told_ = true;
    news_ = fmt::format(
        "no view update for {:.1f} s ({}): the picture stays; requests are sent again every {:.0f} s, and {:.0f} s "
        "after the last sign of an answer frames are drawn from what is there",
        now_s - *since_s_, coupling_text(coupling), Coupling::kPatience_s, most_s_);
  }
  if (!draws_ && now_s - std::max(*since_s_, last_sign_s) >= most_s_) {
    draws_ = true;
    news_ = fmt::format("no view update for {:.1f} s: frames are drawn from what is there until one comes",
                        now_s - *since_s_);
  }
  return draws_;
}

void StallWatch::over(double now_s) {
  if (told_) news_ = fmt::format("the display goes on, after {:.1f} s without a view update", now_s - *since_s_);
  since_s_.reset();
  told_ = draws_ = false;
}

std::optional<std::string> StallWatch::take_news() { return std::exchange(news_, std::nullopt); }

}  // namespace telesplat::viewer
