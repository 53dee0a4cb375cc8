// The packer's model on its way to viewers: events as they are published, answers to viewers that lack some, marks.
#pragma once

#include <algorithm>
#include <utility>

#include "common/core/clock.h"
#include "common/core/ids.h"
#include "common/core/log.h"
#include "common/net/connections/peer_rates.h"
#include "services/packer/packing.h"
#include "services/packer/points/link_meter.h"
#include "services/packer/points/packer_core.h"
#include "services/packer/points/state_answers.h"

namespace telesplat::packer {

// Returns about the event's size as a message, bytes.
inline uint64_t size_on_wire(const Event& e) {
  constexpr uint64_t kRest = 320;  // camera, moments, numbers, names; tests/unit/wire (BriefMessages) guards it
  return kRest + (e.blob ? e.blob->size() : 0) + 4 * (e.missed.size() + e.clusters.size() + e.frames.size());
}

// Converts the event to messages: calls send(message) for each.
inline void with_message(InstanceId packer, const Event& e, const wire::Moments& moments, auto&& send) {
  switch (e.kind) {
    case Event::Kind::kPatch:
      return send(wire::Patch{.packer = packer,
                              .sequence = e.sequence,
                              .epoch = e.epoch,
                              .frame = e.frame,
                              .viewer = e.viewer,
                              .request = e.request,
                              .tile = e.tile,
                              .tiles_in_frame = e.tiles_in_frame,
                              .step = e.step,
                              .extra = e.extra,
                              .frame_complete = e.frame_complete,
                              .left_out = e.left_out,
                              .counts = {e.samples + e.untold_samples, e.kept},
                              .camera = e.camera,
                              .rect = e.rect,
                              .image = std::as_bytes(std::span(*e.blob)),
                              .missed = {e.missed, e.missed_rect},
                              .moments = moments,
                              .refinable = e.refinable,
                              .lifetime = {e.rest, e.coarse}});
    case Event::Kind::kRefine:
      return send(wire::Refine{packer, e.sequence, e.epoch, e.refines, std::as_bytes(std::span(*e.blob))});
    case Event::Kind::kForget:
      return send(wire::Forget{packer, e.sequence, e.epoch, e.clusters, e.frames});
    case Event::Kind::kEpoch:
      return send(wire::EpochBegin{packer, e.sequence, e.epoch});
  }
}

class ModelFeed {
 public:
  static constexpr double kMarkPeriod_s = 0.5;  ///< between two marks, by which viewers notice missed events
  /// Least time between two marks with the model's digest, by which viewers check their replica; and the share of time
  /// that digests may take.
  static constexpr double kDigestPeriod_s = 2.0, kDigestShare = 0.002;
  /// Answers to state requests that a connection may begin per second; twice as many after a quiet time.
  static constexpr double kBeginnings_s = 8;

  /// Keeps a reference to the outlets. limits: of answers to viewers that join or have gaps.
  ModelFeed(const Outlets& outlets, const StateAnswers::Limits& limits) : outlets_(outlets), answers_(limits) {}

  void publish(const Event& event, const wire::Moments& moments = {}) {
    meter_.published(event.sequence, size_on_wire(event), monotonic_s());
    completions_.add(event);
    with_message(instance_, event, moments, [&](const auto& m) { outlets_.publish(m); });
  }
  /// Another model than before, if there was one: viewers start anew.
  void begin_model(bool was_there) {
    if (was_there) instance_ = net::make_instance_id();
    answers_.clear();
    meter_.clear();
    completions_.clear();
  }
  /// A viewer lacks what came after an event.
  void answer(const PackerCore& core, const wire::StateRequest& request, const net::Message& message, double now_s) {
    const std::string& peer = message.peer;
    const Sequence after = request.packer == instance_ ? request.after : Sequence{};
    const bool known = after <= core.sequence() && core.remembers(after);
    const bool follows = request.packer == instance_ || request.packer.value == 0;
    if (known && answers_.goes_on(peer, request.viewer, after, follows && !request.anew)) return;
    if (!beginnings_.admit(peer, now_s)) return;  // an answer searches all events; the viewer asks again
    if (answers_.is_full(peer)) return;           // kept for its memory
    if (!known) {
      // A mark with an unknown packer id makes the viewer ask for all events.
      answers_.drop(peer);
      outlets_.send(wire::StateMark{.packer = net::make_instance_id(), .epoch = core.epoch()}, peer);
      if (told_of_viewers_.allow(now_s)) log::info("a viewer that stopped after {} starts anew", after.value);
      return;
    }
    if (!outlets_.send(wire::StateBegin{instance_, after}, peer)) return;
    const std::string* payer = net::payer(message);
    StateAnswers::Answer answer{.viewer = request.viewer,
                                .payer = payer ? *payer : message.user,
                                .left = core.replay(after),
                                .mark = mark(core, true)};
    completions_.fill(answer.left.others, request.viewer, after);
    answers_.begin(peer, after, std::move(answer));
    meter_.replayed(request.viewer);
    send_answers(core);
  }
  void receive(const wire::Receipt& receipt, const std::string& peer, double now_s) {
    if (receipt.packer != instance_) return;
    answers_.received(peer, receipt.newest);
    meter_.received(receipt.viewer, receipt.newest, receipt.viewer_s, now_s);
    const auto f = meter_.figures(receipt.viewer, now_s);
    if (f && outlets_.tell_link)
      outlets_.tell_link({receipt.viewer, f->rate_bytes_s, f->backlog_bytes, f->rtt_s, f->oldest_s});
  }
  /// Sends some of the answers under way. A mark that says less than was sent would leave a viewer with a wrong
  /// replica: a viewer that misses an event gets none.
  void send_answers(const PackerCore& core) {
    answers_.pump([&](EventLog::Replay& left) { return core.next(left); },
                  [&](const std::string& peer, const Event& event) {
                    bool sent = false;
                    with_message(instance_, event, {}, [&](const auto& m) { sent = outlets_.send(m, peer); });
                    return sent;
                  },
                  [&](const std::string& peer, const StateAnswers::Answer& answer) {
                    if (!outlets_.send(answer.mark, peer)) return false;
                    meter_.replayed(answer.viewer);
                    if (told_of_viewers_.allow(monotonic_s()))
                      log::info("a viewer caught up: {} events up to {}", answer.events, answer.mark.sequence.value);
                    return true;
                  },
                  size_on_wire, [&](const std::string& peer) { return outlets_.waiting ? outlets_.waiting(peer) : 0; });
  }
  /// Publishes a mark if one is due.
  void send_mark(const PackerCore& core, double now_s) {
    if (now_s - last_mark_s_ < kMarkPeriod_s) return;
    last_mark_s_ = now_s;
    wire::StateMark told = mark(core, false);
    told.digest = due_digest(core, now_s);
    outlets_.publish(told);
  }
  void expire(double now_s) { meter_.expire(now_s); }

  InstanceId instance() const { return instance_; }  ///< the packer, as viewers know it
  const LinkMeter& meter() const { return meter_; }  ///< measures the viewers' links
  const StateAnswers& answers() const { return answers_; }
  uint64_t requests_refused() const { return beginnings_.refused(); }
  uint64_t digests_told() const { return digests_told_; }

 private:
  wire::StateMark mark(const PackerCore& core, bool answer) const {
    return {.packer = instance_,
            .sequence = core.sequence(),
            .epoch = core.epoch(),
            .answer = answer,
            .points = core.model().points()};
  }
  // The model's digest where one is due; else 0.
  uint64_t due_digest(const PackerCore& core, double now_s) {
    if (now_s < next_digest_s_) return 0;
    const double begin_s = thread_cpu_s();  // time of other threads does not count
    const uint64_t digest = core.model().digest();
    next_digest_s_ = now_s + std::max(kDigestPeriod_s, (thread_cpu_s() - begin_s) / kDigestShare);
    digests_told_ += digest != 0;
    return digest;
  }

  const Outlets& outlets_;
  InstanceId instance_ = net::make_instance_id();
  LinkMeter meter_;
  StateAnswers answers_;
  net::PeerRates beginnings_{kBeginnings_s};  // rate of answers that a connection begins
  Completions completions_;
  log::RateLimiter told_of_viewers_;
  double last_mark_s_ = -1e9, next_digest_s_ = 0;
  uint64_t digests_told_ = 0;
};

}  // namespace telesplat::packer
