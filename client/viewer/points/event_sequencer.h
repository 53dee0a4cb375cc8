// Puts point-model events in order (the "clone" pattern of the ZeroMQ guide, chapter 5): applies what follows, drops
// what is known, notices gaps and new packers, and asks for what is missing. No sockets, no clocks.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <variant>

#include "client/viewer/render/fine_rays.h"
#include "common/points/point_model.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

/// A received event; bulk fields point into what `owner` keeps alive.
struct ModelEvent {
  std::variant<wire::Patch, wire::Forget, wire::Refine, wire::EpochBegin> body;
  std::shared_ptr<const void> owner;
  double arrived_s = 0;  ///< monotonic_s()
  InstanceId packer() const {
    return std::visit([](const auto& e) { return e.packer; }, body);
  }
  Sequence sequence() const {
    return std::visit([](const auto& e) { return e.sequence; }, body);
  }
  size_t bytes() const;
};

class EventSequencer {
 public:
  struct Callbacks {
    std::function<void(const ModelEvent&)> apply;                  ///< the next event of the current packer
    std::function<void()> begin_replica;                           ///< a packer we have nothing of: start from nothing
    std::function<void(const wire::StateRequest&)> request_state;  ///< whose viewer is not filled in
  };
  explicit EventSequencer(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  /// Forgets which packer was followed. Asks the one that is there for everything: at the start, or when its endpoint
  /// changes.
  void start();
  /// What came is thrown away: everything again, over the same connection.
  void start_anew();
  /// An event from the publisher.
  void on_published(ModelEvent event);
  /// An answer to request_state begins. One that begins elsewhere than where the replica stands is not taken.
  void on_answer(const wire::StateBegin& begin);
  /// An event of that answer; they come in order and may skip what has been forgotten since.
  void on_replayed(const ModelEvent& event);
  /// The publisher's or the answer's mark.
  void on_mark(const wire::StateMark& mark);
  /// An answer takes too long (a packer that died): ask again.
  void retry();

  /// start() was called: events may have come.
  bool begun() const { return waiting_ || packer_; }
  bool synchronised() const { return !waiting_ && packer_; }
  bool waiting() const { return waiting_; }
  Sequence applied() const { return applied_; }
  /// That is followed; 0: none yet.
  InstanceId packer() const { return packer_.value_or(InstanceId{}); }
  uint64_t gaps() const { return gaps_; }

 private:
  void follow(InstanceId packer);
  void meet(InstanceId packer);
  void ask();
  void keep(ModelEvent event);
  void drain();

  Callbacks callbacks_;
  std::optional<InstanceId> packer_;  // none is followed yet
  Sequence applied_;
  bool waiting_ = false;
  // An answer leaves out what was forgotten since it begins. Who has gone on since they asked may hold some of that.
  bool taking_ = false;          // the answer that comes in
  bool answered_ = false;        // an answer has begun since one was asked for; the packer takes it for received
  int retries_ = 0;              // and none has begun since
  std::deque<ModelEvent> kept_;  // published while an answer is awaited
  size_t kept_bytes_ = 0;
  uint64_t gaps_ = 0;
};

/// Rays finer than a viewer's views, of its own patches; and of all others what they found where those had met nothing.
/// image: the patch's, decoded. Error: the mask cannot be decoded; nothing was added.
Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays);

/// What points::prepare_patch() is told of the patch's frame.
inline FrameId tag_of(const wire::Patch& patch) { return points::tagged(patch.frame, patch.step, patch.rest); }

}  // namespace telesplat::viewer
