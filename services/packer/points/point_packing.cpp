#include "services/packer/points/point_packing.h"

#include <algorithm>
#include <utility>

#include "common/core/log.h"
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

// True if viewers use the event's moments, to show how an update came about (metrics/stages.h).
bool completes_update(const Event& e) { return e.frame_complete && !e.extra && e.step <= 1; }

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
    if (planning_.planner()) planning_.planner()->forget_frames();
    gatherer_.clear();
  }
  if (!core_ || core_->model().config() != config.model ||
      (another_master && core_->redundancy() == Redundancy::kKeep)) {
    feed_.begin_model(core_.has_value());
    planning_.drop();
    core_.emplace(config, session.epoch);
    gatherer_.clear();
  } else if (const auto event = core_->begin_epoch(session.epoch)) {
    feed_.publish(*event);
    gatherer_.clear();
  }
  base_.follow(session, core_->model().points() == 0);
  exactness_.follow(session.settings.errors);
  choose_errors();
  planning_.follow(*core_, plan_config_of(session.settings, config));
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
  SampledTile block{block_of(lease), {}};
  block.coarse = m.coarse;
  auto gathered = gatherer_.add(std::move(block), lease.rect, stream);
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
  if (!block.extra) exactness_.heads().seen(block.viewer, block.camera.pose, now_s);
  Planner* planner = planning_.planner();
  if (planner) planner->take(block, whole, now_s), block.missed = planner->missed(block);
  if (!block.coarse) base_.note(block, whole, planner ? planner->cast(block) : nullptr);
  const auto reference = planner ? planner->reference(block) : std::nullopt;
  // The counts of a block go to the tile that completed it.
  const auto announce = [&](const Event& event) {
    // The moment is taken before sending: a viewer may have the event in its replica before the send returns.
    done.moments.packed_s = outlets_.master_now();
    if (event.is_told()) {
      done.moments.published_s = done.moments.packed_s;
      feed_.publish(event, completes_update(event) ? done.moments : wire::Moments{});
    }
    if (event.kept > 0) exactness_.points_came(now_s);
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
  if (*event && (*event)->frame_complete) publish_forgets(core_->forget_superseded());
  if (planner) publish_forgets(core_->forget(planner->disproved()));
  base_.take_noted();
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
  if (planning_.planner()) planning_.planner()->end_frame(end.frame);
  const auto event = core_->end_frame(frame, now_s);
  if (!event) return log::warn("frame {} cannot be ended: {}", end.frame.value, event.error().text);
  if (!*event) return;
  wire::Moments moments = end.moments;
  moments.published_s = outlets_.master_now();
  feed_.publish(**event, moments);
}

wire::Plan PointPacking::plan(const wire::PlanRequest& request, double now_s) {
  for (;;)
    if (auto plan = plan_piece(request, now_s)) return *std::move(plan);
}

std::optional<wire::Plan> PointPacking::plan_piece(const wire::PlanRequest& request, double now_s) {
  if (!request.extra) exactness_.heads().seen(request.viewer, request.camera.pose, now_s);
  if (!core_ || !planning_.planner() || request.epoch != core_->epoch()) return all_rays(request);
  auto plan = planning_.piece(*core_, request, now_s);
  if (!plan || request.extra || plan->full || !plan->tiles.empty()) return plan;
  const FramePart frame{.frame = request.frame,
                        .epoch = request.epoch,
                        .viewer = request.viewer,
                        .request = request.request,
                        .camera = request.camera};
  const auto event = core_->complete_empty(frame, now_s);
  wire::Moments moments = request.moments;
  moments.planned_s = moments.published_s = outlets_.master_now();
  if (event && *event) feed_.publish(**event, moments);
  publish_forgets(core_->forget_superseded());
  return plan;
}

void PointPacking::publish_forgets(const std::vector<Event>& events) {
  for (const Event& event : events) {
    feed_.publish(event);
    base_.forgotten(event, core_->model());
  }
}

void PointPacking::tell_taken(wire::TileDone& done) {
  done.moments.packed_s = outlets_.master_now();
  outlets_.tell(done);
}

// Records whole views, as sampled.
void PointPacking::record(const SampledTile& block) {
  if (!options_.recorder || block.provisional()) return;
  const Status s = options_.recorder->add(block.frame, block.camera, block.rect, block.tiles_in_frame, block.image);
  if (s) return;
  ++records_failed_;
  log::error("{}; depth images are not recorded any more", s.error().text);
  options_.recorder = nullptr;
}

void PointPacking::take_state(net::Socket& from, const net::Message& message, double now_s) {
  using namespace wire;
  net::dispatch<StateRequest, AccessReport, Receipt, BaseRequest>(from, message, [&](const auto& m) {
    if (!core_) return;
    using M = std::decay_t<decltype(m)>;
    if (!senders_.may_speak(message, m.viewer)) return from.reject(message, kNotItsViewer);
    if constexpr (std::is_same_v<M, wire::Receipt>)
      feed_.receive(m, message.peer, now_s);
    else if constexpr (std::is_same_v<M, wire::AccessReport>)
      core_->accessed(m.clusters, now_s, m.frames);
    else if constexpr (std::is_same_v<M, wire::BaseRequest>)
      base_.answer(m, message.peer);
    else
      feed_.answer(*core_, m, message, now_s);
  });
}

void PointPacking::choose_errors() { core_->allow_errors(exactness_.allowed(feed_.meter().slowest_bytes_s())); }

void PointPacking::refine(double now_s) {
  const double begin_s = outlets_.master_now();
  const uint64_t bytes =
      exactness_.refine(*core_, feed_.meter(), now_s, [this](const Event& event) { feed_.publish(event); });
  bytes_sent_ += bytes;
  if (bytes > 0) spans_.add("refine", begin_s, outlets_.master_now());
}

void PointPacking::tick(double now_s) {
  ahead_.expire(now_s);
  feed_.expire(now_s);
  if (!core_) return;
  base_.tick(feed_.instance(), now_s);
  feed_.send_answers(*core_);
  choose_errors();
  refine(now_s);
  if (now_s - last_forget_s_ >= kForgetPeriod_s) {
    last_forget_s_ = now_s;
    publish_forgets(core_->tick(now_s));
    base_.publish();
  }
  feed_.send_mark(*core_, now_s);
}

void PointPacking::add_status(net::MasterLink::Values& values) const {
  values["bytes_sent"] += double(bytes_sent_);
  values["messages_refused"] += double(feed_.requests_refused());
  values[metrics::kRecordFailed] = double(records_failed_);
  if (!core_) return;
  const auto& s = core_->statistics();
  const auto& g = gatherer_.statistics();
  values.insert({{"points", double(core_->model().points())},
                 {"model_bytes", double(core_->model().bytes())},
                 {"log_bytes", double(core_->log_bytes())},
                 {"base_triangles", double(base_.triangles())},
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
                 {"answers", double(feed_.answers().size())},
                 {"answer_bytes", double(feed_.answers().bytes_under_way())},
                 {"plans", double(planning_.plans())},
                 {"planned_frames", planning_.planner() ? double(planning_.planner()->frames()) : 0},
                 {"digests_told", double(feed_.digests_told())}});
}

}  // namespace telesplat::packer
