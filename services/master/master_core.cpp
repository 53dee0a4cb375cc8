#include "services/master/master_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "common/core/log.h"

namespace telesplat::master {
namespace {
constexpr size_t kMaxPeers = 4096;     // remembered processes, the departed included
constexpr int kMaxWaitingLeases = 64;  // lease requests of one sampler
}  // namespace

const char* name_of(Progressive progressive) {
  return progressive == Progressive::kAuto ? "auto" : progressive == Progressive::kOn ? "on" : "off";
}

MasterCore::MasterCore(const MasterOptions& options, InstanceId instance, metrics::RunRecord& record)
    : options_(options),
      instance_(instance),
      record_(record),
      schedule_(options.schedule),
      scene_(options.animation),
      volume_schedule_(options.schedule) {}

MasterCore::Peer* MasterCore::known(const std::string& peer, double now_s) {
  const auto it = peers_.find(peer);
  if (it == peers_.end() || it->second.gone) {
    emit(peer, wire::WhoAreYou{instance_});
    return nullptr;
  }
  it->second.seen_s = now_s;
  return &it->second;
}

MasterCore::Peer* MasterCore::find_role(const std::string& role) {
  for (auto& [id, p] : peers_)
    if (!p.gone && p.hello.role == role) return &p;
  return nullptr;
}

wire::Welcome MasterCore::welcome(double now_s) const {
  wire::Welcome w;
  w.master = instance_;
  w.master_s = now_s;
  w.epoch = epoch_;
  w.octree_depth = octree_depth();
  w.settings = settings();
  // The scene stays what it is while its data server is away.
  w.box_room = box_room_;
  w.facts = volume_on_ ? volume_.facts() : facts_;
  w.parameters = volume_on_ ? volume_.values() : scene_.values();
  for (const auto& [id, p] : peers_)
    if (!p.gone) w.endpoints.insert(p.hello.endpoints.begin(), p.hello.endpoints.end());
  w.endpoints.erase("voxels");  // each part of a volume has its own: samplers get them in their sheets
  return w;
}

uint64_t MasterCore::octree_depth() const {
  if (options_.octree_depth > 0) return options_.octree_depth;
  // Fewer and larger clusters are chosen from sooner. A Julia set along a walk at 2560x1600 had 54 fps, 237 ms, 28.5 dB and 0.9 % holes with
  // 5 levels, 44 fps, 284 ms, 28.2 dB and 0.3 % with 6. The isosurface of a bonsai after a minute's orbit (bench cache) was chosen from in 1.7 ms
  // with 5 levels, 5.2 ms with 6, and splatted in 10.6 instead of 13.4 ms.
  return 5;
}

std::map<std::string, double> MasterCore::settings() const {
  auto out = options_.settings;
  if (const auto keep = out.find("packing.keep_redundant"); keep != out.end() && keep->second < 0)
    keep->second = scene_.kind() == "julia" ? 1 : 0;
  return out;
}

void MasterCore::announce(double now_s) {
  const std::string body = wire::encode(welcome(now_s));
  // The packer first: it should know an epoch before tiles of it come.
  for (const bool packer : {true, false})
    for (const auto& [id, p] : peers_)
      if (!p.gone && p.hello.role != "ctl" && (p.hello.role == "packer") == packer)
        outgoing_.push_back({id, std::string(wire::Welcome::kName), body});
}

void MasterCore::record_epoch(double now_s) {
  if (!scene_known_) return;
  if (volume_on_)
    record_.add_epoch(epoch_, now_s, volume_.values(), {{"transfer", volume::to_text(volume_.session().transfer)}});
  else
    record_.add_epoch(epoch_, now_s, scene_.values());
}

void MasterCore::next_epoch(double now_s) {
  epoch_ = epoch_.next();
  schedule_.drop_frames();
  volume_schedule_.drop_frames();
  record_epoch(now_s);
  announce(now_s);
}

void MasterCore::adopt_scene(const wire::Hello& data, double now_s) {
  if (const auto kind = data.facts.find("kind"); kind != data.facts.end() && kind->second == "volume")
    return adopt_volume(data, now_s);
  const bool other_kind = std::exchange(volume_on_, false);
  if (other_kind) schedule_.take_views(volume_schedule_.release_views());
  box_room_ = data.box_room;
  facts_ = data.facts;
  std::string problem;
  bool changed = scene_.adopt(data, problem) || other_kind;
  if (!problem.empty()) log::error("the scene of {}: {}", data.name, problem);
  const bool julia = scene_.kind() == "julia";
  const Cut cut{julia, options_.progressive == Progressive::kAuto ? julia : options_.progressive == Progressive::kOn};
  changed |= cut != schedule_.cut();
  schedule_.set_cut(cut);
  if (!std::exchange(scene_known_, true))
    record_epoch(now_s);
  else if (changed)
    next_epoch(now_s);  // another scene than that of the server before
}

void MasterCore::on(const std::string& peer, const wire::Hello& m, double now_s) {
  if (peers_.size() >= kMaxPeers && !peers_.contains(peer)) {
    const auto departed = std::find_if(peers_.begin(), peers_.end(), [](const auto& p) { return p.second.gone; });
    if (departed == peers_.end()) return;
    instances_.erase(departed->second.hello.instance);
    peers_.erase(departed);
  }
  // A process of the same name in a new life replaces the old one, whose socket may not be known to be dead yet.
  for (auto& [id, p] : peers_)
    if (id != peer && p.hello.role == m.role &&
        (p.hello.instance == m.instance || (m.role != "ctl" && p.hello.name == m.name))) {
      if (!p.gone) lose(p, id, "was replaced");
      p.process.replaced = true;
    }
  Peer& p = peers_[peer];
  const bool changed = p.hello.instance != m.instance || p.gone || p.hello.endpoints != m.endpoints;
  if (changed && m.role == "packer") {  // a new packer has none of the tiles that the old one had
    schedule_.drop_frames();
    volume_schedule_.drop_frames();
  }
  if (changed && m.role == "sampler") leave_partition(peer);  // a new one holds no slab yet
  instances_.erase(p.hello.instance);
  instances_[m.instance] = peer;
  p.hello = m;
  p.process.role = m.role;
  p.process.name = m.name;
  p.process.pid = m.pid;
  p.process.facts = m.facts;
  if (const auto at_once = m.facts.find("leases"); at_once != m.facts.end())
    p.leases_at_once = std::clamp(std::atoi(at_once->second.c_str()), 0, kMaxWaitingLeases);
  p.seen_s = now_s;
  p.gone = false;
  if (changed && m.role != "ctl") log::info("{} {} joined", m.role, m.name);
  if (m.role == "data") adopt_scene(m, now_s);
  wire::Welcome w = welcome(now_s);
  w.hello_sent_s = m.sent_s;
  emit(peer, w);
  if (changed && (!m.endpoints.empty() || m.role == "data")) announce(now_s);
  if (m.role == "sampler") join_partition(peer);
  if (volume_on_) dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::StatusReport& m, double now_s) {
  if (Peer* p = known(peer, now_s)) p->process.values = m.values;
}

void MasterCore::on(const std::string& peer, const wire::ViewRequest& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "viewer" || p->hello.instance != m.viewer) return;
  // The coarse pass looks a little beyond the view's edges, maybe beyond what a lease may.
  if (!geometry::validate(geometry::subsample(m.camera, kCoarseStep))) return;
  volume_on_ ? volume_schedule_.request_view(m) : schedule_.request_view(m);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseRequest&, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "sampler" || p->waiting_leases >= kMaxWaitingLeases) return;
  schedule_.heard_of(peer);
  join_partition(peer);
  if (p->waiting_leases++ == 0) idle_.push_back(peer);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseExtend& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "sampler") return;
  join_partition(peer);
  volume_on_ ? volume_schedule_.extend(m.lease, now_s) : schedule_.extend(m.lease, now_s);
}

void MasterCore::on(const std::string& peer, const wire::TileDone& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto by = instances_.find(m.sampler);
  const auto sampler = by == instances_.end() ? peers_.end() : peers_.find(by->second);
  const bool known_sampler = sampler != peers_.end();
  if (!(volume_on_ ? volume_schedule_.tile_done(m, now_s)
                   : schedule_.tile_done(m, known_sampler ? sampler->first : std::string(), now_s)))
    return;
  record_.add_tile(known_sampler ? sampler->second.hello.name : "?", m);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::Goodbye& m, double now_s) {
  auto it = peers_.find(peer);
  // A process whose own connection is busy says it over another.
  if (const auto by = instances_.find(m.instance); it == peers_.end() && by != instances_.end())
    it = peers_.find(by->second);
  if (it == peers_.end() || it->second.gone) return;
  const std::string id = it->first;  // not the other connection's
  lose(it->second, id, "left", true);
  dispatch(now_s);
}

Status MasterCore::on(const std::string& peer, const wire::MetricRows& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p) return ok_status();
  return record_.add_rows(p->process, m);
}

void MasterCore::on(const std::string& peer, const wire::Control& m, double now_s) {
  if (m.command == "status") return emit(peer, wire::ControlReply{true, status_json(now_s)});
  if (m.command == "stop") {
    emit(peer, wire::ControlReply{true, "stopping"});
    stop_ = true;
    return;
  }
  const auto done = obey(m, now_s);
  emit(peer, wire::ControlReply{done.ok(), done ? *done : done.error().text});
  if (done) dispatch(now_s);
}

Result<std::string> MasterCore::obey(const wire::Control& m, double now_s) {
  if (volume_on_ && (m.command == "set" || m.command == "animate" || m.command == "tf")) return obey_volume(m, now_s);
  if (m.command == "tf")
    return Error{facts_.empty() ? std::string("tf: there is no data server yet")
                                : fmt::format("tf: a scene of kind \"{}\" has no transfer function", scene_.kind())};
  if (m.command == "set")
    if (const Status s = scene_.set(m.arguments); !s) return s.error();
  if (m.command == "epoch" || m.command == "set") {
    next_epoch(now_s);
    return fmt::format("epoch {}", epoch_.value);
  }
  if (m.command == "animate") {
    const auto timeline = m.arguments.find("timeline");
    if (timeline == m.arguments.end())
      return Error{"animate: the argument timeline is missing, such as c.y=-0.4:0.4:10s, or off"};
    if (const Status s = scene_.animate(timeline->second); !s) return s.error();
    return "animation " + scene_.animation();
  }
  return Error{
      fmt::format("unknown command '{}'; known: status, stop, epoch, set, animate, tf", m.command.substr(0, 64))};
}

void MasterCore::undeliverable(const std::string& peer) {
  const auto it = peers_.find(peer);
  if (it != peers_.end() && !it->second.gone) lose(it->second, peer, "cannot be reached");
}

void MasterCore::lose(Peer& p, const std::string& routing_id, const char* why, bool said_goodbye) {
  p.gone = true;
  p.waiting_leases = 0;
  std::erase(idle_, routing_id);
  const int leases = schedule_.release_sampler(routing_id) + int(volume_schedule_.leases_of(routing_id));
  leave_partition(routing_id);
  if (p.hello.role == "data") volume_.leave(p.hello.instance);
  if (!said_goodbye) leases_expired_ += uint64_t(leases);  // the dead cannot finish: their leases end here
  if (p.hello.role == "viewer") {
    schedule_.forget_viewer(p.hello.instance);
    volume_schedule_.forget_viewer(p.hello.instance);
  }
  if (p.hello.role != "ctl") log::info("{} {} {}", p.hello.role, p.hello.name, why);
}

void MasterCore::tick(double now_s) {
  for (auto& [id, p] : peers_)
    if (!p.gone && now_s - p.seen_s > options_.silent_after_s) lose(p, id, "fell silent");
  const int expired = schedule_.expire(now_s, [&](const std::string& sampler) {
    const auto it = peers_.find(sampler);
    log::warn("a lease of sampler {} expired; its tile goes to another",
              it == peers_.end() ? "?" : it->second.hello.name);
  });
  leases_expired_ += uint64_t(expired);
  if (volume_on_) expire_slabs(now_s);
  dispatch(now_s);
}

bool MasterCore::begin_view(double now_s) {
  if (!scene_.animated()) return schedule_.begin_view(epoch_);
  // One view at a time, so that each epoch has a complete one; all who wait when an epoch begins are served from it, in turn.
  if (schedule_.frames_in_flight() > 0 || !schedule_.view_waiting()) return false;
  if (!schedule_.turn_waiting()) {
    if (scene_.step(now_s)) next_epoch(now_s);
    schedule_.begin_turns();
  }
  return schedule_.begin_view(epoch_, true);
}

bool MasterCore::lease_one(double now_s) {
  for (const bool even_own : {false, true})
    for (size_t i = 0; i < idle_.size(); ++i) {
      const std::string sampler = idle_[i];
      Peer& p = peers_[sampler];
      const auto lease =
          schedule_.lease(sampler, now_s, even_own, p.leases_at_once > 0 && p.waiting_leases >= p.leases_at_once);
      if (!lease) continue;
      idle_.erase(idle_.begin() + std::ptrdiff_t(i));
      if (--p.waiting_leases > 0) idle_.push_back(sampler);
      emit(sampler, *lease);
      return true;
    }
  return false;
}

void MasterCore::dispatch(double now_s) {
  if (volume_on_) update_partition(now_s);
  if (stop_ || idle_.empty() || !find_role("packer")) return;
  if (volume_on_) return dispatch_volume(now_s);
  while (!idle_.empty()) {
    if ((schedule_.tile_open() || schedule_.backup_due(now_s)) && lease_one(now_s)) continue;
    if (!begin_view(now_s)) return;
  }
}

std::string MasterCore::animation() const {
  if (volume_on_) return volume_.playing() ? "on" : "off";
  return scene_.animation();
}

void MasterCore::shut_down(const std::string& reason) {
  stop_ = true;
  for (const auto& [id, p] : peers_)
    if (!p.gone) emit(id, wire::Shutdown{reason});
}

bool MasterCore::everyone_left() const {
  return std::all_of(peers_.begin(), peers_.end(),
                     [](const auto& p) { return p.second.gone || p.second.hello.role == "ctl"; });
}

std::vector<Outgoing> MasterCore::take_outgoing() { return std::exchange(outgoing_, {}); }

std::vector<metrics::Process> MasterCore::processes() const {
  std::vector<metrics::Process> out;
  for (const auto& [id, p] : peers_)
    if (p.hello.role != "ctl") out.push_back(p.process);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

std::map<std::string, double> MasterCore::counters() const {
  return {{"leases_expired", double(leases_expired_)},
          {"tiles_released", double(schedule_.tiles_released() + volume_schedule_.slabs_released())},
          {"leases_backup", double(schedule_.backups())},
          {"frames_completed", double(schedule_.frames_completed() + volume_schedule_.frames_completed())},
          {"partitions", double(partitions_.made())},
          {"bytes_per_voxel", volume_on_ ? volume_.bytes_per_voxel() : 0}};
}

std::string MasterCore::status_json(double now_s) const {
  nlohmann::ordered_json out;
  out["epoch"] = epoch_.value;
  out["frames_completed"] = schedule_.frames_completed() + volume_schedule_.frames_completed();
  out["frames_in_flight"] = schedule_.frames_in_flight() + volume_schedule_.frames_in_flight();
  out["leases_expired"] = leases_expired_;
  out["tiles_released"] = schedule_.tiles_released() + volume_schedule_.slabs_released();
  out["leases_backup"] = schedule_.backups();
  out["parameters"] = nlohmann::ordered_json::object();
  for (const auto& [name, value] : volume_on_ ? volume_.values() : scene_.values()) out["parameters"][name] = value;
  out["animation"] = animation();
  if (volume_on_) out["volume"] = volume_status();
  out["processes"] = nlohmann::ordered_json::array();
  for (const auto& [id, p] : peers_) {
    if (p.hello.role == "ctl") continue;
    nlohmann::ordered_json e{{"role", p.hello.role},
                             {"name", p.hello.name},
                             {"pid", p.hello.pid},
                             {"alive", !p.gone},
                             {"silent_s", std::max(0.0, now_s - p.seen_s)}};
    if (p.hello.role == "sampler") e["leases"] = schedule_.leases_of(id) + volume_schedule_.leases_of(id);
    for (const auto& [key, value] : p.hello.endpoints) e["endpoints"][key] = value;
    for (const auto& [key, value] : p.hello.facts) e["facts"][key] = value;
    for (const auto& [key, value] : p.process.values) e["values"][key] = value;
    out["processes"].push_back(e);
  }
  return out.dump();
}

}  // namespace telesplat::master
