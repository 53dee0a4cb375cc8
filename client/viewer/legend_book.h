// Keeps the legends of a session's epochs: frames of an epoch show its own, even when the next one has begun.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <string>

#include "common/image/legend.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// Thread-safe.
class LegendBook {
 public:
  /// Takes the session as its master describes it now.
  void follow(const wire::Welcome& session);
  /// Returns the legend of this epoch, else of the newest one before it; null: there is no legend.
  std::shared_ptr<const image::Legend> at(EpochId epoch) const;

 private:
  struct Page {
    EpochId epoch;
    std::string told;  // facts of the session from which the legend was made
    std::shared_ptr<const image::Legend> legend;
  };
  mutable std::mutex mutex_;
  std::deque<Page> pages_;  // epochs ascend
};

}  // namespace telesplat::viewer
