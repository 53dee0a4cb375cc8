#include "services/packer/points/point_packing.h"

#include <algorithm>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/net/connections/peer_rates.h"
#include "common/net/dispatch.h"
#include "common/wire/lease_seal.h"

namespace telesplat::packer {
namespace {

// Viewers report once a second what they drew: a point forgotten sooner may be on display.
constexpr double kLeastObsolete_s = 3;

Config config_of(const wire::Welcome& session, const PointPacking::Options& options) {
  const bool keep = session.settings.keep_redundant;
  Config c;
  c.model = {session.box_room, int(session.octree_depth), !keep};
  c.redundancy = keep ? Redundancy::kKeep : Redundancy::kEliminate;
  const double after_s = session.settings.obsolete_after_s;
  c.obsolete_after_s = after_s > 0 ? std::max(after_s, kLeastObsolete_s) : 0;
  c.max_points = session.settings.max_points;
  c.max_log_bytes = options.max_log_bytes;
  c.threads = options.threads;
  return c;
}

PlanConfig plan_config_of(const wire::SessionSettings& settings, const Config& packing) {
  return {.model = packing.model,
          .relative_epsilon = packing.relative_epsilon,
          .nearest_sample = packing.nearest_sample,
          .view_cell_m = settings.view_cell_m,
          .validation = int(settings.validation),
          .still_rays = int(settings.still_rays),
          .max_points = packing.max_points,
          .threads = packing.threads};
}

// Returns the label of the block that a leased tile belongs to.
FramePart block_of(const wire::Lease& l) {
  return {.frame = l.frame,
          .epoch = l.epoch,
          .viewer = l.viewer,
          .request = l.request,
          .tile = uint32_t(l.block),
          .tiles_in_frame = uint32_t(l.blocks_in_frame),
          .step = uint32_t(l.step),
          .camera = l.camera,
          .rect = l.block_rect,
          .extra = l.extra};
}

wire::TileDone done_of(const wire::DepthTile& m, double arrived_s, double receive_s) {
  wire::TileDone out{.frame = m.lease.frame,
                     .tile = m.lease.tile,
                     .lease = m.lease.lease,
                     .sampler = m.sampler,
                     .request = m.lease.request,
                     .step = m.lease.step,
                     .extra = m.lease.extra,
                     .rays = m.lease.rays,
                     .rect = m.lease.rect,
                     .bytes_sampled = m.image.size(),
                     .moments = m.lease.moments};
  out.moments.arrived_s = arrived_s;
  out.moments.receive_s = receive_s;
  return out;
}

metrics::SpanOf of(const wire::TileDone& tile) {
  return {double(tile.frame.value), double(tile.tile), double(tile.request.value)};
}

// Returns about the event's size as a message, bytes.
uint64_t size_on_wire(const Event& e) {
  constexpr uint64_t kRest = 320;  // camera, moments, numbers, names; tests/unit/wire (BriefMessages) guards it
  return kRest + (e.blob ? e.blob->size() : 0) + 4 * (e.missed.size() + e.clusters.size() + e.frames.size());
}

// True if viewers use the event's moments, to show how an update came about (metrics/stages.h).
bool completes_update(const Event& e) { return e.frame_complete && !e.extra && e.step <= 1; }

// Converts the event to messages: calls send(message) for each.
void with_message(InstanceId packer, const Event& e, const wire::Moments& moments, auto&& send) {
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
                              .samples = e.samples + e.untold_samples,
                              .kept = e.kept,
                              .camera = e.camera,
                              .rect = e.rect,
                              .image = std::as_bytes(std::span(*e.blob)),
                              .missed = e.missed,
                              .missed_rect = e.missed_rect,
                              .moments = moments,
                              .refinable = e.refinable,
                              .rest = e.rest});
    case Event::Kind::kRefine:
      return send(wire::Refine{packer, e.sequence, e.epoch, e.refines, std::as_bytes(std::span(*e.blob))});
    case Event::Kind::kForget:
      return send(wire::Forget{packer, e.sequence, e.epoch, e.clusters, e.frames});
    case Event::Kind::kEpoch:
      return send(wire::EpochBegin{packer, e.sequence, e.epoch});
  }
}

}  // namespace

bool PointPacking::follow(const wire::Welcome& session, double now_s) {
  if (scene::SessionView(session).pipeline() != scene::Pipeline::kPoints) return false;
  if (session.box_room.empty()) return true;  // no data server has reported its scene yet
  const Config config = config_of(session, options_);
  if (const Status valid = points::validate(config.model); !valid) {
    log::error("the master's session cannot be packed: {}", valid.error().text);
    return true;
  }
  begin(config, session);
  for (const auto& early : ahead_.take()) pack(early.item, early.since_s, now_s);
  return true;
}

// The model's box comes with the data server; another box means another model.
void PointPacking::begin(const Config& config, const wire::Welcome& session) {
  // Another master counts frames from 1 again: the tiles of the old master's frames no longer count as packed. Where
  // patches are told apart by their frames, the model starts anew, too.
  const bool another_master = core_ && master_ != session.master;
  master_ = session.master;
  lease_key_ = session.lease_key;
  if (another_master) {
    core_->forget_frames();
    if (planner_) planner_->forget_frames();
    gatherer_.clear();
  }
  if (!core_ || model_ != config.model || (another_master && core_->redundancy() == Redundancy::kKeep)) {
    if (core_) instance_ = net::make_instance_id();  // viewers start anew
    answers_.clear();
    meter_.clear();
    completions_.clear();
    model_ = config.model;
    planner_.reset();
    core_.emplace(config, session.epoch);
    gatherer_.clear();
  } else if (const auto event = core_->begin_epoch(session.epoch)) {
    publish(*event);
    gatherer_.clear();
  }
  const wire::SessionSettings& settings = session.settings;
  errors_ = {settings.depth_error, settings.normal_error, settings.colour_error};
  choose_errors();
  begin_planner(plan_config_of(settings, config));
}

// Another configuration means another planner; it learns the model anew.
void PointPacking::begin_planner(const PlanConfig& config) {
  if (core_->redundancy() == Redundancy::kKeep) return core_->watch(nullptr), planner_.reset();
  if (planner_ && plan_config_ == config) return;
  plan_config_ = config;
  planner_.emplace(config);
  planner_->learn(core_->model());
  core_->watch(&*planner_);
}

void PointPacking::take_sampled(net::Socket& from, const net::Message& message, double now_s) {
  net::dispatch<wire::DepthTile>(from, message, [&](const wire::DepthTile& tile) {
    pack({&from, message, tile}, now_s, now_s);
  });
}

// since_s: time when the message came.
void PointPacking::pack(const Received& received, double since_s, double now_s) {
  const auto& [from, message, m] = received;
  const wire::Lease& lease = m.lease;
  if (!core_) return;
  // The announcement of its epoch, or of its master, comes on another socket and may follow. A tile that an earlier
  // master leased waits in vain: this master may use its frame number for another frame.
  if (lease.master != master_ || lease.epoch > core_->epoch())
    return ahead_.add(received, message.body.size(), since_s, message.user);
  if (!wire::is_sealed(lease, m.sampler, lease_key_)) {
    ++unsealed_;
    return from->reject(message, "its lease was not given to who says to have sampled it");
  }
  if (lease.epoch != core_->epoch()) return void(++other_epoch_);
  const double begin_s = outlets_.master_now();
  wire::TileDone done = done_of(m, outlets_.to_master_s(received.message.arrived_s), outlets_.to_master_s(since_s));
  // A tile of a packed block is done. The master may not know yet; if it does, it ignores the message.
  if (core_->has(lease.frame, uint32_t(lease.block))) {
    ++duplicates_;
    return tell_taken(done);
  }
  const std::span stream(reinterpret_cast<const uint8_t*>(m.image.data()), m.image.size());
  auto gathered = gatherer_.add({block_of(lease), {}}, lease.rect, stream);
  if (!gathered) return refuse(received, gathered.error().text);
  if (!*gathered) return tell_taken(done);
  BlockGatherer::Gathered& got = **gathered;
  done.samples = got.samples;
  if (core_->redundancy() == Redundancy::kKeep) done.kept = done.samples;
  if (!got.block) return tell_taken(done);
  spans_.add("decode", begin_s, outlets_.master_now(), 0, of(done));
  std::shared_ptr<const std::vector<uint8_t>> ready;
  if (got.is_block) ready = std::make_shared<const std::vector<uint8_t>>(stream.begin(), stream.end());
  const bool whole = lease.rays == 0 || lease.rays == uint64_t(lease.rect.width) * uint64_t(lease.rect.height);
  if (const Status s = pack_block(std::move(*got.block), whole, std::move(ready), done, now_s); !s)
    refuse(received, s.error().text);
}

void PointPacking::refuse(const Received& received, const std::string& why) {
  const auto& [from, message, m] = received;
  ++refused_;
  from->reject(message, why);
  if (outlets_.refuse) outlets_.refuse({m.lease.frame, m.lease.tile, m.lease.lease, m.sampler, why});
}

Status PointPacking::pack_block(SampledTile block, bool whole, std::shared_ptr<const std::vector<uint8_t>> stream,
                                wire::TileDone& done, double now_s) {
  const double begin_s = outlets_.master_now();
  record(block);
  if (!block.extra) heads_.seen(block.viewer, block.camera.pose, now_s);
  if (planner_) planner_->take(block, whole, now_s), block.missed = planner_->missed(block);
  const auto reference = planner_ ? planner_->reference(block) : std::nullopt;
  // The counts of a block go to the tile that completed it.
  const auto announce = [&](const Event& event) {
    // The moment is taken before sending: a viewer may have the event in its replica before the send returns.
    done.moments.packed_s = outlets_.master_now();
    if (event.is_told()) {
      done.moments.published_s = done.moments.packed_s;
      publish(event, completes_update(event) ? done.moments : wire::Moments{});
    }
    if (event.kept > 0) points_came_s_ = now_s;
    if (core_->redundancy() == Redundancy::kEliminate) done.kept = event.kept;
    done.depth_error_m = event.bounds.depth / 4294967296.0 * event.farthest_m;
    done.normal_error_deg = codec::normal_error_degrees(event.bounds.normal);
    done.colour_error = event.bounds.colour;
    done.bytes_sent = event.blob->size() + event.missed.size() * sizeof event.missed[0];
    bytes_sent_ += done.bytes_sent;
    outlets_.tell(done);
  };
  const auto event = core_->submit(std::move(block), now_s, std::move(stream), announce, reference);
  if (!event) return event.error();
  if (*event && (*event)->frame_complete)
    for (const auto& forget : core_->forget_superseded()) publish(forget);
  if (planner_)
    for (const auto& forget : core_->forget(planner_->disproved())) publish(forget);
  spans_.add("pack", begin_s, outlets_.master_now(), 0, of(done));
  return ok_status();
}

void PointPacking::end_frame(const wire::FrameEnd& end, double now_s) {
  if (!core_ || end.epoch != core_->epoch()) return;
  const FramePart frame{.frame = end.frame,
                        .epoch = end.epoch,
                        .viewer = end.viewer,
                        .request = end.request,
                        .tiles_in_frame = uint32_t(std::min<uint64_t>(end.tiles, kMaxTilesInFrame)),
                        .camera = end.camera};
  if (planner_) planner_->end_frame(end.frame);
  const auto event = core_->end_frame(frame, now_s);
  if (!event) return log::warn("frame {} cannot be ended: {}", end.frame.value, event.error().text);
  if (!*event) return;
  wire::Moments moments = end.moments;
  moments.published_s = outlets_.master_now();
  publish(**event, moments);
}

wire::Plan PointPacking::plan(const wire::PlanRequest& request, double now_s) {
  for (;;)
    if (auto plan = plan_piece(request, now_s)) return *std::move(plan);
}

std::optional<wire::Plan> PointPacking::plan_piece(const wire::PlanRequest& request, double now_s) {
  if (!request.extra) heads_.seen(request.viewer, request.camera.pose, now_s);
  if (!core_ || !planner_ || request.epoch != core_->epoch()) return all_rays(request);
  const double begin_s = monotonic_s(), begin_master_s = outlets_.master_now();
  auto piece = planner_->plan_piece(core_->model(), core_->sequence(), request, now_s);
  spans_.add("plan", begin_master_s, outlets_.master_now(), 0,
             {.frame = double(request.frame.value), .request = double(request.request.value)});
  double took_s = monotonic_s() - begin_s;
  if (request.extra) {
    if (std::exchange(planning_, request.frame) == request.frame) took_s += planning_s_;
    planning_s_ = took_s;
  }
  if (!piece) return std::nullopt;
  wire::Plan plan = *std::move(piece);
  plan.figures["plan_ms"] = took_s * 1e3;
  ++plans_;
  const uint64_t pixels = uint64_t(request.camera.width) * uint64_t(request.camera.height);
  if (pixels > Planner::kMaxPixels && !std::exchange(told_of_size_, true))
    log::warn("views of {}x{} pixels are sampled whole: up to {} pixels are planned", request.camera.width,
              request.camera.height, Planner::kMaxPixels);
  if (request.extra || plan.full || !plan.tiles.empty()) return plan;
  const FramePart frame{.frame = request.frame,
                        .epoch = request.epoch,
                        .viewer = request.viewer,
                        .request = request.request,
                        .camera = request.camera};
  const auto event = core_->complete_empty(frame, now_s);
  wire::Moments moments = request.moments;
  moments.planned_s = moments.published_s = outlets_.master_now();
  if (event && *event) publish(**event, moments);
  for (const auto& forget : core_->forget_superseded()) publish(forget);
  return plan;
}

void PointPacking::tell_taken(wire::TileDone& done) {
  done.moments.packed_s = outlets_.master_now();
  outlets_.tell(done);
}

// Records whole views, as sampled.
void PointPacking::record(const SampledTile& block) {
  if (!options_.recorder || block.step != 1) return;
  const Status s = options_.recorder->add(block.frame, block.camera, block.rect, block.tiles_in_frame, block.image);
  if (s) return;
  ++records_failed_;
  log::error("{}; depth images are not recorded any more", s.error().text);
  options_.recorder = nullptr;
}

void PointPacking::take_state(net::Socket& from, const net::Message& message, double now_s) {
  net::dispatch<wire::StateRequest, wire::AccessReport, wire::Receipt>(from, message, [&](const auto& m) {
    if (!core_) return;
    using M = std::decay_t<decltype(m)>;
    if (!senders_.may_speak(message, m.viewer)) return from.reject(message, kNotItsViewer);
    if constexpr (std::is_same_v<M, wire::Receipt>)
      on_receipt(m, message.peer, now_s);
    else if constexpr (std::is_same_v<M, wire::AccessReport>)
      core_->accessed(m.clusters, now_s, m.frames);
    else
      answer(m, message, now_s);
  });
}

void PointPacking::answer(const wire::StateRequest& request, const net::Message& message, double now_s) {
  const std::string& peer = message.peer;
  const Sequence after = request.packer == instance_ ? request.after : Sequence{};
  const bool known = after <= core_->sequence() && core_->remembers(after);
  const bool follows = request.packer == instance_ || request.packer.value == 0;
  if (known && answers_.goes_on(peer, request.viewer, after, follows && !request.anew)) return;
  if (!beginnings_.admit(peer, now_s)) return;  // an answer searches all events; the viewer asks again
  if (answers_.is_full(peer)) return;           // its viewer asks again
  if (!known) {
    // A mark with an unknown packer id makes the viewer ask for all events.
    answers_.drop(peer);
    outlets_.send(wire::StateMark{.packer = net::make_instance_id(), .epoch = core_->epoch()}, peer);
    if (told_of_viewers_.allow(now_s)) log::info("a viewer that stopped after {} starts anew", after.value);
    return;
  }
  if (!outlets_.send(wire::StateBegin{instance_, after}, peer)) return;
  const std::string* payer = net::payer(message);
  StateAnswers::Answer answer{.viewer = request.viewer,
                              .payer = payer ? *payer : message.user,
                              .left = core_->replay(after),
                              .mark = mark(true)};
  completions_.fill(answer.left.others, request.viewer, after);
  answers_.begin(peer, after, std::move(answer));
  meter_.replayed(request.viewer);
  send_answers();
}

// After a failed send no mark goes out: it would cover events that the viewer lacks, and leave its replica wrong.
void PointPacking::send_answers() {
  answers_.pump([&](EventLog::Replay& left) { return core_->next(left); },
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

void PointPacking::on_receipt(const wire::Receipt& receipt, const std::string& peer, double now_s) {
  if (receipt.packer != instance_) return;
  answers_.received(peer, receipt.newest);
  meter_.received(receipt.viewer, receipt.newest, receipt.viewer_s, now_s);
  const auto f = meter_.figures(receipt.viewer, now_s);
  if (f && outlets_.tell_link)
    outlets_.tell_link({receipt.viewer, f->rate_bytes_s, f->backlog_bytes, f->rtt_s, f->oldest_s});
}

void PointPacking::publish(const Event& event, const wire::Moments& moments) {
  meter_.published(event.sequence, size_on_wire(event), monotonic_s());
  completions_.add(event);
  with_message(instance_, event, moments, [&](const auto& m) { outlets_.publish(m); });
}

wire::StateMark PointPacking::mark(bool answer) const {
  return {.packer = instance_,
          .sequence = core_->sequence(),
          .epoch = core_->epoch(),
          .answer = answer,
          .points = core_->model().points()};
}

uint64_t PointPacking::due_digest(double now_s) {
  if (now_s < next_digest_s_) return 0;
  const double begin_s = thread_cpu_s();  // time of other threads does not count
  const uint64_t digest = core_->model().digest();
  next_digest_s_ = now_s + std::max(kDigestPeriod_s, (thread_cpu_s() - begin_s) / kDigestShare);
  digests_told_ += digest != 0;
  return digest;
}

// Messages wait meanwhile, so settling takes at most a quarter of the time, unless it saves more than it takes.
bool PointPacking::idle(double now_s) {
  constexpr double kPause = 3;
  if (!planner_ || (now_s < next_settle_s_ && !planner_->settles_soon())) return false;
  const double begin_s = outlets_.master_now(), started_s = monotonic_s();
  if (!planner_->settle()) return false;
  next_settle_s_ = now_s + (1 + kPause) * (monotonic_s() - started_s);
  spans_.add("settle", begin_s, outlets_.master_now());
  return true;
}

void PointPacking::choose_errors() {
  if (!core_) return;
  const double rate = meter_.slowest_bytes_s();
  slow_ = rate > 0 && rate < (slow_ ? 1.125 : 1) * kSlowLink_bytes_s;
  const AllowedErrors automatic = slow_ ? kSlowErrors : AllowedErrors{};
  const auto said = [](double value, auto otherwise) { return value < 0 ? otherwise : decltype(otherwise)(value); };
  core_->allow_errors({said(errors_[0], automatic.depth_pixels), said(errors_[1], automatic.normal),
                       said(errors_[2], automatic.colour)});
}

bool PointPacking::refine(double now_s) {
  if (now_s < next_refine_s_ || !heads_.still(now_s)) return false;
  if (now_s - points_came_s_ < kQuiet_s && heads_.still_s(now_s) < kLongStill_s) return false;
  const double begin_s = outlets_.master_now();
  uint64_t bytes = 0;
  bool more = true;
  while (more && bytes < kRefineStep && meter_.all_free(kRefineBacklog_s, kRefineBytes, now_s)) {
    const auto event = core_->refine(now_s - kDrawnLately_s);
    if (!(more = event.has_value())) break;
    bytes += event->blob->size();
    publish(*event);
  }
  if (!more) next_refine_s_ = now_s + kRefinePause_s;
  bytes_sent_ += bytes;
  if (bytes > 0) spans_.add("refine", begin_s, outlets_.master_now());
  return bytes >= kRefineStep;
}

void PointPacking::tick(double now_s) {
  ahead_.expire(now_s);
  meter_.expire(now_s);
  if (!core_) return;
  send_answers();
  choose_errors();
  refining_ = refine(now_s);
  if (now_s - last_forget_s_ >= kForgetPeriod_s) {
    last_forget_s_ = now_s;
    for (const auto& event : core_->tick(now_s)) publish(event);
  }
  if (now_s - last_mark_s_ >= kMarkPeriod_s) {
    last_mark_s_ = now_s;
    wire::StateMark told = mark(false);
    told.digest = due_digest(now_s);
    outlets_.publish(told);
  }
}

void PointPacking::add_status(net::MasterLink::Values& values) const {
  values["bytes_sent"] += double(bytes_sent_);
  values["messages_refused"] += double(beginnings_.refused());
  values[metrics::kRecordFailed] = double(records_failed_);
  if (!core_) return;
  const auto& s = core_->statistics();
  const auto& g = gatherer_.statistics();
  values.insert({{"points", double(core_->model().points())},
                 {"model_bytes", double(core_->model().bytes())},
                 {"log_bytes", double(core_->log_bytes())},
                 {"sequence", double(core_->sequence().value)},
                 {"tiles", double(g.tiles)},
                 {"tiles_untold", double(s.tiles_untold)},
                 {"tiles_duplicate", double(s.tiles_duplicate + g.tiles_duplicate + duplicates_)},
                 {"tiles_other_epoch", double(s.tiles_other_epoch + other_epoch_ + ahead_.dropped())},
                 {"tiles_refused", double(refused_)},
                 {"tiles_unsealed", double(unsealed_)},
                 {"blocks", double(s.tiles)},
                 {"blocks_dropped", double(g.blocks_dropped)},
                 {"frames_complete", double(s.frames_complete)},
                 {"patches_forgotten", double(s.patches_forgotten)},
                 {"points_forgotten", double(s.points_forgotten)},
                 {"points_outside", double(s.points_outside)},
                 {"patches_bounded", double(s.patches_bounded)},
                 {"patches_refined", double(s.patches_refined)},
                 {"bytes_refined", double(s.bytes_refined)},
                 {"answers", double(answers_.size())},
                 {"answer_bytes", double(answers_.bytes_under_way())},
                 {"plans", double(plans_)},
                 {"planned_frames", planner_ ? double(planner_->frames()) : 0},
                 {"digests_told", double(digests_told_)}});
}

}  // namespace telesplat::packer
