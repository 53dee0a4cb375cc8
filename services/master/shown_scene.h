// The scene that a session shows: its plans (one leads the session), its clip and its epochs. No sockets, no clocks.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "services/master/orders.h"
#include "services/master/plan.h"

namespace telesplat::master {

class ShownScene {
 public:
  /// The options and what the links refer to must outlive it.
  ShownScene(const MasterOptions& options, const PlanLinks& links);

  /// The plan that leads the session.
  Plan& plan() const { return *plan_; }
  /// The plan for this data server's kind of scene.
  Plan& plan_of(const wire::Hello& data) const;
  bool known() const { return known_; }
  EpochId epoch() const { return epoch_; }
  /// Routing id of the data server that the scene is of; empty: none yet.
  const std::string& shown_by() const { return shown_by_; }
  const std::string& clip_order() const { return clipping_.order(); }

  enum class Adoption {
    kInParts,  ///< data servers of other parts are still missing
    kSame,     ///< the scene looks as before
    kFirst,    ///< the session has its first scene
    kOther     ///< an epoch should begin
  };
  /// A data server (its routing id) said hello. Error: its scene cannot be shown.
  Result<Adoption> adopt(const std::string& id, const wire::Hello& data, double now_s);
  /// This data server's scene is refused.
  void refuse(const std::string& id) {
    if (shown_by_ == id) shown_by_.clear();
  }
  void leave_data(const wire::Hello& data) {
    data_left_ = true;
    for (auto& [pipeline, plan] : plans_) plan->leave_data(data.instance);
  }
  /// True once after data servers left.
  bool take_data_left() { return std::exchange(data_left_, false); }
  /// "set", "animate", "tf", "colour", "play", "clip". Error: what is wrong, for the person; then nothing changed.
  Result<Obeyed> obey(const wire::Control& command);
  void next_epoch() {
    epoch_ = epoch_.next();
    plan_->drop_frames();
  }
  /// Writes the epoch to the record once the scene is known.
  void record_epoch(double now_s) const;
  /// Settings, box, facts and parameters, as everyone is told them.
  wire::Welcome describe() const;

  // The following act on all plans, also on those that do not lead.
  void forget_viewer(InstanceId viewer) {
    for (auto& [pipeline, plan] : plans_) plan->views().forget_viewer(viewer);
  }
  void join(const std::string& sampler, double now_s) {
    for (auto& [pipeline, plan] : plans_) plan->join(sampler, now_s);
  }
  /// It is gone. died: it cannot finish what it was leased, so its leases end here.
  void release_sampler(const std::string& sampler, bool died = false) {
    for (auto& [pipeline, plan] : plans_) {
      const int leases = plan->release_sampler(sampler);
      if (died) leases_expired_ += uint64_t(leases);
    }
  }
  /// Ticks the plan that leads.
  Ticked tick(double now_s) {
    Ticked out = plan_->tick(now_s);
    leases_expired_ += uint64_t(out.expired);
    return out;
  }
  Figures figures() const;
  void add_counters(std::map<std::string, double>& counters) const {
    for (const auto& [pipeline, plan] : plans_) plan->add_counters(counters);
  }

 private:
  const MasterOptions& options_;
  metrics::RunRecord& record_;
  std::map<scene::Pipeline, std::unique_ptr<Plan>> plans_;
  Plan* plan_;  // the plan in plans_ that leads
  Clipping clipping_;
  std::optional<scene::Kind> kind_;
  bool known_ = false;
  EpochId epoch_{1};
  std::string shown_by_;
  bool data_left_ = false;
  uint64_t leases_expired_ = 0;
};

}  // namespace telesplat::master
