#include "tools/lab/simulation/viewer.h"

#include <utility>

#include "client/viewer/display/frame_table.h"
#include "common/core/check.h"
#include "common/core/clock.h"

namespace telesplat::simulation {
namespace {

viewer::DisplayOptions display_of(const Scenario& s) {
  viewer::DisplayOptions out;
  out.width = s.width, out.height = s.height;
  out.target_fps = s.display_hz;
  out.still_samples = 4;
  return out;
}

viewer::Renderers cpu_renderers() {
  auto made = viewer::Renderers::make("cpu", 1);
  CHECK(made.ok());
  return *std::move(made);
}

}  // namespace

SimulatedViewer::SimulatedViewer(net::Context& context, const net::ServiceOptions& service, const Scenario& scenario)
    : display_(display_of(scenario)),
      camera_{.left = -1, .right = 1, .bottom = -0.75, .top = 0.75, .width = scenario.width, .height = scenario.height},
      gate_(scenario.coupling),
      frames_("frames", viewer::frame_columns()),
      renderers_(cpu_renderers()),
      look_(viewer::first_look(display_.render, display_.shading)) {
  viewer::ViewerWorker::Options options{.service = service, .own_thread = false};
  options.requests.adaptive = true;
  options.requests.max_rate_hz = 1.5 * scenario.display_hz;
  options.least_sampling = 1;
  worker_ = std::make_unique<viewer::ViewerWorker>(context, options, gate_, frames_, spans_);
}

bool SimulatedViewer::draw_from(RequestId request) {
  auto received = worker_->received_at(request);
  if (received == received_) return source_ != nullptr;
  source_.reset();
  intact_ = false;
  received_ = std::move(received);
  auto made = received_->make_source(display_, renderers_);
  CHECK(made.ok());
  source_ = *std::move(made);
  return true;
}

SimulatedViewer::Waited SimulatedViewer::wait_for_update(double now_s) {
  if (!gate_.waits()) {
    waits_since_s_.reset();
    stall_.over(now_s);
    return {draw_from(viewer::Succession::kNewest)};
  }
  if (!waits_since_s_) waits_since_s_ = now_s;
  const auto [coupling, request, last_sign_s, asked] = gate_.take(0);
  if (request) {
    if (draw_from(*request)) source_->advance(*request);
    stall_.over(now_s);
    waits_since_s_.reset();
    return {true, true};
  }
  const bool draws = stall_.waiting(now_s, *waits_since_s_, last_sign_s, coupling);
  stall_.take_news();
  worker_->on_waiting(stall_.told_s(now_s));
  return {draws && source_};
}

void SimulatedViewer::refuse_orders() {
  for (const wire::Order& order : worker_->orders().take_orders())
    worker_->orders().answer({order.number, false, "nobody sits here"});
}

std::optional<viewer::DrawnFrame> SimulatedViewer::frame(const geometry::Pose& head) {
  refuse_orders();
  if (over()) worker_->stop();
  if (!worker_->received_at({}) || worker_->shown_scene().box_room.empty()) return std::nullopt;
  const double now_s = monotonic_s();
  camera_.pose = head;
  if (!worker_->first_update_complete()) {
    draw_from(gate_.waits() ? RequestId{} : viewer::Succession::kNewest);
    worker_->on_pose(now_s, camera_);
    viewer::fit(view_, camera_, false);
    auto drawn = source_->draw(
        {.begin_s = now_s, .camera = camera_, .look = look_, .resting = true, .even_empty = false}, view_);
    if (!drawn.empty) worker_->on_first_points(now_s);
    return std::nullopt;
  }
  const Waited waited = wait_for_update(now_s);
  if (!waited.draws) {
    worker_->on_pose(now_s, camera_);
    return std::nullopt;
  }
  viewer::fit(view_, camera_, false);
  auto drawn = source_->draw({.begin_s = now_s, .camera = camera_, .look = look_, .intact = intact_}, view_);
  intact_ = true;
  worker_->on_frame(now_s, camera_, drawn.epoch, drawn.update, waited.for_update);
  source_->displayed();
  gate_.displayed();
  if (start_s_ == 0) start_s_ = now_s;
  viewer::MeasuredFrame m{.number = number_++, .start_s = start_s_, .previous_s = previous_s_};
  m.begin_s = m.end_s = m.presented_s = m.seen.at_s = previous_s_ = now_s;
  m.camera = camera_, m.head = head, m.drawn = drawn, m.coupling = gate_.state(), m.look = look_;
  m.begin_master_s = worker_->to_master_s(now_s);
  m.update_age_s = m.begin_master_s - drawn.update.requested_s;
  frames_.add(viewer::frame_row(m));
  worker_->on_measured(m);
  return drawn;
}

}  // namespace telesplat::simulation
