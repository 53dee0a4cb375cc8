#include "client/viewer/points/received_points.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "client/viewer/points/source.h"
#include "client/viewer/record/event_record.h"
#include "common/scene/base.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::viewer {
namespace {

constexpr Feed kPointFeeds[] = {{net::Kind::kSub, "patches"}, {net::Kind::kDealer, "state"}};
constexpr size_t kSummariesAtOnce = 8;
// Time between two receipts: while events come, and while no event comes.
constexpr double kReceipts_s = 0.03, kQuietReceipts_s = 0.5;
constexpr uint64_t kReceiptBytes = 32 << 10;  // this many new bytes are reported without delay

}  // namespace

ReceivedPoints::ReceivedPoints(const ReceivedOptions& options, const ReceivedLinks& links)
    : links_(links),
      waits_(links.gate.waits()),
      in_step_(options.in_step),
      events_(options.events),
      base_(cache_,
            [this](wire::BaseRequest request) {
              request.viewer = links_.viewer;
              if (auto* state = links_.feeds.find("state")) state->send(request);
            }),
      receiver_({links.viewer, options.epoch_patience_s, options.events, waits_ || in_step_},
                {[this] { return config_; },
                 [this](const wire::StateRequest& request) {
                   if (auto* state = links_.feeds.find("state")) state->send(request);
                 },
                 &base_, links.on_part, links.on_epoch, links.to_master_s},
                cache_, fine_rays_, batches_, links.spans) {}

Status ReceivedPoints::follow(const wire::Welcome& session) {
  const bool keep = session.settings.keep_redundant;
  const int depth = int(std::min<uint64_t>(session.octree_depth, std::numeric_limits<int>::max()));
  const points::ModelConfig config{session.box_room, depth, !keep};
  if (const Status s = points::validate(config); !s) return s;
  auto clip = geometry::clip_from_text(scene::SessionView(session).fact(scene::kClipFact));
  if (!clip) return clip.error();
  if (*clip != *cut_.clip) {
    const std::lock_guard lock(mutex_);
    cut_ = {std::make_shared<const geometry::Clip>(*std::move(clip)), cut_.version + 1, session.epoch};
  }
  // The packer's first event for another model may have come before this, and with it a replica of the old model. A new
  // connection does not bring what was sent on the old one, such as the end of the base.
  const bool another = config_ != config && receiver_.begun(), has_base = scene::base_triangles(session) > 0;
  if (another) links_.feeds.close();
  config_ = config;
  keeps_redundant_ = keep;
  base_.expect(scene::base_triangles(session));
  if (base_.known() && (another || !has_base)) receiver_.drop_base();
  return ok_status();
}

std::span<const Feed> ReceivedPoints::feeds() const { return kPointFeeds; }

void ReceivedPoints::receive(int most) {
  receiver_.receive_answers(*links_.feeds.find("state"), most);
  receiver_.receive_events(*links_.feeds.find("patches"), most);
}

void ReceivedPoints::tick(double now_s) {
  receiver_.tick(now_s);
  const bool changed = base_.tick(now_s);
  for (const uint32_t node : base_.take_dropped())
    if (events_) events_->add_base_drop(node);
  if (changed && events_) events_->add_base_change(cache_.summaries_made());
  send_receipt(now_s);
  if (!waits_ && !in_step_) summarise();  // otherwise the display's thread applies the held changes
  cache_.free_dropped();
}

// Reports to the packer how much has arrived, so that it knows how much is under way, and how fast it arrives.
void ReceivedPoints::send_receipt(double now_s) {
  const auto received = receiver_.figures();
  auto* state = links_.feeds.find("state");
  if (received.packer.value == 0 || !state || !receipts_.due(received.sequence, received.bytes_received, now_s)) return;
  state->send(wire::Receipt{links_.viewer, received.packer, received.sequence, now_s});
}

bool ReceiptClock::due(Sequence newest, uint64_t bytes, double now_s) {
  const double period_s = newest == newest_ ? kQuietReceipts_s : kReceipts_s;
  if (now_s - sent_s_ < period_s && bytes - bytes_ < kReceiptBytes) return false;
  newest_ = newest, sent_s_ = now_s, bytes_ = bytes;
  return true;
}

void ReceivedPoints::summarise() {
  uint64_t number = cache_.summaries_made();
  for (const points::ClusterKey brick : cache_.summarise(kSummariesAtOnce))
    if (++number; events_) events_->add_summary(number, brick);
}

void ReceivedPoints::on_update(const ShownUpdate& update) {
  if (waits_ || in_step_) return batches_.close(update);
  const std::lock_guard lock(mutex_);
  shown_ = update;
}

void ReceivedPoints::on_coupling(int buffers) {
  const bool waits = buffers > 0;
  if (std::exchange(waits_, waits) == waits) return;
  if (waits || in_step_) return receiver_.hold();
  if (const auto newest = receiver_.release()) show(*newest);
}

void ReceivedPoints::advance(RequestId request) {
  if (const auto update = batches_.apply(request, cache_)) show(*update);
}

void ReceivedPoints::show_state(const wire::ShownState& state) {
  if (const auto update = batches_.apply_until(state, cache_)) show(*update);
}

// The other thread may have shown a newer update by now.
void ReceivedPoints::show(const ShownUpdate& update) {
  const std::lock_guard lock(mutex_);
  if (shown_.request < update.request) shown_ = update;
}

ShownUpdate ReceivedPoints::shown() const {
  const std::lock_guard lock(mutex_);
  return shown_;
}

void ReceivedPoints::on_seen(std::span<const points::ClusterKey> clusters, std::span<const uint32_t> frames) {
  if (retired_) return;  // the worker takes the log no more
  const std::lock_guard lock(mutex_);
  seen_.add(clusters, frames);
}

void ReceivedPoints::report() {
  {
    const std::lock_guard lock(mutex_);
    std::swap(seen_, reported_);
  }
  if (auto reports = reported_.reports(); !reports.empty()) on_display_ = std::move(reports);
  auto* state = links_.feeds.find("state");
  if (!state) return;
  for (const auto& part : on_display_) state->send(wire::AccessReport{links_.viewer, part.clusters, part.frames});
}

void ReceivedPoints::add_status(net::MasterLink::Values& values) const {
  const auto model = cache_.figures();
  const auto received = receiver_.figures();
  values["points"] = double(model.points);
  values["model_bytes"] = double(model.bytes);
  values["points_received"] = double(received.points_received);
  values["gaps_resynced"] = double(received.gaps);
  values["sequence"] = double(received.sequence.value);
  values["digests_equal"] = double(received.digests_equal);
  values["digests_different"] = double(received.digests_different);
  values["messages_rejected"] += double(received.decode_errors);
  if (waits_ || in_step_) return;
  // If updates are not held back, only the receiver knows when an epoch is shown.
  values["epochs_shown"] = std::max(values["epochs_shown"], double(received.epochs_shown));
  values["epoch"] = double(received.epoch.value);
}

Result<std::unique_ptr<ViewSource>> ReceivedPoints::make_source(const DisplayOptions& options, Renderers& renderers) {
  auto renderer = renderers.for_points();
  if (!renderer) return renderer.error();
  return std::unique_ptr<ViewSource>(new PointSource(options, std::move(*renderer), *this));
}

}  // namespace telesplat::viewer
