// A viewer of a simulated session: the real worker and what it receives, and a display that draws small frames of a
// drawn head with the real sources, as client/viewer/display/display_loop.h does with a surface.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "client/viewer/display/renderers.h"
#include "client/viewer/viewer_worker.h"
#include "tools/lab/simulation/scenario.h"

namespace telesplat::simulation {

class SimulatedViewer {
 public:
  /// The context must outlive it.
  SimulatedViewer(net::Context& context, const net::ServiceOptions& service, const Scenario& scenario);

  net::Turns& worker() { return *worker_; }
  /// Draws the frame that is due. Nothing: none can be shown yet, or the display waits for an update.
  std::optional<viewer::DrawnFrame> frame(const geometry::Pose& head);
  /// The session ends, and its worker was told to.
  bool over() const { return worker_->shutdown_requested(); }
  std::shared_ptr<const wire::Welcome> session() const { return worker_->session(); }
  InstanceId instance() const { return worker_->instance(); }
  /// Null: it draws nothing yet.
  viewer::Received* received() const { return received_.get(); }
  const image::View& view() const { return view_; }
  const geometry::Camera& camera() const { return camera_; }

 private:
  struct Waited {
    bool draws = true, for_update = false;
  };
  bool draw_from(RequestId request);
  Waited wait_for_update(double now_s);
  void refuse_orders();

  viewer::DisplayOptions display_;
  geometry::Camera camera_;
  viewer::CouplingGate gate_;
  metrics::TableRecorder frames_;
  metrics::SpanRecorder spans_;
  viewer::Renderers renderers_;
  std::unique_ptr<viewer::ViewerWorker> worker_;
  std::shared_ptr<viewer::Received> received_;
  std::unique_ptr<viewer::ViewSource> source_;
  viewer::StallWatch stall_;
  viewer::Look look_;
  image::View view_;
  bool intact_ = false;  // it holds what is on display
  std::optional<double> waits_since_s_;
  uint64_t number_ = 0;
  double start_s_ = 0, previous_s_ = 0;
};

}  // namespace telesplat::simulation
