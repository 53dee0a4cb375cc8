#include "services/master/slabs/slab_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/core/log.h"
#include "services/master/master_options.h"
#include "services/master/outbox.h"
#include "services/master/record/run_record.h"
#include "services/master/slabs/assignment.h"

namespace telesplat::master {
namespace {

constexpr double kWeighPatience_s = 2.0;  // slabs wait no longer for data servers to send the weights of slices
constexpr double kLeastWait_s = 2.0, kMostWait_s = 60.0;  // without a slab, for samplers that failed at least twice
constexpr double kForgiven_s = 10.0;                      // after this time a failure is forgotten

}  // namespace

SlabPlan::SlabPlan(const MasterOptions& options, const PlanLinks& links) : links_(links), schedule_(options.schedule) {
  schedule_.set_layers(int(options.settings.layers));
}

Result<Adopted> SlabPlan::adopt(const wire::Hello& data, double now_s) {
  const auto change = volume_.adopt(data);
  if (!change) return change.error();
  const int slices = int(volume_.weights().size());
  if (!volume_.complete()) {
    if (change->another) {
      put_aside();
      partitions_.set_slices(slices);
    }
    if (log_.take(now_s)) log::info("{} has a part of a volume; others are still missing", data.name);
    return Adopted{.whole = false};
  }
  const bool begins = !std::exchange(whole_, true);
  if (begins || change->another) {
    partitions_.set_slices(slices);
    schedule_.set_grid(volume_.session().grid);
    since_s_ = now_s;
  }
  if (change->servers) partitions_.invalidate();
  // Servers that came before the last part were welcomed to an epoch without a scene: the scene begins another one.
  return Adopted{
      .whole = true, .changed = begins || change->another || change->values, .in_parts = volume_.servers().size() > 1};
}

void SlabPlan::put_aside() {
  schedule_.drop_frames();
  whole_ = false;
}

void SlabPlan::describe(wire::Welcome& welcome) const {
  welcome.settings.layers = uint64_t(schedule_.layers());
  if (!whole_) return;
  welcome.box_room = volume_.box_room();
  welcome.facts = volume_.facts();
  welcome.parameters = volume_.values();
}

std::map<std::string, std::string> SlabPlan::epoch_texts() const {
  if (!whole_) return {};
  return {{"transfer", volume::to_text(volume_.session().transfer)}};
}

Status SlabPlan::weigh(const wire::SliceWeights& m) {
  const auto taken = volume_.weigh(m);
  if (!taken) return taken.error();
  return *taken && whole_ ? partitions_.set_weights(volume_.weights()) : ok_status();
}

Result<Obeyed> SlabPlan::obey(const wire::Control& m) {
  if (m.command == "colour") return Error{"colour: the scene is a volume; ctl tf sets its transfer function"};
  if (!whole_)
    return Error{fmt::format("{}: the volume is not known yet: data servers of parts are missing", m.command)};
  if (m.command == "animate") {
    const auto timeline = m.arguments.find("timeline");
    if (const Status s = volume_.animate(timeline == m.arguments.end() ? "" : timeline->second); !s) return s.error();
    return Obeyed{.begins_epoch = false, .answer = "animation " + animation()};
  }
  if (m.command == "play") {
    const auto order = read_play(m);
    if (!order) return order.error();
    const auto other = volume_.play(*order);
    if (!other) return other.error();
    return Obeyed{.begins_epoch = *other, .answer = "animation " + animation()};
  }
  if (m.command == "set") return set(m.arguments);
  const auto transfer = m.arguments.find("transfer");
  if (transfer == m.arguments.end()) return Error{"tf: the argument transfer is missing: a preset's name, or points"};
  if (const Status s = volume_.set_transfer(transfer->second); !s) return s.error();
  return Obeyed{.begins_epoch = true, .answer = {}};
}

Result<Obeyed> SlabPlan::set(std::map<std::string, std::string> arguments) {
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
  if (layers) schedule_.set_layers(*layers);
  return Obeyed{.begins_epoch = true, .answer = {}};
}

void SlabPlan::join(const std::string& sampler, double now_s) {
  const auto failed = failed_.find(sampler);
  if (failed != failed_.end() && now_s < failed->second.until_s)
    failed->second.asks = true;
  else
    partitions_.join(sampler);
}

void SlabPlan::fail(const std::string& sampler, bool asks, double now_s) {
  Failed f = failed_[sampler];
  f.since_s = now_s, f.until_s = now_s + f.wait_s, f.asks = asks;
  f.wait_s = std::clamp(2 * f.wait_s, kLeastWait_s, kMostWait_s);
  release_sampler(sampler);
  failed_[sampler] = f;
}

// One refusal may be chance, and another partition would cost more: from the second on, the sampler loses its slab.
void SlabPlan::refused(const wire::TileRefused& refused, const std::string& sampler, double now_s) {
  schedule_.refused(refused, sampler);
  const auto [failed, first] = failed_.try_emplace(sampler);
  if (!first) return fail(sampler, true, now_s);
  failed->second = {.since_s = now_s, .wait_s = kLeastWait_s};
}

void SlabPlan::prepare(double now_s) {
  for (auto& [sampler, f] : failed_)
    if (now_s >= f.until_s && std::exchange(f.asks, false)) partitions_.join(sampler);
  // Slabs that are cut before the weights of slices are known would be fetched in vain.
  if (!whole_ || (!volume_.weighed() && now_s - since_s_ < kWeighPatience_s)) return;
  if (const auto made = partitions_.update(now_s)) assign(*made, now_s);
}

void SlabPlan::assign(const Partition& partition, double now_s) {
  const auto transfers = assignment(partition, volume_);
  const auto tell = [&](const std::string& sampler, size_t slab, SlabRange range) {
    wire::SlabAssignment m{.partition = partition.number,
                           .slab = slab,
                           .slabs = partition.slabs.size(),
                           .begin = uint64_t(range.begin),
                           .end = uint64_t(range.end),
                           .sheet = {}};
    for (const auto& t : transfers)
      if (range.begin < range.end && t.slab == slab)
        m.sheet.push_back({t.round, volume_.servers()[t.server].endpoint, uint64_t(t.begin), uint64_t(t.end)});
    links_.outbox.send(sampler, m);
  };
  for (size_t s = 0; s < partition.slabs.size(); ++s) tell(partition.slabs[s].sampler, s, partition.slabs[s].range);
  for (const auto& sampler : partition.spare) tell(sampler, 0, {});
  std::vector<metrics::Assignment> rows;
  for (const auto& t : transfers)
    rows.push_back({.partition = partition.number,
                    .round = t.round,
                    .data_server = volume_.servers()[t.server].name,
                    .sampler = links_.name_of(partition.slabs[t.slab].sampler),
                    .begin = uint64_t(t.begin),
                    .end = uint64_t(t.end),
                    .bytes = t.bytes});
  links_.record.add_assignment(rows);
  if (!log_.take(now_s)) return;
  log::info("partition {}: {} slabs, {} spare samplers, {} transfers in {} rounds", partition.number,
            partition.slabs.size(), partition.spare.size(), transfers.size(),
            transfers.empty() ? 0 : transfers.back().round + 1);
}

bool SlabPlan::may_begin(const Idle& idle) {
  const auto partition = partitions_.in_use();
  // A view that waits in a sampler's queue grows old.
  const bool wanted =
      partition && std::any_of(idle.begin(), idle.end(), [&](const Idle::Sampler& s) {
        return partition->slab_of(s.id) && (s.at_once > 0 ? s.holds_none() : schedule_.leases_of(s.id) == 0);
      });
  return wanted && schedule_.view_waiting();
}

bool SlabPlan::begin(EpochId epoch, bool turns_only, double now_s) {
  return schedule_.begin_frame(epoch, partitions_.in_use(), turns_only, now_s);
}

void SlabPlan::give_leases(Idle& idle, double now_s) {
  for (size_t i = 0; i < idle.size();) {
    auto lease = schedule_.lease(idle[i].id, now_s);
    if (!lease) {
      ++i;
      continue;
    }
    links_.outbox.send_lease(idle[i].id, *lease);
    asked_.erase(idle[i].id);
    idle.served_in_place(i);
  }
}

bool SlabPlan::done(const wire::TileDone& tile, const std::string& sampler, double now_s) {
  if (const auto f = failed_.find(sampler); f != failed_.end() && now_s - f->second.since_s > kForgiven_s)
    failed_.erase(f);
  return schedule_.tile_done(tile, now_s);
}

// A sampler that asked for work after its lease has finished its slab, though the packer did not report it. It will not
// ask again, so it counts as asking.
Ticked SlabPlan::tick(double now_s) {
  const int expired = schedule_.expire(now_s, [&](const std::string& sampler) {
    log::warn("a slice lease of sampler {} expired; its slab goes to others until it asks again",
              links_.name_of(sampler));
    fail(sampler, asked_.contains(sampler), now_s);
  });
  return {.expired = expired, .overdue = schedule_.overdue(now_s)};
}

void SlabPlan::slab_ready(const std::string& sampler, const wire::SlabReady& slab) {
  partitions_.ready(sampler, slab.partition, slab.voxels, slab.bytes);
}

int SlabPlan::release_sampler(const std::string& sampler) {
  partitions_.leave(sampler);
  failed_.erase(sampler);
  asked_.erase(sampler);
  return schedule_.release_sampler(sampler);
}

Figures SlabPlan::figures() const {
  return {.frames_completed = schedule_.frames_completed(),
          .frames_in_flight = schedule_.frames_in_flight(),
          .released = schedule_.slabs_released(),
          .backups = 0,
          .given_up = schedule_.given_up()};
}

void SlabPlan::add_counters(std::map<std::string, double>& counters) const {
  counters["partitions"] = double(partitions_.made());
  counters["bytes_per_voxel"] = whole_ ? volume_.bytes_per_voxel() : 0;
}

namespace {

nlohmann::ordered_json slabs_told(const Partition& partition, bool in_use, const PlanLinks& links) {
  using Json = nlohmann::ordered_json;
  Json out{{"number", partition.number},
           {"in_use", in_use},
           {"ready", partition.ready()},
           {"slabs", Json::array()},
           {"spare", Json::array()}};
  for (const Slab& s : partition.slabs)
    out["slabs"].push_back({{"sampler", links.name_of(s.sampler)},
                            {"begin", s.range.begin},
                            {"end", s.range.end},
                            {"weight", s.weight},
                            {"ready", s.ready},
                            {"voxels", s.voxels},
                            {"bytes", s.bytes}});
  for (const auto& id : partition.spare) out["spare"].push_back(links.name_of(id));
  return out;
}

}  // namespace

void SlabPlan::add_status(nlohmann::ordered_json& status) const {
  if (!whole_) return;
  using Json = nlohmann::ordered_json;
  const auto& session = volume_.session();
  Json& out = status["volume"];
  out = {{"transfer", volume::to_text(session.transfer)},
         {"step", session.step},
         {"steps", session.steps},
         {"layers", schedule_.layers()},
         {"bytes_per_voxel", volume_.bytes_per_voxel()},
         {"data_servers", Json::array()},
         {"partitions", partitions_.made()}};
  for (const auto& s : volume_.servers())
    out["data_servers"].push_back({{"name", s.name}, {"begin", s.begin}, {"end", s.end}, {"here", s.here}});
  if (const auto partition = partitions_.newest())
    out["partition"] = slabs_told(*partition, partitions_.in_use() == partition, links_);
}

}  // namespace telesplat::master
