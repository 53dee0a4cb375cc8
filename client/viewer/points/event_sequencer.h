// Puts point-model events in order (the "clone" pattern of the ZeroMQ guide, chapter 5): applies the next ones, drops
// known ones, notices gaps and new packers, and asks for missing ones. No sockets, no clocks.
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

/// A received event; bulk fields point into memory that `owner` keeps alive.
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
    std::function<void(const ModelEvent&)> apply;  ///< the next event of the current packer
    std::function<void()> begin_replica;           ///< a new packer, whose model is not known: begin an empty replica
    std::function<void(const wire::StateRequest&)> request_state;  ///< its viewer is not filled in
  };
  explicit EventSequencer(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  /// Forgets which packer it followed, and asks the present one for everything: at the start, or when its endpoint
  /// changes.
  void start();
  /// Throws the replica away and asks for everything again, over the same connection.
  void start_anew();
  /// An event from the publisher.
  void on_published(ModelEvent event);
  /// An answer to request_state begins. If it begins elsewhere than where the replica stands, it is not taken.
  void on_answer(const wire::StateBegin& begin);
  /// An event of that answer; they come in order and may skip patches that have been forgotten since.
  void on_replayed(const ModelEvent& event);
  /// A mark from the publisher, or at an answer's end.
  void on_mark(const wire::StateMark& mark);
  /// An answer takes too long (the packer may have died): asks again.
  void retry();

  /// True after start(): events may have come.
  bool begun() const { return waiting_ || packer_; }
  bool synchronised() const { return !waiting_ && packer_; }
  bool waiting() const { return waiting_; }
  Sequence applied() const { return applied_; }
  /// The packer that it follows; 0: none yet.
  InstanceId packer() const { return packer_.value_or(InstanceId{}); }
  uint64_t gaps() const { return gaps_; }

 private:
  void follow(InstanceId packer);
  void meet(InstanceId packer);
  void ask();
  void keep(ModelEvent event);
  void drain();

  Callbacks callbacks_;
  std::optional<InstanceId> packer_;  // nothing: it follows no packer yet
  Sequence applied_;
  bool waiting_ = false;
  // An answer omits what was forgotten since it begins. A viewer that went on after its request may hold some of it.
  bool taking_ = false;          // the answer that comes in is used
  bool answered_ = false;        // an answer has begun since the last request; the packer counts it as received
  int retries_ = 0;              // repeated requests since an answer began
  std::deque<ModelEvent> kept_;  // published while an answer is awaited
  size_t kept_bytes_ = 0;
  uint64_t gaps_ = 0;
};

/// Adds the patch's finer rays, if it has any (Patch::missed); else its hits revise known rays that had passed them.
/// image: the patch's, decoded. Error: the mask cannot be decoded; nothing was added.
Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays);

/// Frame tag of the patch for points::prepare_patch().
inline FrameId tag_of(const wire::Patch& patch) {
  return points::tagged(patch.frame, patch.step > 1 || patch.lifetime.coarse, patch.lifetime.rest);
}

}  // namespace telesplat::viewer
