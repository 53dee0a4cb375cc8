// What the master does of a volume: parts of data servers, slabs of samplers, frames of slice leases.
#include <fmt/format.h>

#include <algorithm>

#include "common/core/log.h"
#include "services/master/master_core.h"
#include "services/master/slabs/assignment.h"

namespace telesplat::master {
namespace {

constexpr double kWeighPatience_s = 2.0;  // slabs wait no longer for data servers to say what slices weigh
constexpr double kProbeEvery_s = 0.25;    // of samplers that are overdue

}  // namespace

void MasterCore::adopt_volume(const wire::Hello& data, double now_s) {
  const auto change = volume_.adopt(data);
  if (!change) return log::error("the volume of {} is refused: {}", data.name, change.error().text);
  if (!volume_.complete()) return log::info("{} has a part of a volume; others are still missing", data.name);
  const bool first = !std::exchange(volume_on_, true);
  if (first) volume_schedule_.take_views(schedule_.release_views());
  if (first || change->another) {
    partitions_.set_slices(volume_.session().grid.size[2]);
    volume_schedule_.set_grid(volume_.session().grid);
    if (const auto layers = options_.settings.find("volume.layers"); layers != options_.settings.end())
      volume_schedule_.set_layers(int(layers->second));
    volume_since_s_ = now_s;
  }
  if (change->servers) partitions_.invalidate();
  box_room_ = volume_.box_room();
  facts_ = volume_.facts();
  // Servers that came before the last part were told of an epoch without a scene: what they know now is another one.
  if (!std::exchange(scene_known_, true) && volume_.servers().size() == 1)
    record_epoch(now_s);
  else if (first || change->another || change->values)
    next_epoch(now_s);
}

void MasterCore::join_partition(const std::string& peer) { partitions_.join(peer); }

void MasterCore::leave_partition(const std::string& peer) {
  partitions_.leave(peer);
  volume_schedule_.release_sampler(peer);
}

Status MasterCore::on(const std::string& peer, const wire::SliceWeights& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p) return ok_status();
  if (p->hello.role != "data" || p->hello.instance != m.data)
    return Error{fmt::format("slice weights of another process than {} {}", p->hello.role, p->hello.name)};
  const auto taken = volume_.weigh(m);
  if (!taken) return taken.error();
  if (!*taken || !volume_on_) return ok_status();
  partitions_.set_weights(volume_.weights());
  dispatch(now_s);
  return ok_status();
}

void MasterCore::on(const std::string& peer, const wire::SlabReady& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "sampler") return;
  join_partition(peer);
  partitions_.ready(peer, m.partition, m.voxels, m.bytes);
  if (volume_on_) dispatch(now_s);
}

Result<std::string> MasterCore::obey_volume(const wire::Control& m, double now_s) {
  if (m.command == "animate") {
    const auto timeline = m.arguments.find("timeline");
    if (const Status s = volume_.animate(timeline == m.arguments.end() ? "" : timeline->second); !s) return s.error();
    return "animation " + animation();
  }
  if (m.command == "tf") {
    const auto transfer = m.arguments.find("transfer");
    if (transfer == m.arguments.end()) return Error{"tf: the argument transfer is missing: a preset's name, or points"};
    if (const Status s = volume_.set_transfer(transfer->second); !s) return s.error();
    next_epoch(now_s);
    return fmt::format("epoch {}", epoch_.value);
  }
  auto arguments = m.arguments;
  std::optional<int> layers;
  if (const auto found = arguments.find("volume.layers"); found != arguments.end()) {
    const auto value = read_number(found->first, found->second);
    if (!value) return value.error();
    if (!(*value >= 1 && *value <= volume::kMaxLayers))
      return Error{fmt::format("volume.layers is {}, limits 1 and {}", *value, volume::kMaxLayers)};
    layers = int(*value);
    arguments.erase(found);
  }
  if (!layers || !arguments.empty())
    if (const Status s = volume_.set(arguments); !s) return s.error();
  if (layers) {
    volume_schedule_.set_layers(*layers);
    options_.settings["volume.layers"] = *layers;
  }
  next_epoch(now_s);
  return fmt::format("epoch {}", epoch_.value);
}

void MasterCore::update_partition(double now_s) {
  // Slabs cut without knowing what slices weigh would be fetched in vain.
  if (!volume_.weighed() && now_s - volume_since_s_ < kWeighPatience_s) return;
  if (const auto made = partitions_.update(now_s)) assign(*made);
}

void MasterCore::assign(const Partition& partition) {
  const auto transfers = assignment(partition, volume_);
  const auto name_of_peer = [&](const std::string& id) {
    const auto p = peers_.find(id);
    return p == peers_.end() ? std::string("?") : p->second.hello.name;
  };
  std::vector<metrics::Assignment> rows;
  for (size_t s = 0; s < partition.slabs.size(); ++s) {
    const Slab& slab = partition.slabs[s];
    wire::SlabAssignment m{.partition = partition.number,
                           .slab = s,
                           .slabs = partition.slabs.size(),
                           .begin = uint64_t(slab.range.begin),
                           .end = uint64_t(slab.range.end),
                           .sheet = {}};
    for (const auto& t : transfers)
      if (t.slab == s)
        m.sheet.push_back({t.round, volume_.servers()[t.server].endpoint, uint64_t(t.begin), uint64_t(t.end)});
    emit(slab.sampler, m);
  }
  for (const auto& sampler : partition.spare)
    emit(sampler, wire::SlabAssignment{.partition = partition.number,
                                       .slab = 0,
                                       .slabs = partition.slabs.size(),
                                       .begin = 0,
                                       .end = 0,
                                       .sheet = {}});
  for (const auto& t : transfers)
    rows.push_back({.partition = partition.number,
                    .round = t.round,
                    .data_server = volume_.servers()[t.server].name,
                    .sampler = name_of_peer(partition.slabs[t.slab].sampler),
                    .begin = uint64_t(t.begin),
                    .end = uint64_t(t.end),
                    .bytes = t.bytes});
  record_.add_assignment(rows);
  log::info("partition {}: {} slabs, {} spare samplers, {} transfers in {} rounds", partition.number,
            partition.slabs.size(), partition.spare.size(), transfers.size(),
            transfers.empty() ? 0 : transfers.back().round + 1);
}

bool MasterCore::begin_volume_frame(double now_s) {
  const auto partition = partitions_.in_use();
  // Only for someone who would go on with it at once: a view that waits in a sampler's queue grows old.
  const bool wanted = partition && std::any_of(idle_.begin(), idle_.end(), [&](const std::string& id) {
                        const Peer& p = peers_[id];
                        return partition->slab_of(id) && (p.leases_at_once > 0 ? p.waiting_leases >= p.leases_at_once
                                                                               : volume_schedule_.leases_of(id) == 0);
                      });
  if (!wanted || !volume_schedule_.view_waiting()) return false;
  if (!volume_.playing()) return volume_schedule_.begin_frame(epoch_, partition);
  // One frame at a time, so that each step has a complete one; all who wait when a step begins are served from it, in turn.
  if (volume_schedule_.frames_in_flight() > 0) return false;
  if (!volume_schedule_.turn_waiting()) {
    if (volume_.step(now_s)) next_epoch(now_s);
    volume_schedule_.begin_turns();
  }
  return volume_schedule_.begin_frame(epoch_, partition, true);
}

void MasterCore::dispatch_volume(double now_s) {
  do {
    for (size_t i = 0; i < idle_.size();) {
      const std::string sampler = idle_[i];
      const auto lease = volume_schedule_.lease(sampler, now_s);
      if (!lease) {
        ++i;
        continue;
      }
      emit(sampler, *lease);
      if (--peers_[sampler].waiting_leases == 0) idle_.erase(idle_.begin() + std::ptrdiff_t(i));
    }
  } while (begin_volume_frame(now_s));
}

void MasterCore::expire_slabs(double now_s) {
  const int expired = volume_schedule_.expire(now_s, [&](const std::string& sampler) {
    const auto p = peers_.find(sampler);
    log::warn("a slice lease of sampler {} expired; its slab goes to others until it asks again",
              p == peers_.end() ? "?" : p->second.hello.name);
    leave_partition(sampler);
  });
  leases_expired_ += uint64_t(expired);
  // A message to a process that died is undeliverable, which is sooner known than that its lease ran out.
  for (const auto& sampler : volume_schedule_.overdue(now_s))
    if (const auto p = peers_.find(sampler); p != peers_.end() && now_s - p->second.probed_s > kProbeEvery_s) {
      p->second.probed_s = now_s;
      emit(sampler, welcome(now_s));
    }
}

nlohmann::ordered_json MasterCore::volume_status() const {
  const auto& session = volume_.session();
  nlohmann::ordered_json out{{"transfer", volume::to_text(session.transfer)},
                             {"step", session.step},
                             {"steps", session.steps},
                             {"layers", volume_schedule_.layers()},
                             {"bytes_per_voxel", volume_.bytes_per_voxel()},
                             {"data_servers", nlohmann::ordered_json::array()},
                             {"partitions", partitions_.made()}};
  for (const auto& s : volume_.servers())
    out["data_servers"].push_back({{"name", s.name}, {"begin", s.begin}, {"end", s.end}, {"here", s.here}});
  const auto partition = partitions_.newest();
  if (!partition) return out;
  const auto name_of_peer = [&](const std::string& id) {
    const auto p = peers_.find(id);
    return p == peers_.end() ? std::string("?") : p->second.hello.name;
  };
  nlohmann::ordered_json p{{"number", partition->number},
                           {"in_use", partitions_.in_use() == partition},
                           {"ready", partition->ready()},
                           {"slabs", nlohmann::ordered_json::array()},
                           {"spare", nlohmann::ordered_json::array()}};
  for (const Slab& s : partition->slabs)
    p["slabs"].push_back({{"sampler", name_of_peer(s.sampler)},
                          {"begin", s.range.begin},
                          {"end", s.range.end},
                          {"weight", s.weight},
                          {"ready", s.ready},
                          {"voxels", s.voxels},
                          {"bytes", s.bytes}});
  for (const auto& id : partition->spare) p["spare"].push_back(name_of_peer(id));
  out["partition"] = std::move(p);
  return out;
}

}  // namespace telesplat::master
