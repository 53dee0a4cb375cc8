#include "services/master/master_core.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/scene/session.h"
#include "services/master/record/measured.h"

namespace telesplat::master {
namespace {

constexpr size_t kMaxWalls = 64;
constexpr size_t kMostOfTableName = 32;  // bytes, in error texts
constexpr double kCatchUp_s = 0.5;       // after this process stood still: time to read all that has come
constexpr double kProbeEvery_s = 0.25;   // between probes of an overdue sampler
constexpr size_t kReports = 5;           // kept of each process, one a second; rates compare the first and the last

// True for data servers of two parts of a volume: neither is the other's new life, even if their names are equal.
bool hold_different_parts(const wire::Hello& a, const wire::Hello& b) {
  const auto of_a = a.parameters.find("volume.part"), of_b = b.parameters.find("volume.part");
  return of_a != a.parameters.end() && of_b != b.parameters.end() && of_a->second != of_b->second;
}

}  // namespace

MasterCore::MasterCore(const MasterOptions& options, InstanceId instance, metrics::RunRecord& record)
    : options_(options),
      instance_(instance),
      record_(record),
      outbox_(instance,
              [this](const std::string& id) {
                const Peer* p = peers_.find(id);
                return p ? p->hello.instance : InstanceId{};
              }),
      scene_(options_, plan_links()) {}

PlanLinks MasterCore::plan_links() {
  return {.outbox = outbox_,
          .record = record_,
          .name_of =
              [this](const std::string& id) {
                const Peer* p = peers_.find(id);
                return p ? p->hello.name : std::string("?");
              },
          .name_of_instance =
              [this](InstanceId instance) {
                const auto* p = peers_.find(instance);
                return p ? p->second.hello.name : std::string("?");
              },
          .packer = [this] { return peers_.packer(); }};
}

// ---- processes that take part ---------------------------------------------------------------------------------------

Peer* MasterCore::known(const std::string& peer, double now_s) {
  Peer* p = peers_.find(peer);
  if (!p || p->gone) {
    outbox_.send(peer, wire::WhoAreYou{instance_});
    return nullptr;
  }
  p->seen_s = now_s;
  return p;
}

Peer* MasterCore::known_sampler(const std::string& peer, double now_s) {
  Peer* p = known(peer, now_s);
  return p && p->hello.role == "sampler" ? p : nullptr;
}

// Begins anew with another packer: it has nothing of what the packer before it had.
void MasterCore::follow_packer() {
  if (peers_.follow_packer()) plan().new_packer();
}

// If a packer that waited takes the place of one that is gone, sends its endpoints to everyone.
void MasterCore::follow_another_packer(double now_s) {
  const bool gone = !peers_.leads_packer();
  follow_packer();
  if (gone && peers_.leads_packer()) announce(now_s);
}

// A restarted process replaces the old one of its name, whose socket may not be known to be dead yet. If both live,
// both stay: they would replace each other for ever.
void MasterCore::replace_namesakes(const std::string& peer, const wire::Hello& m, double now_s) {
  const Peer* before = peers_.here(peer);
  const bool here = before && before->hello.instance == m.instance;
  const bool lives_on = peers_.namesakes().lives_on(m.instance, now_s);
  bool told = false;
  for (auto& [id, p] : peers_) {
    if (id == peer || p.hello.role != m.role) continue;
    const bool moved = p.hello.instance == m.instance;  // the process changed its connection
    if (!moved && (m.role == "ctl" || p.hello.name != m.name || hold_different_parts(p.hello, m))) continue;
    if (!moved && !p.gone && (here || lives_on)) {
      if (!here && !std::exchange(told, true) && gate_.may_log(now_s))
        log::warn("two processes of the role {} are called {}: give one another --name", m.role, m.name);
      continue;
    }
    if (!p.gone) {
      lose(p, id, "was replaced");
      if (!moved) peers_.namesakes().replaced(p.hello.instance, now_s);
    }
    p.process.replaced = true;
  }
}

Peer& MasterCore::enter(const std::string& peer, const wire::Hello& m, double now_s) {
  if (const Peer* before = peers_.find(peer)) {
    const wire::Hello& hello = before->hello;
    const bool another = hello.instance != m.instance || hello.role != m.role;
    if (another && peers_.speaks_for(peer, hello.instance)) forget_viewer(hello);
    live_.set_here(hello.role, hello.name, false);  // its name may be another now
  }
  live_.set_here(m.role, m.name, true);
  return peers_.enter(peer, m, now_s);
}

// Sends the reason with Shutdown, so that the process ends: it could do nothing here.
void MasterCore::refuse(const std::string& peer, const wire::Hello& m, const std::string& why, double now_s) {
  gate_.refuse_hello();
  if (gate_.may_log(now_s)) log::warn("{} {} is refused: {}", printable(m.role, 64), printable(m.name, 128), why);
  outbox_.send(peer, wire::Shutdown{why});
}

void MasterCore::on(const std::string& peer, const wire::Hello& m, double now_s) {
  if (const Status fits = check_hello(m); !fits) return refuse(peer, m, fits.error().text, now_s);
  if (!peers_.make_room(peer, options_.limits.max_peers))
    return refuse(peer, m, fmt::format("{} processes take part already (--max-peers)", options_.limits.max_peers),
                  now_s);
  if (Peer* said = peers_.find(peer)) {
    if (!said->hello_pace.allows(now_s)) return void(said->put_off = m);
    said->hello_pace.count(now_s);
    said->put_off.reset();
  }
  replace_namesakes(peer, m, now_s);
  const Peer* before = peers_.here(peer);
  const bool changed = !before || before->hello.instance != m.instance || before->hello.endpoints != m.endpoints;
  if (changed) peers_.leave_packer(peer);
  if (changed && m.role == "sampler") scene_.release_sampler(peer);  // a new process holds no leases yet
  Peer& p = enter(peer, m, now_s);
  if (m.role == "packer") follow_packer();
  if (changed && m.role != "ctl" && gate_.may_log(now_s)) log::info("{} {} joined", m.role, m.name);
  const EpochId epoch = scene_.epoch();
  if (m.role == "data")
    if (const Status s = adopt_scene(peer, m, now_s); !s) {
      p.refused = true;
      scene_.refuse(peer);
      if (gate_.may_log(now_s)) log::error("the scene of {} is refused: {}", m.name, s.error().text);
    }
  wire::Welcome w = welcome(p, now_s);
  w.hello_sent_s = m.sent_s;
  outbox_.send(peer, w);
  if (changed && epoch == scene_.epoch() && (!m.endpoints.empty() || m.role == "data")) announce_soon(now_s);
  if (m.role == "sampler") scene_.join(peer, now_s);
  dispatch(now_s);
}

// Adopts scenes that were refused because they did not fit beside the scene of a data server that has left.
void MasterCore::adopt_refused(double now_s) {
  for (auto& [id, p] : peers_) {
    if (!p.serves_as("data") || !p.refused || !adopt_scene(id, p.hello, now_s)) continue;
    p.refused = false;
    announce_soon(now_s);
  }
}

void MasterCore::take_put_off_hellos(double now_s) {
  std::vector<std::pair<std::string, wire::Hello>> due;
  for (const auto& [id, p] : peers_)
    if (p.put_off && p.hello_pace.allows(now_s)) due.emplace_back(id, *p.put_off);
  for (const auto& [id, hello] : due)
    if (const Peer* p = peers_.find(id); p && p->put_off) on(id, hello, now_s);
}

void MasterCore::on(const std::string& peer, const wire::StatusReport& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || m.values.empty()) return;  // a report without values is only a sign of life
  p->process.values = m.values;
  if (p->hello.role == "viewer") record_.add_status(p->process);
  p->reports.push_back(m.values);
  if (p->reports.size() > kReports) p->reports.pop_front();
}

void MasterCore::on(const std::string& peer, const wire::Goodbye& m, double now_s) {
  Peer* p = peers_.find(peer);
  std::string id = peer;
  // A process whose own connection is busy says goodbye over another.
  if (auto* by = p ? nullptr : peers_.find(m.instance)) std::tie(id, p) = std::pair(by->first, &by->second);
  if (!p || p->gone) return;
  lose(*p, id, "left", true);
  follow_another_packer(now_s);
  dispatch(now_s);
}

void MasterCore::undeliverable(const std::string& peer) {
  for (auto& [name, wall] : walls_) wall.unreachable(peer, now_s_);
  send_swaps();
  if (Peer* p = peers_.find(peer); p && !p->gone) lose(*p, peer, "cannot be reached");
}

// Forgets the viewer in all plans, too: others may have led while it was here.
void MasterCore::forget_viewer(const wire::Hello& hello) {
  if (hello.role != "viewer") return;
  scene_.forget_viewer(hello.instance);
  for (auto& [name, wall] : walls_) wall.forget(hello.instance, now_s_);
  send_swaps();
}

void MasterCore::lose(Peer& p, const std::string& routing_id, const char* why, bool said_goodbye) {
  p.gone = true;
  p.process.lost = !said_goodbye;
  p.put_off.reset();
  peers_.leave_packer(routing_id);
  live_.set_here(p.hello.role, p.hello.name, false);
  idle_.remove(routing_id);
  scene_.release_sampler(routing_id, !said_goodbye);
  if (p.hello.role == "data") scene_.leave_data(p.hello);
  forget_viewer(p.hello);
  for (const auto& [peer, reply] : errands_.lost(routing_id)) outbox_.send(peer, reply);
  if (p.hello.role != "ctl" && gate_.may_log(now_s_)) log::info("{} {} {}", p.hello.role, p.hello.name, why);
}

Status MasterCore::on(const std::string& peer, const wire::MetricRows& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p) return ok_status();
  if (m.table != "spans" && (p->hello.role != "viewer" || m.columns != metrics::viewer_columns(m.table)))
    return Error{fmt::format("table {} of a {}: its columns are not those that viewers tell",
                             to_utf8(m.table.substr(0, kMostOfTableName)), p->hello.role)};
  Status added = record_.add_rows(p->process, m);
  if (added) live_.add_rows(p->hello.name, m);
  return added;
}

// ---- walls ----------------------------------------------------------------------------------------------------------

void MasterCore::on(const std::string& peer, const wire::SwapReady& m, double now_s) {
  now_s_ = now_s;
  auto* viewer = peers_.find(m.viewer);
  // An unknown viewer says hello over its other connection, and then sends this again.
  if (!viewer || !viewer->second.serves_as("viewer")) return;
  viewer->second.seen_s = now_s;
  if (walls_.size() >= kMaxWalls && !walls_.contains(m.wall)) return;
  walls_.try_emplace(m.wall, instance_).first->second.on(peer, m, now_s);
  send_swaps();
}

void MasterCore::send_swaps() {
  for (auto wall = walls_.begin(); wall != walls_.end();) {
    for (const auto& [peer, swap] : wall->second.take_outgoing()) outbox_.send(peer, swap);
    if (!wall->second.empty()) {
      ++wall;
      continue;
    }
    swaps_ += wall->second.figures();
    wall = walls_.erase(wall);
  }
}

std::optional<double> MasterCore::due_s() const {
  std::optional<double> out;
  for (const auto& [name, wall] : walls_)
    if (const auto due_s = wall.due_s(); due_s && (!out || *due_s < *out)) out = due_s;
  return out;
}

// ---- leases ---------------------------------------------------------------------------------------------------------

void MasterCore::on(const std::string& peer, const wire::ViewRequest& m, double now_s, const std::string& guest) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "viewer" || p->hello.instance != m.viewer) return;
  // The coarse pass goes a little beyond the view's edges, maybe further than a lease may: such a view is dropped.
  wire::ViewRequest request = gate_.admit(m);
  if (!geometry::validate(geometry::subsample(request.camera, kCoarseStep))) return;
  request.moments = {.requested_s = m.moments.requested_s, .received_s = now_s};
  plan().views().spending().asked(m.viewer, guest, now_s);
  plan().views().request_view(request);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseRequest&, double now_s) {
  const Peer* p = known_sampler(peer, now_s);
  if (!p || !idle_.add(peer, p->leases_at_once)) return;
  plan().heard_of(peer);
  scene_.join(peer, now_s);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseExtend& m, double now_s) {
  if (!known_sampler(peer, now_s)) return;
  scene_.join(peer, now_s);
  plan().extend(m.lease, peer, now_s);
}

void MasterCore::on(const std::string& peer, const wire::SlabReady& m, double now_s) {
  if (!known_sampler(peer, now_s)) return;
  scene_.join(peer, now_s);
  plan().slab_ready(peer, m);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::TileDone& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto* sampler = peers_.find(m.sampler);
  if (!plan().done(m, sampler ? sampler->first : std::string(), now_s)) return;
  const std::string name = sampler ? sampler->second.hello.name : "?";
  record_.add_tile(name, m);
  live_.add_tile(name, m, sampler && !sampler->second.gone);
  dispatch(now_s);
}

// Passes a refusal on with the sampler's routing id. One that is gone is not known any more, and its leases are back.
void MasterCore::on(const std::string& peer, const wire::TileRefused& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto* sampler = peers_.find(m.sampler);
  if (!sampler) return;
  plan().refused(m, sampler->first, now_s);
  if (refused_tiles_.allow(now_s))
    log::warn("{} cannot use what sampler {} made of tile {} of frame {}: {}", p->hello.name,
              sampler->second.hello.name, m.tile, m.frame.value, m.why);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LinkReport& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto* viewer = peers_.find(m.viewer);
  if (!viewer || !viewer->second.serves_as("viewer")) return;
  plan().on_link(m, now_s);
  dispatch(now_s);
}

Status MasterCore::on(const std::string& peer, const wire::Plan& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return ok_status();
  const std::string name = p->hello.name;
  const Status taken = plan().planned(m, now_s);
  dispatch(now_s);
  if (taken) return taken;
  return Error{fmt::format("{}: {}", name, taken.error().text)};
}

void MasterCore::stood_still(double for_s, double now_s) {
  for (auto& [id, p] : peers_)
    if (!p.gone) p.seen_s += for_s;
  leases_rest_until_s_ = now_s + kCatchUp_s;
}

void MasterCore::tick(double now_s) {
  now_s_ = now_s;
  for (auto& [name, wall] : walls_) wall.tick(now_s);
  send_swaps();
  take_put_off_hellos(now_s);
  for (auto& [id, p] : peers_)
    if (!p.gone && now_s - p.seen_s > options_.silent_after_s) lose(p, id, "fell silent");
  peers_.forget_departed(now_s);
  if (scene_.take_data_left()) adopt_refused(now_s);
  follow_another_packer(now_s);
  if (announcements_.due(peers_.lacks())) announce_soon(now_s);
  for (const auto& [peer, reply] : errands_.overdue(now_s)) outbox_.send(peer, reply);
  const Ticked ticked = now_s < leases_rest_until_s_ ? Ticked{} : scene_.tick(now_s);
  // Send a message to each overdue sampler: if it died, the message is undeliverable, long before its lease runs out.
  for (const auto& sampler : ticked.overdue)
    if (Peer* p = peers_.find(sampler); p && now_s - p->probed_s > kProbeEvery_s) {
      p->probed_s = now_s;
      outbox_.send(sampler, welcome(*p, now_s));
    }
  dispatch(now_s);
}

bool MasterCore::begin_view(double now_s) {
  if (!plan().may_begin(idle_)) return false;
  if (!plan().playing()) return plan().begin(scene_.epoch(), false, now_s);
  // One view at a time, so that each epoch has a complete one. All viewers that wait when an epoch begins are served
  // from it, in turn.
  if (plan().views().views_in_flight() > 0) return false;
  if (!plan().views().turn_waiting()) {
    if (plan().step(now_s)) next_epoch(now_s);
    plan().views().begin_turns();
  }
  return plan().begin(scene_.epoch(), true, now_s);
}

void MasterCore::dispatch(double now_s) {
  plan().prepare(now_s);
  const bool early = plan().begins_early(now_s) && peers_.has("sampler");
  // Before a scene is known, the pipeline is not; samplers that served another master may ask for leases already.
  if (stop_reason_ || !scene_.known() || (idle_.empty() && !early) || !peers_.has("packer")) return;
  do plan().give_leases(idle_, now_s);
  while ((!idle_.empty() || early) && begin_view(now_s));
  if (early) plan().begin_extra(scene_.epoch(), now_s);
}

void MasterCore::shut_down(const std::string& reason) {
  if (!stop_reason_) stop_reason_ = reason;
  log::info("{}", reason);
  for (const auto& [id, p] : peers_)
    if (!p.gone) outbox_.send(id, wire::Shutdown{reason});
}

bool MasterCore::everyone_left() const {
  return std::all_of(peers_.begin(), peers_.end(),
                     [](const auto& p) { return p.second.gone || p.second.hello.role == "ctl"; });
}

}  // namespace telesplat::master
