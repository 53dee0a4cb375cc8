#include "services/sampler/volume/work.h"

#include <tbb/task_arena.h>

#include <algorithm>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/parallel/in_parallel.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::sampler {
namespace {

constexpr size_t kMaxServers = 256;  // connections to data servers

Result<volume::Session> read(const wire::Welcome& welcome, const std::string& clip_text, geometry::Clip& clip) {
  auto planes = geometry::clip_from_text(clip_text);
  if (!planes) return planes.error();
  clip = *std::move(planes);
  auto session = volume::read_session(welcome.parameters, welcome.facts);
  if (!session) return session;
  if (const Status s = volume::validate(session->grid); !s) return s.error();
  return session;
}

// Encodes all images in parallel, and appends the streams to one another.
std::vector<uint8_t> encode(const std::vector<volume::SliceImage>& images) {
  std::vector<std::vector<uint8_t>> parts(images.size());
  in_parallel(size_t{0}, images.size(), [&](size_t i) { parts[i] = volume::encode_slice(images[i]); });
  size_t size = 0;
  for (const auto& p : parts) size += p.size();
  std::vector<uint8_t> out;
  out.reserve(size);
  for (const auto& p : parts) out.insert(out.end(), p.begin(), p.end());
  return out;
}

}  // namespace

VolumeWork::VolumeWork(MakeSlab make, const Options& o, net::Context& context, Master master,
                       metrics::SpanRecorder& spans)
    : store_(std::move(make), o.cache_bytes),
      threads_(o.threads > 0 ? o.threads : tbb::task_arena::automatic),
      service_name_(o.service_name),
      context_(context),
      master_(std::move(master)),
      spans_(spans) {}

void VolumeWork::on_welcome(const wire::Welcome& welcome) {
  if (epochs_.follow(welcome.master)) told_ready_ = {};
  const scene::SessionView view(welcome);
  if (!view.kind()) return;  // no scene now: parts of a volume are missing, or there is no data server
  const std::string transfer = view.fact("transfer"), clip = view.fact(scene::kClipFact);
  const Epoch* known = epochs_.find(welcome.epoch);
  if (known && known->parameters == welcome.parameters && known->transfer == transfer && known->clip_text == clip)
    return;
  Epoch epoch{.parameters = welcome.parameters, .transfer = transfer, .clip_text = clip};
  if (const auto session = read(welcome, clip, epoch.clip)) {
    epoch.scene = SlabScene{session->grid, session->levels, session->lit, session->steps,
                            view.fact("scene") + "\n" + view.fact("content_hash")};
    epoch.step = session->step;
    epoch.colours = volume::level_colours(session->transfer, session->levels);
    for (size_t l = 0; l < epoch.colours.size(); ++l)
      if (epoch.colours[l].extinction > 0) epoch.shown.add(int(l));
    if (store_.scene() != epoch.scene) {
      store_.set_scene(*epoch.scene);
      forget_asked();
      told_ready_ = {};
      forget_servers();
    }
  } else {
    log::error("epoch {} cannot be sampled: {}", welcome.epoch.value, session.error().text);
  }
  epochs_.put(welcome.epoch, std::move(epoch));
}

void VolumeWork::take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) {
  net::dispatch<wire::SliceLease, wire::SlabAssignment>(from, message, [&](const auto& m) {
    if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::SliceLease>) {
      if (takes_leases && leases_.size() < kMaxHeld) {
        leases_.push_back({m, now_s});
        leases_.back().lease.moments.lease_arrived_s = master_.to_master_s(message.arrived_s);
      }
    } else {
      if (!store_.scene()) return from.reject(message, "a slab of a volume that is not known yet");
      if (const Status s = store_.assign(m); !s) return from.reject(message, s.error().text);
      told_ready_ = {};
      bytes_before_ = bytes_received_;
      progress_s_ = now_s;
      // Open requests of the sheet before go on if the new sheet names their server: they bring the same slices.
      forget_servers();
    }
  });
}

SlabWant VolumeWork::want(EpochId epoch, const Epoch& of, int begin, int end) {
  return {of.step, begin, end, epoch, &of.shown};
}

Readiness VolumeWork::readiness(const Held& held, double now_s) {
  using State = Readiness::State;
  const wire::SliceLease& lease = held.lease;
  const Epoch* epoch = epochs_.find(lease.epoch);
  if (!epoch) return epochs_.wait_for_welcome(lease.epoch, held.received_s, now_s);
  const Epoch& e = *epoch;
  if (!e.scene || store_.scene() != e.scene) return {State::kHopeless};
  if (lease.begin >= lease.end || lease.end > uint64_t(e.scene->grid.size[2])) {
    log::warn("a lease of slices {} to {} of {} was dropped", lease.begin, lease.end, e.scene->grid.size[2]);
    return {State::kHopeless};
  }
  if (const Status s = volume::validate(lease.shear, e.scene->grid); !s) {
    log::warn("a lease was dropped: {}", s.error().text);
    return {State::kHopeless};
  }
  const SlabWant w = want(lease.epoch, e, int(lease.begin), int(lease.end));
  if (store_.arranged(w) || store_.holds(w)) return {};
  return {State::kWaits};
}

Readiness VolumeWork::look_at_next(double now_s) {
  while (!leases_.empty()) {
    Held& next = leases_.front();
    const Readiness r = readiness(next, now_s);
    if (r.state == Readiness::State::kWaits && next.waits_since_s == 0) next.waits_since_s = now_s;
    if (r.state != Readiness::State::kHopeless) return r;
    leases_.pop_front();
  }
  return {Readiness::State::kWaits};
}

Delivery VolumeWork::sample_next() {
  const Held held = std::move(leases_.front());
  const wire::SliceLease& lease = held.lease;
  leases_.pop_front();
  const Epoch& epoch = *epochs_.find(lease.epoch);
  store_.use(int(lease.begin), int(lease.end));
  const auto slab = store_.slab(want(lease.epoch, epoch, int(lease.begin), int(lease.end)));
  Delivery out{.type = wire::SliceImages::kName,
               .body = {},
               .begin_s = monotonic_s(),
               .of = {.frame = double(lease.frame.value), .tile = double(lease.slab)}};
  wire::SliceImages m{.sampler = master_.instance, .lease = lease};
  const auto images = slab->splat(epoch.colours, lease.shear, int(lease.begin), int(lease.end), epoch.clip, m.voxels);
  out.sampled_s = monotonic_s();
  tbb::task_arena arena(threads_);
  const auto bytes = arena.execute([&] { return encode(images); });
  out.encoded_s = monotonic_s();
  wire::Moments& moments = m.lease.moments;
  if (held.waits_since_s > 0) moments.fetch_s = out.begin_s - held.waits_since_s;
  moments.sample_begin_s = master_.to_master_s(out.begin_s);
  moments.sample_end_s = master_.to_master_s(out.sampled_s);
  moments.encode_end_s = master_.to_master_s(out.encoded_s);
  m.data = std::as_bytes(std::span(bytes));
  out.body = wire::encode(m);
  return out;
}

// Returns the next request: for the first lease, else for the newest epoch's assigned slab, else for later steps.
std::optional<VoxelAsk> VolumeWork::next_ask() {
  if (!leases_.empty()) {
    const wire::SliceLease& lease = leases_.front().lease;
    const Epoch* epoch = epochs_.find(lease.epoch);
    if (epoch && epoch->scene && lease.begin < lease.end)
      if (const auto w = want(lease.epoch, *epoch, int(lease.begin), int(lease.end)); !store_.arranged(w))
        if (const auto ask = store_.next(w)) return ask;
  }
  const auto& a = store_.assignment();
  if (a.partition == 0 || a.begin >= a.end || epochs_.empty()) return std::nullopt;
  const EpochId id = epochs_.newest_id();
  const Epoch& newest = epochs_.newest();
  if (!newest.scene) return std::nullopt;
  SlabWant w = want(id, newest, int(a.begin), int(a.end));
  if (const auto ask = store_.next(w)) return ask;
  if (!store_.arranged(w)) return std::nullopt;
  for (int ahead = 1; ahead <= store_.steps_ahead(newest.step); ++ahead) {
    w.step = (newest.step + ahead) % newest.scene->steps;
    if (const auto ask = store_.next(w)) return ask;
  }
  return std::nullopt;
}

bool VolumeWork::overdue(double now_s) const {
  if (asked_->refused_s > 0 && now_s - asked_->refused_s > RetryClock::kLeast_s) return true;
  const auto server = servers_.find(asked_->ask.endpoint);
  const bool broken = server == servers_.end() || server->second.failed_connections() != asked_->failed_before;
  return retry_.overdue(now_s, broken);
}

void VolumeWork::forget_asked() {
  asked_.reset();
  retry_.forget();
}

void VolumeWork::ask(double now_s) {
  if (asked_ && !overdue(now_s)) return;
  forget_asked();
  if (now_s < pause_until_s_) return;
  const auto next = next_ask();
  if (!next) return;
  auto server = servers_.find(next->endpoint);
  if (server == servers_.end()) {
    if (servers_.size() >= kMaxServers) servers_.clear();
    server =
        servers_
            .emplace(next->endpoint, net::Socket(context_, net::Kind::kDealer, service_name_ + ":voxels",
                                                 {.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                                                  .patience_s = net::kBulkPatience_s,
                                                  .watch_connecting = true,
                                                  .toward = "data"}))
            .first;
    if (const Status s = server->second.connect(next->endpoint); !s) log::error("{}", s.error().text);
  }
  wire::VoxelRequest request{next->epoch,         uint64_t(next->step), uint64_t(next->begin),
                             uint64_t(next->end), next->round,          {}};
  if (!next->have.empty()) request.have = std::as_bytes(next->have.bytes());
  server->second.send(request);
  asked_ = {*next, server->second.failed_connections()};
  retry_.asked(answer_bytes_, now_s);
}

void VolumeWork::tell_ready() {
  const auto& a = store_.assignment();
  if (a.partition == 0 || epochs_.empty()) return;
  const EpochId id = epochs_.newest_id();
  const Epoch& newest = epochs_.newest();
  if (told_ready_ == std::pair{a.partition, id} || !newest.scene) return;
  // Arrange the slab at once, so that the first lease does not wait for it. A spare sampler holds nothing and is ready.
  if (a.begin < a.end) {
    const SlabWant w = want(id, newest, int(a.begin), int(a.end));
    if (!store_.arranged(w)) {
      const double begin_s = monotonic_s();
      if (!store_.slab(w)) return;
      spans_.add("arrange voxels", master_.to_master_s(begin_s), master_.to_master_s(monotonic_s()));
    }
    store_.trim(newest.step, newest.shown);
  }
  told_ready_ = {a.partition, id};
  master_.ready({master_.instance, a.partition, id, store_.voxels(), bytes_received_ - bytes_before_});
}

// Arranges a later step of a series whose voxels are here, while there is nothing else to do.
void VolumeWork::arrange_ahead() {
  const auto& a = store_.assignment();
  if (a.partition == 0 || a.begin >= a.end || epochs_.empty()) return;
  const EpochId id = epochs_.newest_id();
  const Epoch& newest = epochs_.newest();
  if (!newest.scene) return;
  SlabWant w = want(id, newest, int(a.begin), int(a.end));
  for (int ahead = 1; ahead <= store_.steps_ahead(newest.step); ++ahead) {
    w.step = (newest.step + ahead) % newest.scene->steps;
    if (!store_.arranged(w) && store_.slab(w)) return;
  }
}

void VolumeWork::fetch(double now_s) {
  ask(now_s);
  tell_ready();
  if (!asked_ && leases_.empty()) arrange_ahead();
  if (leases_.empty() || !asked_ || now_s - last_extend_s_ < kExtend_s) return;
  const double patience_s = retry_.known() ? std::max(kPatience_s, retry_.patience_s()) : kPatience_s;
  if (now_s - std::max(progress_s_, leases_.front().received_s) > patience_s) return;
  if (readiness(leases_.front(), now_s).state != Readiness::State::kWaits) return;
  for (const Held& held : leases_) master_.extend({master_.instance, held.lease.lease});
  last_extend_s_ = now_s;
}

std::vector<net::Socket*> VolumeWork::sockets() {
  std::vector<net::Socket*> out;
  for (auto& [endpoint, socket] : servers_) out.push_back(&socket);
  return out;
}

// Closes connections to servers that no sheet names any more.
void VolumeWork::forget_servers() {
  std::erase_if(servers_, [&](const auto& server) {
    const bool named = store_.names(server.first);
    if (!named && asked_ && asked_->ask.endpoint == server.first) forget_asked();
    if (!named) rejected_ += server.second.rejected();
    return !named;
  });
}

void VolumeWork::receive(double now_s) {
  for (auto& [endpoint, socket] : servers_)
    while (const auto message = socket.receive()) {
      net::dispatch<wire::VoxelData>(
          socket, *message, [&, &from = endpoint, &socket = socket](const wire::VoxelData& data) {
            if (!asked_ || asked_->ask.endpoint != from || data.epoch != asked_->ask.epoch ||
                data.step != uint64_t(asked_->ask.step))
              return;  // too late: it was asked for again, or is not needed any more
            const VoxelAsk ask = asked_->ask;
            if (!data.known || data.begin >= data.end) {
              forget_asked();
              pause_until_s_ = now_s + kPause_s;
              return;
            }
            const Epoch* epoch = epochs_.find(data.epoch);
            if (!epoch) return forget_asked();
            const double begin_s = monotonic_s();
            const auto taken = store_.take(ask, data, epoch->shown);
            if (!taken) {
              asked_->refused_s = now_s;
              return socket.reject(*message, taken.error().text);
            }
            if (!*taken) return;
            retry_.answered(answer_bytes_, message->body.size(), now_s);
            answer_bytes_ = std::max<uint64_t>(message->body.size(), answer_bytes_ / 2);
            forget_asked();
            progress_s_ = now_s;
            bytes_received_ += message->body.size();
            const Epoch& newest = epochs_.newest();
            store_.trim(newest.step, newest.shown);
            spans_.add("add voxels", master_.to_master_s(begin_s), master_.to_master_s(monotonic_s()));
          });
    }
}

void VolumeWork::add_status(net::MasterLink::Values& values) const {
  values["voxels"] = double(store_.voxels());
  values["voxel_mb"] = double(store_.bytes()) / 1e6;
  values["voxel_bytes_received"] = double(bytes_received_);
  double rejected = double(rejected_);
  for (const auto& [endpoint, socket] : servers_) rejected += double(socket.rejected());
  values["messages_rejected"] = rejected;
}

}  // namespace telesplat::sampler
