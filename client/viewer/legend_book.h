// The legends of a session's epochs: frames of an epoch show its own, however soon the next one begins.
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
  /// The session as its master tells of it now.
  void follow(const wire::Welcome& session);
  /// The legend of this epoch, else of the newest one before it; null: there is nothing to tell.
  std::shared_ptr<const image::Legend> at(EpochId epoch) const;

 private:
  struct Page {
    EpochId epoch;
    std::string told;  // the facts that it was made from
    std::shared_ptr<const image::Legend> legend;
  };
  mutable std::mutex mutex_;
  std::deque<Page> pages_;  // epochs ascend
};

}  // namespace telesplat::viewer
