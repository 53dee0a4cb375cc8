// Scenes that travel as points: a frame is cut into tiles, and each goes to the sampler that asks first.
#pragma once

#include "services/master/master_options.h"
#include "services/master/plan.h"
#include "services/master/tiles/frame_schedule.h"
#include "services/master/tiles/julia_parameters.h"
#include "services/master/tiles/mesh_colours.h"

namespace telesplat::master {

class TilePlan final : public Plan {
 public:
  TilePlan(const MasterOptions& options, const PlanLinks& links);

  Result<Adopted> adopt(const wire::Hello& data, double now_s) override;
  void describe(wire::Welcome& welcome) const override;
  std::map<std::string, std::string> epoch_texts() const override;
  Result<Obeyed> obey(const wire::Control& command) override;
  std::string animation() const override { return scene_.animation(); }
  bool playing() const override { return scene_.playing(); }
  bool step(double now_s) override { return scene_.step(now_s); }
  bool progressive() const override { return schedule_.cut().coarse; }

  Views& views() override { return schedule_; }
  void drop_frames() override { schedule_.drop_frames(); }
  void new_packer() override;
  void put_aside() override;
  /// Begins views whose plans are late without a plan; ends views that a newer one overtook.
  void prepare(double now_s) override;
  bool may_begin(const Idle&) override { return schedule_.view_waiting(); }
  bool begins_early(double now_s) const override { return schedule_.begins_early(now_s); }
  bool begin(EpochId epoch, bool turns_only, double now_s) override;
  void begin_extra(EpochId epoch, double now_s) override;
  Status planned(const wire::Plan& plan, double now_s) override;
  void give_leases(Idle& idle, double now_s) override;
  void on_link(const wire::LinkReport& link, double now_s) override { schedule_.on_link(link, now_s); }
  std::map<std::string, double> link_of(InstanceId viewer) const override { return schedule_.links().figures(viewer); }
  void extend(LeaseId lease, const std::string& sampler, double now_s) override {
    schedule_.extend(lease, sampler, now_s);
  }
  void refused(const wire::TileRefused& refused, const std::string& sampler, double now_s) override {
    schedule_.refused(refused, sampler, now_s);
  }
  bool done(const wire::TileDone& tile, const std::string& sampler, double now_s) override {
    return schedule_.tile_done(tile, sampler, now_s);
  }
  /// True while frames are in flight: a backup for an idle sampler may soon be due.
  bool hurried() const override { return schedule_.frames_in_flight() > 0; }
  Ticked tick(double now_s) override;
  void heard_of(const std::string& sampler) override { schedule_.heard_of(sampler); }
  int release_sampler(const std::string& sampler) override { return schedule_.release_sampler(sampler); }
  size_t leases_of(const std::string& sampler) const override { return schedule_.leases_of(sampler); }
  std::optional<double> stuck_s(const std::string& sampler, double now_s) const override {
    return schedule_.stuck_s(sampler, now_s);
  }
  Figures figures() const override;
  void add_status(nlohmann::ordered_json& status) const override;

 private:
  bool give_one(Idle& idle, double now_s);
  void ask_packer();
  void record_plans();

  MasterOptions options_;
  PlanLinks links_;
  FrameSchedule schedule_;
  JuliaParameters scene_;
  MeshColours colours_;
  geometry::Box box_room_;  // as the last data server sent it
  std::map<std::string, std::string> facts_;
};

}  // namespace telesplat::master
