// Pictures that the servers drew of a session: those that are complete and wait for the display, and the one that is on
// display.
#pragma once

#include <deque>
#include <map>
#include <mutex>

#include "client/viewer/pictures/picture_gatherer.h"
#include "client/viewer/received.h"
#include "common/core/log.h"

namespace telesplat::viewer {

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

}  // namespace telesplat::viewer
