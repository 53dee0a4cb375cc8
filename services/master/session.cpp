// The scene of a session, its epochs, and the commands that begin them.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/utf8.h"
#include "common/points/point_model.h"
#include "common/scene/session.h"
#include "common/scene/settings.h"
#include "services/master/master_core.h"
#include "services/master/orders.h"

namespace telesplat::master {
namespace {

constexpr size_t kMostNamed = 16;     // names of viewers in an answer
constexpr size_t kMostOfEnder = 100;  // bytes of the sender's name in the reason to end

}  // namespace

// A data server that names no kind, or one that this program does not know, is taken for one of points.
Plan& MasterCore::plan_of(const wire::Hello& data) {
  const auto kind = scene::kind_named(scene::value_or(data.facts, "kind", std::string()));
  return *plans_.at(scene::pipeline_of(kind.value_or(scene::Kind::kMesh)));
}

Status MasterCore::adopt_scene(const std::string& peer, const wire::Hello& data, double now_s) {
  // The packer and viewers refuse a bad box; an empty one means to them that there is no scene.
  if (!data.box_room.empty())
    if (Status s = points::validate({.box_room = data.box_room}); !s) return s;
  Plan& plan = plan_of(data);
  if (options_.settings.pictures && &plan != plans_.at(scene::Pipeline::kPoints).get())
    return Error{"views of a volume do not come as pictures (--coupling images): they come as slice images"};
  const auto adopted = plan.adopt(data, now_s);
  if (!adopted) return adopted.error();
  if (!adopted->whole) return ok_status();
  shows_ = peer;
  const bool other_plan = plan_ != &plan;
  if (other_plan) {
    plan_->put_aside();
    plan.views().take_over(plan_->views());
    plan_ = &plan;
  }
  std::string problem;
  const bool other_clip = clipping_.adopt(data, problem);
  if (!problem.empty()) log::error("the scene of {}: {}", data.name, problem);
  session_.kind = scene::value_or(data.facts, "kind", std::string());
  session_.scene = scene::value_or(data.facts, "scene", std::string());
  kind_ = scene::kind_named(session_.kind);
  if (!std::exchange(scene_known_, true) && !adopted->in_parts)
    record_epoch(now_s);
  else if (other_plan || adopted->changed || other_clip)
    next_epoch(now_s);  // the scene differs from the one before
  return ok_status();
}

wire::Welcome MasterCore::scene_as_told() const {
  wire::Welcome w;
  w.octree_depth = octree_depth();
  w.settings = master::settings(options_, kind_);
  plan_->describe(w);  // the scene stays what it is while its data server is away
  clipping_.describe(w);
  return w;
}

// Adds each endpoint from the process that has it; claims of others do not count. Each part of a volume has its own
// "voxels", which samplers get in their sheets.
void MasterCore::add_endpoints(wire::Welcome& w) const {
  const auto add = [&](const std::string& id, std::initializer_list<const char*> names) {
    const auto p = peers_.find(id);
    if (p == peers_.end() || p->second.gone) return;
    for (const char* name : names)
      if (const auto at = p->second.hello.endpoints.find(name); at != p->second.hello.endpoints.end())
        w.endpoints.insert(*at);
  };
  add(shows_, {"chunks"});
  // While that data server is away, another one with the same mesh will do.
  const std::string hash = scene::value_or(w.facts, "content_hash", std::string());
  for (const auto& [id, p] : peers_)
    if (!hash.empty() && p.hello.role == "data" && !p.refused &&
        scene::value_or(p.hello.facts, "content_hash", std::string()) == hash)
      add(id, {"chunks"});
  add(packer(), {"tiles", "patches", "state"});
}

wire::Welcome MasterCore::welcome(const Peer& to, double now_s) const {
  wire::Welcome w = scene_as_told();
  w.master = instance_;
  w.master_s = now_s;
  w.clock = clock_id();
  w.epoch = epoch_;
  add_endpoints(w);
  w.facts.erase(metrics::kRecordFact);  // for the master only
  if (std::string lacking = lacks(); !lacking.empty()) w.facts["lacks"] = std::move(lacking);
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

// Sends a welcome to everyone now, or later if that would exceed the pace announcements_.
void MasterCore::announce_soon(double now_s) {
  announce_due_ = !announcements_.allows(now_s);
  if (!announce_due_) announce(now_s);
}

void MasterCore::announce(double now_s) {
  announcements_.count(now_s);
  announce_due_ = false;
  told_lacks_ = lacks();
  const std::string body = wire::encode(welcome({}, now_s));
  if (!outbox_.fits<wire::Welcome>(body)) return;
  // The packer first: it should know an epoch before tiles of it come.
  for (const bool packer : {true, false})
    for (const auto& [id, p] : peers_)
      if (!p.gone && p.hello.role != "ctl" && (p.hello.role == "packer") == packer)
        outbox_.send(
            {id, std::string(wire::Welcome::kName), p.coupling || packer ? wire::encode(welcome(p, now_s)) : body});
}

void MasterCore::record_epoch(double now_s) {
  if (!scene_known_) return;
  auto texts = plan_->epoch_texts();
  texts[scene::kClipFact] = clipping_.text();
  record_.add_epoch(epoch_, now_s, scene_as_told().parameters, texts);
}

void MasterCore::next_epoch(double now_s) {
  epoch_ = epoch_.next();
  plan_->drop_frames();
  record_epoch(now_s);
  announce(now_s);
}

Status MasterCore::on(const std::string& peer, const wire::SliceWeights& m, double now_s) {
  const Peer* p = known(peer, now_s);
  if (!p) return ok_status();
  if (p->hello.role != "data" || p->hello.instance != m.data)
    return Error{fmt::format("slice weights of another process than {} {}", p->hello.role, p->hello.name)};
  if (Status s = plan_of(p->hello).weigh(m); !s) return s;
  dispatch(now_s);
  return ok_status();
}

void MasterCore::on(const std::string& peer, const wire::Control& m, double now_s, const std::string& key) {
  if (m.command == "status")
    return outbox_.send(peer, wire::ControlReply{true, status_json(now_s, m.arguments.contains("all"))});
  if (m.command == "health") return outbox_.send(peer, health(m, now_s));
  if (m.command == "stop") {
    outbox_.send(peer, wire::ControlReply{true, "stopping"});
    stop_ = true;
    // The sender chooses the argument "by" freely; its key is proven.
    if (const std::string by = scene::value_or(m.arguments, "by", std::string()); !by.empty())
      stop_reason_ = "the session was ended by " + printable(by, kMostOfEnder);
    if (!key.empty()) stop_reason_ += fmt::format(" (key {})", key);
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
    if (!p.gone && !p.refused && p.hello.role == role) here.push_back({p.hello.name, now_s - p.seen_s, id});
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
    if (p.gone || p.hello.role != "viewer") continue;
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
  Obeyed obeyed{.begins_epoch = true, .answer = {}};  // for "epoch"
  if (m.command == "set" || m.command == "animate" || m.command == "tf" || m.command == "colour" ||
      m.command == "play") {
    auto by_scene = plan_->obey(m);
    if (!by_scene) return by_scene.error();
    obeyed = *std::move(by_scene);
  } else if (m.command == "clip") {
    auto clipped = clipping_.obey(m);
    if (!clipped) return clipped.error();
    obeyed = *std::move(clipped);
  } else if (m.command != "epoch") {
    std::set<std::string_view> known{"status", "health", "stop", "epoch", "pick", "where", "go", "measure", "probe"};
    for (const auto& setting : scene::settings())
      if (setting.keeper != scene::Keeper::kNotes) known.insert(setting.order);
    return Error{fmt::format("unknown command '{}'; known: {}", m.command.substr(0, 64), fmt::join(known, ", "))};
  }
  if (obeyed.tells_all) announce(now_s);
  if (!obeyed.begins_epoch) return obeyed.answer;
  next_epoch(now_s);
  return fmt::format("epoch {}", epoch_.value);
}

}  // namespace telesplat::master
