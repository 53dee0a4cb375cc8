#include "services/master/master_core.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/scene/session.h"
#include "services/master/peers.h"
#include "services/master/record/measured.h"

namespace telesplat::master {
namespace {

constexpr size_t kMaxDeparted = 1024;  // processes that left and are remembered
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
                const auto p = peers_.find(id);
                return p == peers_.end() ? InstanceId{} : p->second.hello.instance;
              }),
      clipping_(options.clip) {
  const auto name_of = [this](const std::string& id) {
    const auto p = peers_.find(id);
    return p == peers_.end() ? std::string("?") : p->second.hello.name;
  };
  const auto name_of_instance = [this, name_of](InstanceId instance) {
    const auto id = instances_.find(instance);
    return id == instances_.end() ? std::string("?") : name_of(id->second);
  };
  const PlanLinks links{
      .outbox = outbox_, .record = record_, .name_of = name_of, .name_of_instance = name_of_instance, .packer = [this] {
        return packer();
      }};
  for (const auto kind : scene::kKinds)
    if (auto& plan = plans_[scene::pipeline_of(kind)]; !plan)
      plan = make_plan(scene::pipeline_of(kind), options_, links);
  plan_ = &plan_of({});
  told_lacks_ = lacks();
}

// ---- processes that take part ---------------------------------------------------------------------------------------

MasterCore::Peer* MasterCore::known(const std::string& peer, double now_s) {
  const auto it = peers_.find(peer);
  if (it == peers_.end() || it->second.gone) {
    outbox_.send(peer, wire::WhoAreYou{instance_});
    return nullptr;
  }
  it->second.seen_s = now_s;
  return &it->second;
}

MasterCore::Peer* MasterCore::known_sampler(const std::string& peer, double now_s) {
  Peer* p = known(peer, now_s);
  return p && p->hello.role == "sampler" ? p : nullptr;
}

std::string MasterCore::packer() const {
  auto longest = peers_.end();
  for (auto p = peers_.begin(); p != peers_.end(); ++p)
    if (!p->second.gone && p->second.hello.role == "packer" &&
        (longest == peers_.end() || p->second.joined < longest->second.joined))
      longest = p;
  return longest == peers_.end() ? std::string() : longest->first;
}

// Begins anew with another packer: it has nothing of what the packer before it had.
void MasterCore::follow_packer() {
  const std::string now = packer();
  if (now.empty() || now == leading_packer_) return;
  leading_packer_ = now;
  plan_->new_packer();
}

// If a packer that waited takes the place of one that is gone, sends its endpoints to everyone.
void MasterCore::follow_another_packer(double now_s) {
  const bool gone = leading_packer_.empty();
  follow_packer();
  if (gone && !leading_packer_.empty()) announce(now_s);
}

bool MasterCore::samplers_here() const {
  return std::any_of(peers_.begin(), peers_.end(),
                     [](const auto& p) { return !p.second.gone && p.second.hello.role == "sampler"; });
}

std::string MasterCore::lacks() const {
  std::vector<std::string> out;
  for (const char* role : {"data", "packer", "sampler"})
    if (std::none_of(peers_.begin(), peers_.end(),
                     [&](const auto& p) { return !p.second.gone && !p.second.refused && p.second.hello.role == role; }))
      out.emplace_back(role);
  return fmt::format("{}", fmt::join(out, ","));
}

// Makes room for a process: forgets one that left if kMaxDeparted are remembered. False: max_peers are here.
bool MasterCore::make_room(const std::string& peer) {
  const auto before = peers_.find(peer);
  if (before != peers_.end() && !before->second.gone) return true;
  const auto here = size_t(std::count_if(peers_.begin(), peers_.end(), [](const auto& p) { return !p.second.gone; }));
  if (here >= options_.limits.max_peers) return false;
  if (before != peers_.end() || peers_.size() < here + kMaxDeparted) return true;
  const auto departed = std::find_if(peers_.begin(), peers_.end(), [](const auto& p) { return p.second.gone; });
  if (departed == peers_.end()) return true;
  forget(departed->second, departed->first);
  peers_.erase(departed);
  return true;
}

void MasterCore::forget(const Peer& p, const std::string& routing_id) {
  if (const auto by = instances_.find(p.hello.instance); by != instances_.end() && by->second == routing_id)
    instances_.erase(by);
  if (p.hello.role != "ctl") departed_.add(p.process);
}

void MasterCore::forget_departed(double now_s) {
  std::erase_if(peers_, [&](const auto& entry) {
    const auto& [id, p] = entry;
    if (!p.gone || (p.hello.role != "ctl" && now_s - p.seen_s < Departed::kAfter_s)) return false;
    forget(p, id);
    return true;
  });
}

// A restarted process replaces the old one of its name, whose socket may not be known to be dead yet. If both live,
// both stay: they would replace each other for ever.
void MasterCore::replace_namesakes(const std::string& peer, const wire::Hello& m, double now_s) {
  const auto before = peers_.find(peer);
  const bool here = before != peers_.end() && !before->second.gone && before->second.hello.instance == m.instance;
  const bool lives_on = namesakes_.lives_on(m.instance, now_s);
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
      if (!moved) namesakes_.replaced(p.hello.instance, now_s);
    }
    p.process.replaced = true;
  }
}

MasterCore::Peer& MasterCore::enter(const std::string& peer, const wire::Hello& m, double now_s) {
  Peer& p = peers_[peer];
  if (p.hello.instance != m.instance || p.hello.role != m.role) {
    forget_viewer(p.hello);
    p.coupling.reset();
  }
  if (p.hello.instance != m.instance || p.hello.role != m.role || p.gone)
    p.joined = ++joined_, p.process.replaced = false;
  live_.set_here(p.hello.role, p.hello.name, false);  // its name may be another now
  instances_.erase(p.hello.instance);
  instances_[m.instance] = peer;
  p.hello = m;
  p.process.role = m.role;
  p.process.name = m.name;
  p.process.pid = m.pid;
  p.process.facts = m.facts;
  const std::string at_once = scene::value_or(m.facts, "leases", std::string());
  if (!at_once.empty()) p.leases_at_once = std::clamp(std::atoi(at_once.c_str()), 0, kMaxWaitingLeases);
  if (p.gone) p.reports.clear();
  p.seen_s = now_s;
  p.gone = p.refused = p.process.lost = false;
  live_.set_here(m.role, m.name, true);
  return p;
}

bool MasterCore::serves(const std::string& peer) const {
  const auto p = peers_.find(peer);
  const std::string role = p == peers_.end() || p->second.gone ? std::string() : p->second.hello.role;
  return role == "data" || role == "packer" || role == "sampler";
}

bool MasterCore::admit(const std::string& peer, double now_s) {
  const auto p = peers_.find(peer);
  const bool packer = p != peers_.end() && !p->second.gone && p->second.hello.role == "packer";
  return packer || gate_.admit(peer, now_s);
}

// Sends the reason with Shutdown, so that the process ends: it could do nothing here.
void MasterCore::refuse(const std::string& peer, const wire::Hello& m, const std::string& why, double now_s) {
  gate_.refuse_hello();
  if (gate_.may_log(now_s)) log::warn("{} {} is refused: {}", printable(m.role, 64), printable(m.name, 128), why);
  outbox_.send(peer, wire::Shutdown{why});
}

void MasterCore::on(const std::string& peer, const wire::Hello& m, double now_s) {
  if (const Status fits = check_hello(m); !fits) return refuse(peer, m, fits.error().text, now_s);
  if (!make_room(peer))
    return refuse(peer, m, fmt::format("{} processes take part already (--max-peers)", options_.limits.max_peers),
                  now_s);
  if (const auto said = peers_.find(peer); said != peers_.end()) {
    if (!said->second.hello_pace.allows(now_s)) return void(said->second.put_off = m);
    said->second.hello_pace.count(now_s);
    said->second.put_off.reset();
  }
  replace_namesakes(peer, m, now_s);
  const auto before = peers_.find(peer);
  const bool changed = before == peers_.end() || before->second.hello.instance != m.instance || before->second.gone ||
                       before->second.hello.endpoints != m.endpoints;
  if (changed && peer == leading_packer_) leading_packer_.clear();
  if (changed && m.role == "sampler")
    for (auto& [pipeline, plan] : plans_) plan->release_sampler(peer);  // a new process holds no leases yet
  Peer& p = enter(peer, m, now_s);
  if (m.role == "packer") follow_packer();
  if (changed && m.role != "ctl" && gate_.may_log(now_s)) log::info("{} {} joined", m.role, m.name);
  const EpochId epoch = epoch_;
  if (m.role == "data")
    if (const Status s = adopt_scene(peer, m, now_s); !s) {
      p.refused = true;
      if (shows_ == peer) shows_.clear();
      if (gate_.may_log(now_s)) log::error("the scene of {} is refused: {}", m.name, s.error().text);
    }
  wire::Welcome w = welcome(p, now_s);
  w.hello_sent_s = m.sent_s;
  outbox_.send(peer, w);
  if (changed && epoch == epoch_ && (!m.endpoints.empty() || m.role == "data")) announce_soon(now_s);
  if (m.role == "sampler") join(peer, now_s);
  dispatch(now_s);
}

// Adopts scenes that were refused because they did not fit beside the scene of a data server that has left.
void MasterCore::adopt_refused(double now_s) {
  for (auto& [id, p] : peers_) {
    if (p.gone || !p.refused || p.hello.role != "data" || !adopt_scene(id, p.hello, now_s)) continue;
    p.refused = false;
    announce_soon(now_s);
  }
}

void MasterCore::take_put_off_hellos(double now_s) {
  std::vector<std::pair<std::string, wire::Hello>> due;
  for (const auto& [id, p] : peers_)
    if (p.put_off && p.hello_pace.allows(now_s)) due.emplace_back(id, *p.put_off);
  for (const auto& [id, hello] : due)
    if (const auto p = peers_.find(id); p != peers_.end() && p->second.put_off) on(id, hello, now_s);
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
  auto it = peers_.find(peer);
  // A process whose own connection is busy says goodbye over another.
  if (const auto by = instances_.find(m.instance); it == peers_.end() && by != instances_.end())
    it = peers_.find(by->second);
  if (it == peers_.end() || it->second.gone) return;
  const std::string id = it->first;  // the process' own, not the other connection's
  lose(it->second, id, "left", true);
  follow_another_packer(now_s);
  dispatch(now_s);
}

void MasterCore::undeliverable(const std::string& peer) {
  for (auto& [name, wall] : walls_) wall.unreachable(peer, now_s_);
  send_swaps();
  const auto it = peers_.find(peer);
  if (it != peers_.end() && !it->second.gone) lose(it->second, peer, "cannot be reached");
}

// Forgets the viewer in all plans, too: others may have led while it was here.
void MasterCore::forget_viewer(const wire::Hello& hello) {
  if (hello.role != "viewer") return;
  for (auto& [pipeline, plan] : plans_) plan->views().forget_viewer(hello.instance);
  for (auto& [name, wall] : walls_) wall.forget(hello.instance, now_s_);
  send_swaps();
}

void MasterCore::lose(Peer& p, const std::string& routing_id, const char* why, bool said_goodbye) {
  p.gone = true;
  p.process.lost = !said_goodbye;
  p.put_off.reset();
  if (routing_id == leading_packer_) leading_packer_.clear();
  live_.set_here(p.hello.role, p.hello.name, false);
  idle_.remove(routing_id);
  int leases = 0;
  data_left_ = data_left_ || p.hello.role == "data";
  for (auto& [pipeline, plan] : plans_) {
    leases += plan->release_sampler(routing_id);
    if (p.hello.role == "data") plan->leave_data(p.hello.instance);
  }
  if (!said_goodbye) leases_expired_ += uint64_t(leases);  // the dead cannot finish: their leases end here
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
  const auto by = instances_.find(m.viewer);
  const auto viewer = by == instances_.end() ? peers_.end() : peers_.find(by->second);
  // An unknown viewer says hello over its other connection, and then sends this again.
  if (viewer == peers_.end() || viewer->second.gone || viewer->second.hello.role != "viewer") return;
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
    swaps_.frames += wall->second.figures().frames;
    swaps_.incomplete += wall->second.figures().incomplete;
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
  plan_->views().spending().asked(m.viewer, guest, now_s);
  plan_->views().request_view(request);
  dispatch(now_s);
}

void MasterCore::join(const std::string& sampler, double now_s) {
  for (auto& [pipeline, plan] : plans_) plan->join(sampler, now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseRequest&, double now_s) {
  const Peer* p = known_sampler(peer, now_s);
  if (!p || !idle_.add(peer, p->leases_at_once)) return;
  plan_->heard_of(peer);
  join(peer, now_s);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LeaseExtend& m, double now_s) {
  if (!known_sampler(peer, now_s)) return;
  join(peer, now_s);
  plan_->extend(m.lease, peer, now_s);
}

void MasterCore::on(const std::string& peer, const wire::SlabReady& m, double now_s) {
  if (!known_sampler(peer, now_s)) return;
  join(peer, now_s);
  plan_->slab_ready(peer, m);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::TileDone& m, double now_s) {
  Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto by = instances_.find(m.sampler);
  const auto sampler = by == instances_.end() ? peers_.end() : peers_.find(by->second);
  const bool known_sampler = sampler != peers_.end();
  if (!plan_->done(m, known_sampler ? sampler->first : std::string(), now_s)) return;
  const std::string& name = known_sampler ? sampler->second.hello.name : std::string("?");
  record_.add_tile(name, m);
  live_.add_tile(name, m, known_sampler && !sampler->second.gone);
  dispatch(now_s);
}

// Passes a refusal on with the sampler's routing id. One that is gone is not known any more, and its leases are back.
void MasterCore::on(const std::string& peer, const wire::TileRefused& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto by = instances_.find(m.sampler);
  if (by == instances_.end()) return;
  const auto sampler = peers_.find(by->second);
  if (sampler == peers_.end()) return;
  plan_->refused(m, sampler->first, now_s);
  if (refused_tiles_.allow(now_s))
    log::warn("{} cannot use what sampler {} made of tile {} of frame {}: {}", p->hello.name,
              sampler->second.hello.name, m.tile, m.frame.value, m.why);
  dispatch(now_s);
}

void MasterCore::on(const std::string& peer, const wire::LinkReport& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return;
  const auto by = instances_.find(m.viewer);
  const auto viewer = by == instances_.end() ? peers_.end() : peers_.find(by->second);
  if (viewer == peers_.end() || viewer->second.gone || viewer->second.hello.role != "viewer") return;
  plan_->on_link(m, now_s);
  dispatch(now_s);
}

Status MasterCore::on(const std::string& peer, const wire::Plan& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p || p->hello.role != "packer") return ok_status();
  const std::string name = p->hello.name;
  const Status taken = plan_->planned(m, now_s);
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
  forget_departed(now_s);
  if (std::exchange(data_left_, false)) adopt_refused(now_s);
  follow_another_packer(now_s);
  if (announce_due_ || told_lacks_ != lacks()) announce_soon(now_s);
  for (const auto& [peer, reply] : errands_.overdue(now_s)) outbox_.send(peer, reply);
  const Ticked ticked = now_s < leases_rest_until_s_ ? Ticked{} : plan_->tick(now_s);
  leases_expired_ += uint64_t(ticked.expired);
  // Send a message to each overdue sampler: if it died, the message is undeliverable, long before its lease runs out.
  for (const auto& sampler : ticked.overdue)
    if (const auto p = peers_.find(sampler); p != peers_.end() && now_s - p->second.probed_s > kProbeEvery_s) {
      p->second.probed_s = now_s;
      outbox_.send(sampler, welcome(p->second, now_s));
    }
  dispatch(now_s);
}

bool MasterCore::begin_view(double now_s) {
  if (!plan_->may_begin(idle_)) return false;
  if (!plan_->playing()) return plan_->begin(epoch_, false, now_s);
  // One view at a time, so that each epoch has a complete one. All viewers that wait when an epoch begins are served
  // from it, in turn.
  if (plan_->views().views_in_flight() > 0) return false;
  if (!plan_->views().turn_waiting()) {
    if (plan_->step(now_s)) next_epoch(now_s);
    plan_->views().begin_turns();
  }
  return plan_->begin(epoch_, true, now_s);
}

void MasterCore::dispatch(double now_s) {
  plan_->prepare(now_s);
  const bool early = plan_->begins_early(now_s) && samplers_here();
  // Before a scene is known, the pipeline is not; samplers that served another master may ask for leases already.
  if (stop_ || !scene_known_ || (idle_.empty() && !early) || packer().empty()) return;
  do plan_->give_leases(idle_, now_s);
  while ((!idle_.empty() || early) && begin_view(now_s));
  if (early) plan_->begin_extra(epoch_, now_s);
}

void MasterCore::shut_down(const std::string& reason) {
  stop_ = true;
  log::info("{}", reason);
  for (const auto& [id, p] : peers_)
    if (!p.gone) outbox_.send(id, wire::Shutdown{reason});
}

bool MasterCore::everyone_left() const {
  return std::all_of(peers_.begin(), peers_.end(),
                     [](const auto& p) { return p.second.gone || p.second.hello.role == "ctl"; });
}

}  // namespace telesplat::master
