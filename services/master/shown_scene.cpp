#include "services/master/shown_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <string_view>

#include "common/core/log.h"
#include "common/points/point_model.h"
#include "common/scene/session.h"
#include "common/scene/settings.h"
#include "services/master/master_options.h"
#include "services/master/record/run_record.h"

namespace telesplat::master {

ShownScene::ShownScene(const MasterOptions& options, const PlanLinks& links)
    : options_(options), record_(links.record), clipping_(options.clip) {
  for (const auto kind : scene::kKinds)
    if (auto& plan = plans_[scene::pipeline_of(kind)]; !plan)
      plan = make_plan(scene::pipeline_of(kind), options_, links);
  plan_ = &plan_of({});
}

// A data server that names no kind, or one that this program does not know, is taken for one of points.
Plan& ShownScene::plan_of(const wire::Hello& data) const {
  const auto kind = scene::kind_named(scene::value_or(data.facts, "kind", std::string()));
  return *plans_.at(scene::pipeline_of(kind.value_or(scene::Kind::kMesh)));
}

Result<ShownScene::Adoption> ShownScene::adopt(const std::string& id, const wire::Hello& data, double now_s) {
  // The packer and viewers refuse a bad box; an empty one means to them that there is no scene.
  if (!data.box_room.empty())
    if (Status s = points::validate({.box_room = data.box_room}); !s) return s.error();
  Plan& plan = plan_of(data);
  if (options_.settings.pictures && &plan != plans_.at(scene::Pipeline::kPoints).get())
    return Error{"views of a volume do not come as pictures (--coupling images): they come as slice images"};
  const auto adopted = plan.adopt(data, now_s);
  if (!adopted) return adopted.error();
  if (!adopted->whole) return Adoption::kInParts;
  shown_by_ = id;
  const bool other_plan = plan_ != &plan;
  if (other_plan) {
    plan_->put_aside();
    plan.views().take_over(plan_->views());
    plan_ = &plan;
  }
  std::string problem;
  const bool other_clip = clipping_.adopt(data, problem);
  if (!problem.empty()) log::error("the scene of {}: {}", data.name, problem);
  kind_ = scene::kind_named(scene::value_or(data.facts, "kind", std::string()));
  if (!std::exchange(known_, true) && !adopted->in_parts) return Adoption::kFirst;
  // Another scene than that of the server before.
  return other_plan || adopted->changed || other_clip ? Adoption::kOther : Adoption::kSame;
}

Result<Obeyed> ShownScene::obey(const wire::Control& m) {
  if (m.command == "clip") return clipping_.obey(m);
  for (const char* of_plan : {"set", "animate", "tf", "colour", "play"})
    if (m.command == of_plan) return plan_->obey(m);
  if (m.command == "epoch") return Obeyed{.begins_epoch = true, .answer = {}};
  std::set<std::string_view> known{"status", "health", "stop", "epoch", "pick", "where", "go", "measure", "probe"};
  for (const auto& setting : scene::settings())
    if (setting.keeper != scene::Keeper::kNotes) known.insert(setting.order);
  return Error{fmt::format("unknown command '{}'; known: {}", m.command.substr(0, 64), fmt::join(known, ", "))};
}

void ShownScene::record_epoch(double now_s) const {
  if (!known_) return;
  auto texts = plan_->epoch_texts();
  texts[scene::kClipFact] = clipping_.text();
  record_.add_epoch(epoch_, now_s, describe().parameters, texts);
}

wire::Welcome ShownScene::describe() const {
  wire::Welcome w;
  w.octree_depth = options_.octree_depth;
  w.settings = master::settings(options_, kind_);
  plan_->describe(w);  // the scene stays what it is while its data server is away
  clipping_.describe(w);
  return w;
}

Figures ShownScene::figures() const {
  Figures out{.expired = leases_expired_};
  for (const auto& [pipeline, plan] : plans_) {
    const Figures f = plan->figures();
    out.frames_completed += f.frames_completed;
    out.frames_in_flight += f.frames_in_flight;
    out.released += f.released;
    out.backups += f.backups;
    out.overtaken += f.overtaken;
    out.given_up += f.given_up;
    out.viewers += f.viewers;
  }
  return out;
}

}  // namespace telesplat::master
