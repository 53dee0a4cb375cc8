// Where a session changes between points and slice images: which Received the display draws, and when it goes on to the
// next one.
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
  /// The session goes on with this one. One that has no picture yet is passed over.
  void begin(std::shared_ptr<Received> next);
  /// The newest has a complete update that may be displayed, the answer to this request. Later calls change nothing.
  void on_update(RequestId request);
  /// Destroys those that nobody holds any more, outside the display's thread: to free a model takes milliseconds.
  void free_dropped();

  // ---- display thread ----
  /// What frames are drawn from that show the update of this request; kNewest: the newest that has a picture. Those
  /// before it are given up. While none has a picture: the newest. Null before the first.
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
