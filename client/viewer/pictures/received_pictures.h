// Pictures of a session that the servers drew: those that are complete and wait for the display, and the one on
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

/// Joins the decoded tiles of pictures. The newest picture wins: tiles of pictures older than the newest complete one
/// are not decoded. No sockets, no clocks.
class PictureGatherer {
 public:
  static constexpr size_t kMostOpen = wire::kMaxBuffers;  ///< pictures that lack tiles; beyond it the oldest is dropped
  static constexpr int64_t kMaxPixels = 1 << 26;          ///< pixels of a picture: a few bytes may claim many

  /// Returns the picture if this tile completes it; nothing: it still lacks tiles, or is older than a complete one.
  /// Error: what is wrong with the tile, which is dropped. Bytes come from outside.
  Result<std::shared_ptr<const ShownPicture>> add(const wire::Picture& tile);
  /// Call it when requests, frames and epochs begin anew.
  void clear() { open_.clear(), newest_ = {}; }

 private:
  struct Open {
    std::shared_ptr<ShownPicture> picture;
    uint64_t tiles = 0;  // number of its tiles when it is complete
    std::set<uint64_t> here;
  };
  Open& open(const wire::Picture& tile);

  std::deque<Open> open_;  // oldest first
  RequestId newest_;       // newest complete picture
};

/// A picture, and the update that it shows.
struct DisplayedPicture {
  std::shared_ptr<const ShownPicture> picture;  ///< null: no picture yet
  ShownUpdate update;
};

/// Shared by the worker, which puts pictures in, and the display. Only pointers change hands.
class PictureShelf {
 public:
  void put(DisplayedPicture picture);
  /// Puts the newest of the pictures up to this request on display; those before it are dropped.
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
  /// Introduces this viewer to the packer once a second.
  void tick(double now_s) override;
  void on_update(const ShownUpdate& update) override;
  void on_coupling(int) override {}
  // Pictures are not shown on walls.
  wire::ShownState newest_state() const override { return {}; }
  void show_state(const wire::ShownState&) override {}
  void add_status(net::MasterLink::Values& values) const override;
  Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) override;

 private:
  void on(const wire::Picture& tile, double arrived_s);

  ReceivedLinks links_;
  PictureGatherer gatherer_;
  PictureShelf shelf_;
  std::map<RequestId, std::shared_ptr<const ShownPicture>> complete_;  // the display may not show these yet
  double introduced_s_ = -1e9;
  uint64_t decode_errors_ = 0;
  log::RateLimiter log_limit_;
};

/// The display's source if views come as pictures: the picture as it came, for the requested pose. It is scaled if the
/// display has another size by now.
class PictureSource final : public ViewSource {
 public:
  explicit PictureSource(PictureShelf& shelf) : shelf_(shelf) {}

  void advance(RequestId request) override { shelf_.advance(request); }
  DrawnFrame draw(const FrameInput& input, image::View& view) override;
  /// Both eyes get the same picture.
  DrawnFrame draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>& eyes,
                       const std::array<splat::FrameTarget, 2>& targets) override;
  /// A picture has no depth to pick from.
  std::optional<Pick> pick(const geometry::Camera&, double, double, double) override { return std::nullopt; }
  DrawnUnits units() const override { return {"pixels", " pixels"}; }

 private:
  PictureShelf& shelf_;
  std::shared_ptr<const ShownPicture> drawn_;  // the picture drawn last
};

/// Scales the colours of `from` to the size of `to`, each between its four nearest pixels.
void scale_into(const image::View& from, image::View& to);

}  // namespace telesplat::viewer
