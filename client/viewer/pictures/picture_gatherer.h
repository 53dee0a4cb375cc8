// Puts the tiles of pictures together, decoded. Of several pictures the newest wins: what is older than one that is
// complete is not decoded any more. No sockets, no clocks.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <set>

#include "common/image/file.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// A complete picture.
struct ShownPicture {
  EpochId epoch;
  FrameId frame;
  RequestId request;
  geometry::Camera camera;
  image::View view;  ///< without depth
};

class PictureGatherer {
 public:
  static constexpr size_t kMostOpen = wire::kMaxBuffers;  ///< pictures that lack tiles; of more the oldest goes
  static constexpr int64_t kMaxPixels = 1 << 26;          ///< of a picture: a few bytes may claim many

  /// The picture, if this tile completes it; nothing: it lacks tiles yet, or is older than one that was complete.
  /// Error: what is wrong with the tile, which is dropped. Bytes come from outside.
  Result<std::shared_ptr<const ShownPicture>> add(const wire::Picture& tile);
  /// Requests, frames and epochs begin anew.
  void clear() { open_.clear(), newest_ = {}; }

 private:
  struct Open {
    std::shared_ptr<ShownPicture> picture;
    uint64_t tiles = 0;  // that it has when it is complete
    std::set<uint64_t> here;
  };
  Open& open(const wire::Picture& tile);

  std::deque<Open> open_;  // the oldest first
  RequestId newest_;       // that is complete
};

}  // namespace telesplat::viewer
