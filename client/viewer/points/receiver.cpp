#include "client/viewer/points/receiver.h"

#include "client/viewer/points/event_sequencer.h"
#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/net/dispatch.h"

namespace telesplat::viewer {
namespace {

constexpr double kAnswerPatience_s = 2.0;

}  // namespace

PointReceiver::PointReceiver(const Options& options, Links links, ModelCache& cache, FineRays& rays,
                             UpdateBatches& batches, metrics::SpanRecorder& spans)
    : options_(options),
      links_(std::move(links)),
      cache_(cache),
      rays_(rays),
      batches_(batches),
      spans_(spans),
      sequencer_({[this](const ModelEvent& e) { apply(e); },
                  [this] {
                    begin_replica(links_.config(), {}, {});
                    if (options_.events) options_.events->begin_replica(config_);
                  },
                  [this](wire::StateRequest request) {
                    asked_s_ = monotonic_s();
                    request.viewer = options_.viewer;
                    links_.request_state(request);
                  }}),
      switch_(options.epoch_patience_s) {}

template <class M>
void PointReceiver::apply_base(const M& message) {
  if constexpr (std::is_same_v<M, wire::BasePart>) {
    if (!links_.base->take(message, monotonic_s())) return;
  } else {
    links_.base->take(message, monotonic_s());
  }
  if (options_.events) options_.events->add(message);
}

// The record has it as a message, so that a replay drops the base, too.
void PointReceiver::drop_base() { apply_base(wire::BaseBegin{}); }

void PointReceiver::receive_events(net::Socket& patches, int most) {
  for (int n = 0; n < most; ++n) {
    const auto message = patches.receive();
    if (!message) return;
    using namespace wire;
    net::dispatch<Patch, Forget, Refine, EpochBegin, StateMark, BaseBegin, BaseHidden>(patches, *message, [&](auto& m) {
      using M = std::decay_t<decltype(m)>;
      if constexpr (std::is_same_v<M, StateMark>)
        on_published_mark(m);
      else if constexpr (std::is_same_v<M, BaseBegin> || std::is_same_v<M, BaseHidden>)
        apply_base(m);
      else
        sequencer_.on_published({m, message->owner, message->arrived_s});
    });
  }
}

// Compares digests, except while changes are held: those reach the cache later.
void PointReceiver::on_published_mark(const wire::StateMark& mark) {
  sequencer_.on_mark(mark);
  if (mark.digest == 0 || options_.hold || !sequencer_.synchronised() || mark.packer != sequencer_.packer() ||
      mark.sequence != sequencer_.applied())
    return;
  const uint64_t ours = cache_.digest();
  const auto verdict = check_.compare(mark.packer, mark.digest, ours, monotonic_s());
  if (verdict == ReplicaCheck::Verdict::kGoOn) return;
  const bool anew = verdict == ReplicaCheck::Verdict::kAskAnew;
  log::error("after event {} the points are not those of the packer {:x}: {:016x}, it has {:016x}; {}",
             mark.sequence.value, mark.packer.value, ours, mark.digest,
             anew ? "they are asked for anew" : "they came anew and are shown as they are: the packer may be broken");
  if (anew) sequencer_.start_anew();
}

void PointReceiver::receive_answers(net::Socket& state, int most) {
  for (int n = 0; n < most; ++n) {
    const auto message = state.receive();
    if (!message) return;
    asked_s_ = monotonic_s();  // an answer that still comes in is not late
    using namespace wire;
    net::dispatch<Patch, Forget, Refine, EpochBegin, StateBegin, StateMark, BasePart, BaseTree, BaseHidden>(
        state, *message, [&](auto& m) {
          using M = std::decay_t<decltype(m)>;
          if constexpr (std::is_same_v<M, StateMark>)
            sequencer_.on_mark(m);
          else if constexpr (std::is_same_v<M, StateBegin>)
            sequencer_.on_answer(m);
          else if constexpr (std::is_same_v<M, BaseTree> || std::is_same_v<M, BaseHidden> ||
                             std::is_same_v<M, BasePart>)
            apply_base(m);
          else
            sequencer_.on_replayed({m, message->owner, message->arrived_s});
        });
  }
}

void PointReceiver::tick(double now_s) {
  if (sequencer_.waiting() && now_s - asked_s_ > kAnswerPatience_s) sequencer_.retry();
  if (options_.hold || !switch_.due(now_s)) return;  // held: each update decides what is shown
  cache_.show_newest();
  if (const auto since_s = switch_.waiting_since_s()) {
    ++epochs_shown_;
    spans_.add("epoch held", links_.to_master_s(*since_s), links_.to_master_s(now_s), 3);
  }
  switch_.shown();
}

std::optional<ShownUpdate> PointReceiver::release() {
  options_.hold = false;
  const double now_s = monotonic_s();
  // A complete update's replica is on display, so the switch has nothing left to decide about it.
  return batches_.release(
      cache_, [&] { switch_.begin(cache_.epoch(), false, now_s); },
      [&](const UpdateBatches::Begin& b, bool held) { switch_.begin(b.epoch, held, now_s); });
}

void PointReceiver::apply(const ModelEvent& event) {
  const bool applied = std::visit(
      [&](const auto& e) {
        using E = std::decay_t<decltype(e)>;
        if constexpr (std::is_same_v<E, wire::Patch>) {
          return apply_patch(e, event.arrived_s);
        } else if constexpr (std::is_same_v<E, wire::Refine>) {
          return apply_refinement(e);
        } else if constexpr (std::is_same_v<E, wire::Forget>) {
          if (options_.hold)
            batches_.add(UpdateBatches::Forget{e.sequence, {e.clusters.begin(), e.clusters.end()}, e.frames}, cache_,
                         sequencer_.packer());
          else
            cache_.forget(e.sequence, e.clusters, e.frames);
        } else {
          begin_replica(config_, e.epoch, e.sequence);
          links_.on_epoch();
        }
        return true;
      },
      event.body);
  // Record after display: points are shown first. Events that cannot be applied could not be replayed either.
  if (applied && options_.events) record(event);
}

// The record omits the misses of finer rays of other viewers' views.
void PointReceiver::record(const ModelEvent& event) {
  const auto* patch = std::get_if<wire::Patch>(&event.body);
  if (!patch || patch->missed.words.empty() || patch->viewer == options_.viewer) return options_.events->add(event);
  ModelEvent without = event;
  std::get<wire::Patch>(without.body).missed.words.clear();
  options_.events->add(without);
}

void PointReceiver::begin_replica(const points::ModelConfig& config, EpochId epoch, Sequence sequence) {
  config_ = config;
  epoch_ = epoch;
  rays_.clear();
  bounded_.clear();
  if (options_.hold)
    batches_.add(UpdateBatches::Begin{config, epoch, sequence}, cache_, sequencer_.packer());
  else
    switch_.begin(epoch, cache_.begin_replica(config, epoch, sequence), monotonic_s());
}

bool PointReceiver::apply_patch(const wire::Patch& patch, double arrived_s) {
  const double begin = monotonic_s();
  // Events in order always name an epoch before its first patch; a replica has one epoch.
  if (epoch_.value != 0 && patch.epoch != epoch_) {
    ++decode_errors_;
    log::warn("patch {} is of epoch {} while the model is of epoch {}: dropped", patch.sequence.value,
              patch.epoch.value, epoch_.value);
    return false;
  }
  const auto bytes = std::span(reinterpret_cast<const uint8_t*>(patch.image.data()), patch.image.size());
  if (const Status decoded = codec::decode_into(tile_, bytes, patch.rect.width, patch.rect.height); !decoded) {
    ++decode_errors_;
    if (told_of_patches_.allow(begin))
      log::warn("patch {} of the packer {:x} cannot be decoded: {}", patch.sequence.value, patch.packer.value,
                decoded.error().text);
    return false;
  }
  if (patch.viewer == options_.viewer && !patch.extra) rays_.follow(patch.camera);
  // Finer rays of other viewers' views: their misses are not shown here, their hits are.
  if (!patch.missed.words.empty() && patch.viewer != options_.viewer) {
    rays_.revise(patch.camera, patch.rect, tile_);
  } else if (const Status rays = add_rays(patch, tile_, rays_); !rays) {
    ++decode_errors_;
    log::warn("patch {}: {}", patch.sequence.value, rays.error().text);
    return false;
  }
  const double decoded = monotonic_s();
  epoch_ = patch.epoch;
  if (patch.refinable) bounded_.add(patch.sequence, patch.camera, patch.rect, bytes, tag_of(patch));
  auto prepared = points::prepare_patch(config_, patch.sequence, patch.camera, patch.rect, tile_, tag_of(patch));
  if (options_.hold)
    batches_.add(UpdateBatches::Insert{std::move(prepared), patch.epoch}, cache_, sequencer_.packer());
  else
    cache_.insert(std::move(prepared), patch.epoch);
  const double inserted = monotonic_s();
  const metrics::SpanOf of{double(patch.frame.value), double(patch.tile), double(patch.request.value)};
  spans_.add("decode", links_.to_master_s(begin), links_.to_master_s(decoded), 1, of);
  spans_.add("insert", links_.to_master_s(decoded), links_.to_master_s(inserted), 1, of);
  points_received_ += patch.counts.kept;
  bytes_received_ += patch.image.size();
  if (!options_.hold) {
    const bool complete = patch.frame_complete && !patch.extra && patch.left_out == 0;
    switch_.on_part({patch.epoch, patch.step, complete, patch.viewer == options_.viewer}, inserted);
    tick(inserted);
  }
  ViewPart part = part_of(patch);
  part.arrived_s = links_.to_master_s(arrived_s);
  part.decode_begin_s = links_.to_master_s(begin);
  part.decoded_s = links_.to_master_s(decoded);
  links_.on_part(part);
  return true;
}

// If nothing is held of the refined patch, the refinement is empty.
bool PointReceiver::apply_refinement(const wire::Refine& refine) {
  const double begin = monotonic_s();
  const auto bytes = std::span(reinterpret_cast<const uint8_t*>(refine.image.data()), refine.image.size());
  auto refinement = bounded_.refine(config_, refine.sequence, refine.patch, bytes);
  if (!refinement) {
    ++decode_errors_;
    log::warn("refinement {} of patch {} cannot be decoded: {}", refine.sequence.value, refine.patch.value,
              refinement.error().text);
    return false;
  }
  if (!*refinement) *refinement = points::PreparedRefinement{refine.sequence, refine.patch, {}};
  if (options_.hold)
    batches_.add(UpdateBatches::Refine{**std::move(refinement)}, cache_, sequencer_.packer());
  else
    cache_.refine(**refinement);
  ++patches_refined_;
  bytes_received_ += refine.image.size();
  spans_.add("refine", links_.to_master_s(begin), links_.to_master_s(monotonic_s()), 1);
  return true;
}

PointReceiver::Figures PointReceiver::figures() const {
  return {.points_received = points_received_,
          .decode_errors = decode_errors_,
          .gaps = sequencer_.gaps(),
          .epochs_shown = epochs_shown_,
          .epoch = switch_.displayed(),
          .sequence = sequencer_.applied(),
          .packer = sequencer_.packer(),
          .bytes_received = bytes_received_,
          .patches_refined = patches_refined_,
          .digests_equal = check_.equal(),
          .digests_different = check_.different()};
}

}  // namespace telesplat::viewer
