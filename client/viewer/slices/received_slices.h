// Frames of slice images of a session: the newest one, or those that wait for the display, in order.
#pragma once

#include "client/viewer/received.h"
#include "client/viewer/slices/cache.h"
#include "client/viewer/slices/receiver.h"

namespace telesplat::viewer {

class ReceivedSlices final : public Received {
 public:
  ReceivedSlices(const ReceivedOptions& options, const ReceivedLinks& links);

  Status follow(const wire::Welcome& session) override { return receiver_.set_session(session); }
  std::span<const Feed> feeds() const override;
  void on_connected() override { receiver_.begin_anew(); }
  void on_new_master() override { receiver_.begin_anew(); }
  void receive(int most) override;
  void tick(double now_s) override;
  void on_coupling(int buffers) override;
  wire::ShownState newest_state() const override;
  void show_state(const wire::ShownState& state) override;
  bool shows_whole_frames() const override { return true; }
  void add_status(net::MasterLink::Values& values) const override;
  Result<std::unique_ptr<ViewSource>> make_source(const DisplayOptions& options, Renderers& renderers) override;

 private:
  ReceivedLinks links_;
  SliceCache cache_;
  SliceReceiver receiver_;
};

}  // namespace telesplat::viewer
