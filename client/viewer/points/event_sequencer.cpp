#include "client/viewer/points/event_sequencer.h"

#include <utility>

#include "common/codec/mask_stream.h"

namespace telesplat::viewer {
namespace {
// Limits of events kept while an answer is awaited; more are dropped, and the gap is requested afterwards.
constexpr size_t kMaxKeptEvents = 8192, kMaxKeptBytes = 256u << 20;
}  // namespace

size_t ModelEvent::bytes() const {
  const auto* patch = std::get_if<wire::Patch>(&body);
  const auto* forget = std::get_if<wire::Forget>(&body);
  const auto* refine = std::get_if<wire::Refine>(&body);
  return 512 + (refine ? refine->image.size() : 0) +
         (patch ? patch->image.size() + patch->missed.words.size() * sizeof patch->missed.words[0] : 0) +
         (forget ? (forget->clusters.size() + forget->frames.size()) * sizeof(uint32_t) : 0);
}

void EventSequencer::start() {
  packer_.reset();
  taking_ = answered_ = false;
  ask();
}

void EventSequencer::start_anew() {
  packer_.reset();
  taking_ = false;
  answered_ = true;
  ask();
}

void EventSequencer::ask() {
  waiting_ = true;
  const bool anew = answered_ && !taking_;
  if (anew) answered_ = false;
  callbacks_.request_state(
      {.packer = packer_.value_or(InstanceId{}), .after = packer_ ? applied_ : Sequence{}, .anew = anew});
}

void EventSequencer::retry() {
  if (!waiting_) return;
  answered_ |= ++retries_ > 1;  // the packer may count an answer that never came as received
  ask();
}

void EventSequencer::follow(InstanceId packer) {
  packer_ = packer;
  applied_ = {};
  taking_ = false;
  kept_.clear();
  kept_bytes_ = 0;
  callbacks_.begin_replica();
}

// If a request of start() is still open, which any packer answers, it is not repeated.
void EventSequencer::meet(InstanceId packer) {
  const bool asked = waiting_ && !packer_;
  follow(packer);
  if (!asked) ask();
}

void EventSequencer::keep(ModelEvent event) {
  if (kept_.size() >= kMaxKeptEvents || kept_bytes_ >= kMaxKeptBytes) return;
  kept_bytes_ += event.bytes();
  kept_.push_back(std::move(event));
}

void EventSequencer::on_published(ModelEvent event) {
  if (event.packer() != packer_) {
    // The first event of a new packer needs no history.
    if (event.sequence().value != 1) {
      meet(event.packer());
      return keep(std::move(event));
    }
    follow(event.packer());
    waiting_ = false;
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

void EventSequencer::on_answer(const wire::StateBegin& begin) {
  if (waiting_ && begin.packer != packer_) follow(begin.packer);
  taking_ = waiting_ && begin.after == applied_;
  answered_ = true;
  retries_ = 0;
  if (waiting_ && !taking_) ask();
}

void EventSequencer::on_replayed(const ModelEvent& event) {
  if (!taking_ || event.packer() != packer_ || event.sequence() <= applied_) return;
  callbacks_.apply(event);
  applied_ = event.sequence();
}

void EventSequencer::on_mark(const wire::StateMark& mark) {
  if (mark.answer) {
    if (!taking_ || mark.packer != packer_) return;  // while waiting, only the answer to the newest request counts
    applied_ = std::max(applied_, mark.sequence);
    taking_ = waiting_ = false;
    return drain();
  }
  if (mark.packer != packer_) return meet(mark.packer);
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

Status add_rays(const wire::Patch& patch, const image::DepthImage& image, FineRays& rays) {
  if (patch.missed.words.empty()) {
    rays.revise(patch.camera, patch.rect, image);
    return ok_status();
  }
  const auto missed = codec::decode_mask(patch.missed.words, patch.missed.rect.width, patch.missed.rect.height);
  if (!missed) return missed.error();
  rays.add({patch.epoch, patch.camera, patch.missed.rect, &*missed, patch.rect, &image});
  return ok_status();
}

}  // namespace telesplat::viewer
