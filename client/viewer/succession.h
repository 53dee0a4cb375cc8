// Decides which Received the display draws while a session changes between points and slice images, and when it goes on
// to the next one.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "client/viewer/received.h"

namespace telesplat::viewer {

/// The display goes on to a Received once that has its first picture; until then the one before stays on display.
/// Thread-safe.
class Succession {
 public:
  // ---- worker ----
  /// Adds the session's next Received. If the one before has no picture yet, it is dropped.
  void begin(std::shared_ptr<Received> next);
  /// The newest Received has its first complete update, the answer to this request. Later calls change nothing.
  void on_update(RequestId request);
  /// Destroys Receiveds that were dropped and that no thread holds. Takes milliseconds: not for the display's thread.
  void free_dropped();

  // ---- display thread ----
  /// Returns the Received to draw frames from that show the update of this request; kNewest: the newest that has a
  /// picture. Drops those before it. While none has a picture, returns the oldest. Null before the first begin().
  std::shared_ptr<Received> at(RequestId request);
  static constexpr RequestId kNewest{~uint64_t{0}};

 private:
  struct Entry {
    std::shared_ptr<Received> received;
    std::optional<RequestId> first;  // request of its first picture; requests are numbered in their order
  };
  std::mutex mutex_;
  std::deque<Entry> entries_;  // oldest first; all but the last have a picture
  std::vector<std::shared_ptr<Received>> dropped_;
};

}  // namespace telesplat::viewer
