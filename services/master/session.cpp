// Tells processes of the session, and carries out what people order.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/scene/session.h"
#include "common/scene/settings.h"
#include "services/master/master_core.h"
#include "services/master/orders.h"

namespace telesplat::master {
namespace {

constexpr size_t kMostNamed = 16;     // names of viewers in an answer
constexpr size_t kMostOfEnder = 100;  // bytes of the sender's name in the reason to end

}  // namespace

Status MasterCore::adopt_scene(const std::string& peer, const wire::Hello& data, double now_s) {
  using Adoption = ShownScene::Adoption;
  const auto adopted = scene_.adopt(peer, data, now_s);
  if (!adopted) return adopted.error();
  if (*adopted == Adoption::kInParts) return ok_status();
  session_.kind = scene::value_or(data.facts, "kind", std::string());
  session_.scene = scene::value_or(data.facts, "scene", std::string());
  if (*adopted == Adoption::kFirst) scene_.record_epoch(now_s);
  if (*adopted == Adoption::kOther) next_epoch(now_s);
  return ok_status();
}

// Adds each endpoint from the process that has it; claims of others do not count. Each part of a volume has its own
// "voxels", which samplers get in their sheets.
void MasterCore::add_endpoints(wire::Welcome& w) const {
  const auto add = [&](const std::string& id, std::initializer_list<const char*> names) {
    const Peer* p = peers_.here(id);
    for (const char* name : names)
      if (p && p->hello.endpoints.contains(name)) w.endpoints.insert(*p->hello.endpoints.find(name));
  };
  add(scene_.shown_by(), {"chunks"});
  // While that data server is away, another one with the same mesh will do.
  const std::string hash = scene::value_or(w.facts, "content_hash", std::string());
  for (const auto& [id, p] : peers_)
    if (!hash.empty() && p.hello.role == "data" && !p.refused &&
        scene::value_or(p.hello.facts, "content_hash", std::string()) == hash)
      add(id, {"chunks"});
  add(peers_.packer(), {"tiles", "patches", "state"});
}

wire::Welcome MasterCore::welcome(const Peer& to, double now_s) const {
  wire::Welcome w = scene_.describe();
  w.master = instance_;
  w.master_s = now_s;
  w.clock = clock_id();
  w.epoch = scene_.epoch();
  add_endpoints(w);
  w.facts.erase(metrics::kRecordFact);  // for the master only
  if (std::string lacking = peers_.lacks(); !lacking.empty()) w.facts["lacks"] = std::move(lacking);
  if (!run_id_.empty()) {
    w.facts["run_folder"] = session_.run_folder;
    w.facts["run_id"] = run_id_;
  }
  if (to.hello.role == "packer") w.lease_key = outbox_.lease_key();
  if (to.coupling) {
    w.settings.coupling = to.coupling->mode;
    w.settings.buffers = to.coupling->buffers;
  }
  return w;
}

void MasterCore::announce_soon(double now_s) {
  if (announcements_.change(now_s)) announce(now_s);
}

void MasterCore::announce(double now_s) {
  announcements_.told(peers_.lacks(), now_s);
  const std::string body = wire::encode(welcome({}, now_s));
  if (!outbox_.fits<wire::Welcome>(body)) return;
  // The packer first: it should know an epoch before tiles of it come.
  for (const bool packer : {true, false})
    for (const auto& [id, p] : peers_)
      if (!p.gone && p.hello.role != "ctl" && (p.hello.role == "packer") == packer)
        outbox_.send(
            {id, std::string(wire::Welcome::kName), p.coupling || packer ? wire::encode(welcome(p, now_s)) : body});
}

void MasterCore::next_epoch(double now_s) {
  scene_.next_epoch();
  scene_.record_epoch(now_s);
  announce(now_s);
}

Status MasterCore::on(const std::string& peer, const wire::SliceWeights& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p) return ok_status();
  if (p->hello.role != "data" || p->hello.instance != m.data)
    return Error{fmt::format("slice weights of another process than {} {}", p->hello.role, p->hello.name)};
  if (Status s = scene_.plan_of(p->hello).weigh(m); !s) return s;
  dispatch(now_s);
  return ok_status();
}

void MasterCore::on(const std::string& peer, const wire::Control& m, double now_s, const std::string& key) {
  if (m.command == "status")
    return outbox_.send(peer, wire::ControlReply{true, status_json(now_s, m.arguments.contains("all"))});
  if (m.command == "health") return outbox_.send(peer, health(m, now_s));
  if (m.command == "stop") {
    outbox_.send(peer, wire::ControlReply{true, "stopping"});
    if (!stop_reason_) stop_reason_ = "the session was ended";
    // The sender chooses the argument "by" freely; its key is proven.
    if (const std::string by = scene::value_or(m.arguments, "by", std::string()); !by.empty())
      stop_reason_ = "the session was ended by " + printable(by, kMostOfEnder);
    if (!key.empty()) *stop_reason_ += fmt::format(" (key {})", key);
    return;
  }
  if (m.command == "done") return answer_of_launcher(peer, m);
  if (const std::string role = errand_for(m.command); !role.empty()) {
    if (const Status s = pass_on({peer, key.empty() ? peer : key}, m, role, now_s); !s)
      outbox_.send(peer, wire::ControlReply{false, s.error().text});
    return;
  }
  const auto done = obey(m, now_s);
  outbox_.send(peer, wire::ControlReply{done.ok(), done ? *done : done.error().text});
  if (done) dispatch(now_s);
}

void MasterCore::answer_of_launcher(const std::string& peer, const wire::Control& m) {
  const auto done = read_done(m);
  outbox_.send(peer, wire::ControlReply{done.ok(), done ? "heard" : done.error().text});
  if (!done) return;
  if (const auto reply = errands_.answered(Errands::kLauncher, *done)) outbox_.send(reply->peer, reply->reply);
}

wire::ControlReply MasterCore::health(const wire::Control& m, double now_s) const {
  HealthQuestion question(m);
  for (const auto& [id, p] : peers_)
    if (p.hello.role != "ctl") question.look_at(p.hello, p.gone, now_s - p.seen_s);
  const auto answer = question.answer();
  return {answer.ok(), answer ? *answer : answer.error().text};
}

// Sends an order to the viewer that it names; without a name, a setting goes to all viewers, a question to the first.
// An order to data servers goes to all of the scene: each knows its part. If viewers share a name, the one heard last
// is meant: the others may be its former lives.
Status MasterCore::pass_on(const Errands::Asker& asker, const wire::Control& m, const std::string& role, double now_s) {
  if (role == Errands::kLauncher) {
    const auto number = errands_.ask_launcher(asker, m, session_.started_by, now_s);
    return number ? ok_status() : Status(number.error());
  }
  const std::string wanted = role == "viewer" ? scene::value_or(m.arguments, "viewer", std::string()) : std::string();
  struct Here {
    std::string name;
    double unheard_s;  // since its last message
    std::string id;
    auto operator<=>(const Here&) const = default;
  };
  std::vector<Here> here;
  for (const auto& [id, p] : peers_)
    if (p.serves_as(role) && !p.refused) here.push_back({p.hello.name, now_s - p.seen_s, id});
  if (here.empty()) return Error{fmt::format("{}: no {} is here", m.command, role == "data" ? "data server" : role)};
  std::sort(here.begin(), here.end());
  if (!wanted.empty()) {
    std::set<std::string> names;
    for (const Here& h : here)
      if (names.size() < kMostNamed) names.insert(h.name);
    std::erase_if(here, [&](const Here& h) { return h.name != wanted; });
    if (here.empty())
      return Error{
          fmt::format("no {} is called \"{}\"; here is {}", role, wanted.substr(0, 64), fmt::join(names, ", "))};
  }
  if (role == "viewer" && (!wanted.empty() || !scene::setting_of_order(m.command))) here.resize(1);
  std::set<std::string> asked;
  for (const Here& h : here) asked.insert(h.id);
  const auto number = errands_.begin(asker, asked, now_s);
  if (!number) return number.error();
  for (const auto& id : asked) outbox_.send(id, wire::Order{*number, m.command, m.arguments});
  return ok_status();
}

void MasterCore::on(const std::string& peer, const wire::OrderAnswer& m, double now_s) {
  if (!known(peer, now_s)) return;
  if (const auto reply = errands_.answered(peer, m)) outbox_.send(reply->peer, reply->reply);
}

// Sets the coupling of viewers that are here; viewers that come later begin with their own.
Result<std::string> MasterCore::order_coupling(const wire::Control& m, double now_s) {
  if (options_.settings.pictures)
    return Error{
        "coupling: the views of this session come as pictures (--coupling images) from its beginning to its end"};
  const auto order = read_coupling(m);
  if (!order) return order.error();
  std::vector<std::string> here, told;
  for (auto& [id, p] : peers_) {
    if (!p.serves_as("viewer")) continue;
    here.push_back(p.hello.name);
    if (!order->viewer.empty() && order->viewer != p.hello.name) continue;
    p.coupling = *order;
    outbox_.send(id, welcome(p, now_s));
    told.push_back(p.hello.name);
  }
  if (here.empty()) return Error{"no viewer is here"};
  std::sort(here.begin(), here.end());
  here.resize(std::min(here.size(), kMostNamed));
  if (told.empty())
    return Error{
        fmt::format("no viewer is called \"{}\"; here is {}", order->viewer.substr(0, 64), fmt::join(here, ", "))};
  return fmt::format("{}: {}", told.size() == 1 ? told.front() : fmt::format("{} viewers", told.size()), order->text);
}

Result<std::string> MasterCore::obey(const wire::Control& m, double now_s) {
  if (m.command == "coupling") return order_coupling(m, now_s);
  const auto obeyed = scene_.obey(m);
  if (!obeyed) return obeyed.error();
  if (obeyed->tells_all) announce(now_s);
  if (!obeyed->begins_epoch) return obeyed->answer;
  next_epoch(now_s);
  return fmt::format("epoch {}", scene_.epoch().value);
}

}  // namespace telesplat::master
