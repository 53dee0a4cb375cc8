#include "services/master/tiles/tile_plan.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/core/log.h"
#include "services/master/record/run_record.h"
#include "services/master/outbox.h"

namespace telesplat::master {

TilePlan::TilePlan(const MasterOptions& options, const PlanLinks& links)
    : options_(options), links_(links), schedule_(options.schedule), scene_(options.animation) {}

Result<Adopted> TilePlan::adopt(const wire::Hello& data, double /*now_s*/) {
  box_room_ = data.box_room;
  facts_ = data.facts;
  std::string problem;
  Adopted out{.changed = scene_.adopt(data, problem)};
  out.changed |= colours_.adopt(data, problem);
  if (!problem.empty()) log::error("the scene of {}: {}", data.name, problem);
  const auto kind = scene::kind_named(scene_.kind());
  const bool pictures = options_.settings.pictures;
  const Cut cut{.rows = scene_.is_julia() && !pictures,
                .coarse = master::progressive(options_, kind),
                .coarse_if_slow = options_.progressive == Progressive::kAuto && !pictures,
                .steered = master::settings(options_, kind).steering,
                .pictures = pictures};
  out.changed |= cut != schedule_.cut();
  schedule_.set_cut(cut);
  return out;
}

void TilePlan::describe(wire::Welcome& welcome) const {
  welcome.box_room = box_room_;
  welcome.facts = facts_;
  welcome.parameters = scene_.values();
  colours_.describe(welcome);
}

std::map<std::string, std::string> TilePlan::epoch_texts() const {
  if (scene_.is_julia()) return {};
  return {{scene::kColouringFact, colours_.text()}};
}

Result<Obeyed> TilePlan::obey(const wire::Control& m) {
  if (m.command == "tf")
    return Error{facts_.empty() ? std::string("tf: there is no data server yet")
                                : fmt::format("tf: a scene of kind \"{}\" has no transfer function", scene_.kind())};
  if (m.command == "colour") return colours_.obey(m);
  if (m.command == "set") {
    if (const Status s = scene_.set(m.arguments); !s) return s.error();
    return Obeyed{.begins_epoch = true, .answer = {}};
  }
  if (m.command == "play") {
    const auto order = read_play(m);
    if (!order) return order.error();
    const auto other = scene_.play(*order);
    if (!other) return other.error();
    return Obeyed{.begins_epoch = *other, .answer = "animation " + scene_.animation()};
  }
  const auto timeline = m.arguments.find("timeline");
  if (timeline == m.arguments.end())
    return Error{"animate: the argument timeline is missing, such as c.y=-0.4:0.4:10s, or off"};
  if (const Status s = scene_.animate(timeline->second); !s) return s.error();
  return Obeyed{.begins_epoch = false, .answer = "animation " + scene_.animation()};
}

void TilePlan::add_status(nlohmann::ordered_json& status) const {
  if (const auto& c = colours_.now())
    status["colouring"] = {{"array", c->array}, {"unit", c->unit}, {"lo", c->lo}, {"hi", c->hi}, {"map", c->map.name}};
  if (const std::string waits = colours_.waits_for(); !waits.empty()) status["colouring_order"] = waits;
}

void TilePlan::new_packer() {
  schedule_.trust_packer();
  schedule_.drop_frames();
}

// The packer forgets what it published of this plan's scene, so it will not report that it arrived.
void TilePlan::put_aside() {
  schedule_.forget_links();
  schedule_.drop_frames();
}

void TilePlan::prepare(double now_s) {
  schedule_.give_up_plans(now_s);
  record_plans();
  schedule_.end_overtaken(now_s);
  const std::string packer = links_.packer();
  for (const auto& end : schedule_.take_ends(now_s))
    if (!packer.empty()) links_.outbox.send(packer, end);
}

bool TilePlan::begin(EpochId epoch, bool turns_only, double now_s) {
  const bool begun = schedule_.begin_view(epoch, turns_only, now_s);
  ask_packer();
  return begun;
}

// Animations get no rays beyond views: their next epoch has no use for them.
void TilePlan::begin_extra(EpochId epoch, double now_s) {
  if (playing()) return;
  schedule_.begin_extra(epoch, now_s);
  ask_packer();
}

void TilePlan::ask_packer() {
  const auto questions = schedule_.take_questions();
  if (questions.empty()) return;
  const std::string packer = links_.packer();
  if (packer.empty()) return;  // it is gone: a new one drops the frames
  for (const auto& question : questions) links_.outbox.send(packer, question);
}

Status TilePlan::planned(const wire::Plan& plan, double now_s) {
  const Status taken = schedule_.take_plan(plan, now_s);
  record_plans();
  return taken;
}

void TilePlan::record_plans() {
  for (const auto& row : schedule_.take_plan_rows())
    links_.record.add_plan(links_.name_of_instance(row.asked.viewer), row);
}

void TilePlan::give_leases(Idle& idle, double now_s) {
  while (!idle.empty() && (schedule_.tile_open() || schedule_.backup_due(now_s)) && give_one(idle, now_s)) {
  }
}

bool TilePlan::give_one(Idle& idle, double now_s) {
  for (const bool even_own : {false, true})
    for (size_t i = 0; i < idle.size(); ++i) {
      auto lease = schedule_.lease(idle[i].id, now_s, even_own, idle[i].holds_none());
      if (!lease) continue;
      links_.outbox.send_lease(idle[i].id, *lease);
      idle.served(i);
      return true;
    }
  return false;
}

Ticked TilePlan::tick(double now_s) {
  const int expired = schedule_.expire(now_s, [&](const std::string& sampler) {
    log::warn("a lease of sampler {} expired; its tile goes to another", links_.name_of(sampler));
  });
  for (const auto& [sampler, delivers] : schedule_.take_news(now_s))
    if (delivers)
      log::info("sampler {} delivers again", links_.name_of(sampler));
    else
      log::warn("sampler {} takes work and has delivered nothing for {:.0f} s: what others wait for goes to others",
                links_.name_of(sampler), kTold_s);
  return {.expired = expired, .overdue = {}};
}

Figures TilePlan::figures() const {
  return {.frames_completed = schedule_.frames_completed(),
          .frames_in_flight = schedule_.frames_in_flight(),
          .released = schedule_.tiles_released(),
          .backups = schedule_.backups(),
          .given_up = schedule_.given_up(),
          .overtaken = schedule_.overtaken(),
          .viewers = schedule_.viewers_remembered()};
}

}  // namespace telesplat::master
