// A viewer's part for points in a play: messages go through the sockets that it reads from.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/points/receiver.h"
#include "common/core/check.h"
#include "common/core/clock.h"
#include "tests/support/play/pipe.h"

namespace telesplat::test {

class ViewerPart {
 public:
  /// Sockets of one viewer; plays follow each other on the same ones.
  struct Pipes {
    explicit Pipes(net::Context& context) : events(context), answers(context) {}
    Pipe events, answers;
  };

  ViewerPart(InstanceId id, Pipes& pipes, std::function<points::ModelConfig()> config,
             std::function<void(const wire::StateRequest&)> request_state)
      : pipes_(pipes),
        receiver_({.viewer = id},
                  {.config = std::move(config),
                   .request_state = std::move(request_state),
                   .on_part = [](const viewer::ViewPart&) {},
                   .on_epoch = [] {},
                   .to_master_s = [](double s) { return s; }},
                  cache_, rays_, batches_, spans_) {
    pipes_.events.empty();
    pipes_.answers.empty();
  }

  void take_event(std::string_view type, const std::string& body) {
    pipes_.events.in.send_frames({}, type, body);
    receiver_.receive_events(pipes_.events.out, 1000);
    free();
  }
  void take_answer(std::string_view type, const std::string& body) {
    pipes_.answers.in.send_frames({}, type, body);
    receiver_.receive_answers(pipes_.answers.out, 1000);
    free();
  }
  void start() { receiver_.start(); }
  /// Moves the clock past the limit for answers.
  void tick() { receiver_.tick(monotonic_s() + 10); }
  /// Starts or ends waiting for whole updates.
  void hold(bool waits) {
    if (waits == holds_) return;
    holds_ = waits;
    if (waits)
      receiver_.hold();
    else
      receiver_.release();
  }
  /// Returns the replica's digest; 0: there is no replica.
  uint64_t digest() const { return cache_.has_replica() ? cache_.digest() : 0; }
  viewer::PointReceiver::Figures figures() const { return receiver_.figures(); }

 private:
  void free() {
    cache_.free_dropped();
    spans_.flush({1});  // spans would add up
  }

  Pipes& pipes_;
  bool holds_ = false;
  viewer::ModelCache cache_;
  viewer::FineRays rays_;
  viewer::UpdateBatches batches_;
  metrics::SpanRecorder spans_;
  viewer::PointReceiver receiver_;
};

}  // namespace telesplat::test
