// The viewers of a display wall, simulated: real to the master and the packer - they join, ask, receive, acknowledge
// with loose coupling (T6.4) - but what a view takes them to construct is waited for instead of computed, so that there
// can be more of them than processors.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/geometry/camera.h"
#include "common/net/master_link.h"
#include "common/volume/grid.h"

namespace telesplat::launcher {

/// What constructing a view took, in earnest.
struct ConstructionCost {
  double decode_s = 0, warp_s = 0;  ///< CPU time of one thread
  uint64_t bytes = 0;               ///< of the frame as received
  double total_s() const { return decode_s + warp_s; }
};

/// Decodes the frame and warps it into `camera`'s view, `passes` times on one thread; each part's least time counts.
/// Error: the frame cannot be decoded.
Result<ConstructionCost> measure_view(const wire::SliceFrame& frame, const volume::Grid& grid,
                                      const geometry::Camera& camera, int passes);

class WaitingViewer {
 public:
  /// camera: its view, which does not change. buffers: of loose coupling.
  WaitingViewer(net::Context& context, const std::string& master, const std::string& name,
                const geometry::Camera& camera, int buffers);

  /// Keeps its connections going, asks for views while a buffer is free, and constructs those that are complete, one
  /// after the other, in order, each for cost_s. asks: false lets it fall silent. Returns when to look again, if
  /// nothing comes before.
  double turn(double now_s, double cost_s, bool asks);
  std::vector<net::Socket*> sockets();

  /// When each view was constructed.
  const std::vector<double>& shown_s() const { return shown_s_; }
  /// The newest frame that came, whole.
  const std::optional<wire::SliceFrame>& newest() const { return newest_; }
  const std::optional<wire::Welcome>& session() const { return link_.session(); }
  const geometry::Camera& camera() const { return camera_; }
  size_t open() const { return requested_.size(); }
  void leave();

 private:
  void take(const net::Message& message, double now_s);

  net::Context& context_;
  geometry::Camera camera_;
  int buffers_;
  net::MasterLink link_;
  std::optional<net::Socket> state_;
  double introduced_s_ = -1e9;
  bool known_ = false;
  RequestId next_{1};
  std::deque<RequestId> requested_;   // and neither complete nor given up
  std::deque<FrameId> complete_;      // in their buffers; the first one is being constructed
  double asked_s_ = 0, ready_s_ = 0;  // when the last request went out; when the construction that goes on ends
  std::vector<double> shown_s_;
  std::optional<wire::SliceFrame> newest_;
  std::shared_ptr<const void> newest_owner_;
};

}  // namespace telesplat::launcher
