// Pictures that the servers drew of a session: those that are complete and wait for the display, and the one that is on
// display.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>

#include "client/viewer/display/view_source.h"
#include "client/viewer/received.h"
#include "common/core/log.h"
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

/// Puts the tiles of pictures together, decoded. Of several pictures the newest wins: what is older than one that
/// is complete is not decoded any more. No sockets, no clocks.
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

/// A picture, and the update that it is.
struct DisplayedPicture {
  std::shared_ptr<const ShownPicture> picture;  ///< null: none yet
  ShownUpdate update;
};

/// Shared by the worker, which puts pictures in, and the display. Pictures change hands as pointers.
class PictureShelf {
 public:
  void put(DisplayedPicture picture);
  /// The newest of the pictures up to this request goes on display; those before it are passed over.
  void advance(RequestId request);
  DisplayedPicture displayed() const;

 private:
  mutable std::mutex mutex_;
  DisplayedPicture displayed_;
  std::deque<DisplayedPicture> waiting_;  // in the order of their requests
};

class ReceivedPictures final : public Received {
 public:
  explicit ReceivedPictures(const ReceivedLinks& links) : links_(links) {}

  Status follow(const wire::Welcome& session) override;
  std::span<const Feed> feeds() const override;
  void on_connected() override { introduced_s_ = -1e9; }
  void on_new_master() override { gatherer_.clear(), complete_.clear(); }
  void receive(int most) override;
  /// Says once a second that it is here.
  void tick(double now_s) override;
  void on_update(const ShownUpdate& update) override;
  void on_coupling(int) override {}
  // No viewer of a wall shows pictures.
  wire::ShownState newest_state() const override { return {}; }
  void show_state(const wire::ShownState&) override {}
  void add_status(net::MasterLink::Values& values) const override;
  Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) override;

 private:
  void on(const wire::Picture& tile, double arrived_s);

  ReceivedLinks links_;
  PictureGatherer gatherer_;
  PictureShelf shelf_;
  std::map<RequestId, std::shared_ptr<const ShownPicture>> complete_;  // that the display may not go on to yet
  double introduced_s_ = -1e9;
  uint64_t decode_errors_ = 0;
  log::RateLimiter log_limit_;
};

/// The display's source where views come as pictures: the picture as it came, for the pose that was asked for. It
/// is scaled where the display has another size by now.
class PictureSource final : public ViewSource {
 public:
  explicit PictureSource(PictureShelf& shelf) : shelf_(shelf) {}

  void advance(RequestId request) override { shelf_.advance(request); }
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  /// Both eyes see the same.
  DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                       const std::array<splat::FrameTarget, 2>& targets) override;
  /// A picture tells of no place.
  std::optional<Pick> pick(const geometry::Camera&, double, double, double) override { return std::nullopt; }
  const char* drawn_name() const override { return "pixels"; }
  const char* cached_name() const override { return " pixels"; }

 private:
  PictureShelf& shelf_;
  std::shared_ptr<const ShownPicture> drawn_;  // last
};

/// Colours of `from` at the size of `to`, between its four nearest pixels each.
void scale_into(const image::View& from, image::View& to);

}  // namespace telesplat::viewer
