#include "client/viewer/points/event_sequencer.h"

#include <utility>

#include "common/net/socket.h"

namespace telesplat::viewer {
namespace {
// More than this is not kept while an answer is awaited; the gap that dropping leaves is asked for afterwards.
constexpr size_t kMaxKeptEvents = 8192, kMaxKeptBytes = 256u << 20;
}  // namespace

size_t ModelEvent::bytes() const {
  const auto* patch = std::get_if<wire::Patch>(&body);
  const auto* forget = std::get_if<wire::Forget>(&body);
  const auto* refine = std::get_if<wire::Refine>(&body);
  return 512 + (refine ? refine->image.size() : 0) +
         (patch ? patch->image.size() + patch->missed.size() * sizeof patch->missed[0] : 0) +
         (forget ? (forget->clusters.size() + forget->frames.size()) * sizeof(uint32_t) : 0);
}

void EventSequencer::start() {
  packer_.reset();
  ask();
}

// Who names a packer that nobody is follows none of what the packer may still hold to be under way.
void EventSequencer::start_anew() {
  packer_.reset();
  waiting_ = asked_everything_ = true;
  answer_is_stale_ = threw_away_ = false;
  callbacks_.request_state(net::make_instance_id(), {});
}

void EventSequencer::ask() {
  waiting_ = true;
  asked_everything_ |= !packer_ || applied_.value == 0;
  callbacks_.request_state(packer_.value_or(InstanceId{}), packer_ ? applied_ : Sequence{});
}

void EventSequencer::retry() {
  if (waiting_) threw_away_ ? start_anew() : ask();
}

void EventSequencer::follow(InstanceId packer) {
  packer_ = packer;
  applied_ = {};
  answer_is_stale_ = threw_away_ = false;
  kept_.clear();
  kept_bytes_ = 0;
  callbacks_.begin_replica();
}

void EventSequencer::keep(ModelEvent event) {
  if (kept_.size() >= kMaxKeptEvents || kept_bytes_ >= kMaxKeptBytes) return;
  kept_bytes_ += event.bytes();
  kept_.push_back(std::move(event));
}

void EventSequencer::on_published(ModelEvent event) {
  if (event.packer() != packer_) {
    follow(event.packer());
    // The very first event of a new packer needs no history.
    if (event.sequence().value != 1) {
      keep(std::move(event));
      return ask();
    }
    waiting_ = false;
    answer_is_stale_ = asked_everything_;
  }
  if (waiting_) return keep(std::move(event));
  if (event.sequence() <= applied_) return;
  if (event.sequence() != applied_.next()) {
    ++gaps_;
    keep(std::move(event));
    return ask();
  }
  callbacks_.apply(event);
  applied_ = event.sequence();
}

void EventSequencer::on_replayed(const ModelEvent& event) {
  if (event.packer() != packer_) follow(event.packer());
  if (answer_is_stale_ || event.sequence() <= applied_) return;
  callbacks_.apply(event);
  applied_ = event.sequence();
}

void EventSequencer::on_mark(const wire::StateMark& mark) {
  if (mark.packer != packer_) {
    follow(mark.packer);
    // An answer that held no event: there is nothing yet.
    if (!mark.answer) return ask();
  }
  if (mark.answer) {
    asked_everything_ = false;
    if (std::exchange(answer_is_stale_, false)) {
      threw_away_ = mark.sequence > applied_;
      if (threw_away_ && !waiting_) start_anew();
      return;  // who waits, waits for the answer to a newer question
    }
    if (!waiting_) return;
    threw_away_ = false;
    applied_ = std::max(applied_, mark.sequence);
    waiting_ = false;
    return drain();
  }
  if (!waiting_ && mark.sequence > applied_) {  // the last events were lost
    ++gaps_;
    ask();
  }
}

void EventSequencer::drain() {
  std::deque<ModelEvent> kept;
  kept.swap(kept_);
  kept_bytes_ = 0;
  for (auto& event : kept) on_published(std::move(event));
}

}  // namespace telesplat::viewer
