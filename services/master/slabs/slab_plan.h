// Scenes that travel as slice images: samplers hold slabs of the volume, and each has a part in every frame.
#pragma once

#include "common/core/token_bucket.h"
#include "services/master/plan.h"
#include "services/master/slabs/partition.h"
#include "services/master/slabs/scene.h"
#include "services/master/slabs/schedule.h"

namespace telesplat::master {

class SlabPlan final : public Plan {
 public:
  SlabPlan(const MasterOptions& options, const PlanLinks& links);

  /// If the server has another volume than before, and servers of its other parts are missing, nothing is shown until
  /// they come.
  Result<Adopted> adopt(const wire::Hello& data, double now_s) override;
  void leave_data(InstanceId data) override { volume_.leave(data); }
  void describe(wire::Welcome& welcome) const override;
  std::map<std::string, std::string> epoch_texts() const override;
  Result<Obeyed> obey(const wire::Control& command) override;
  std::string animation() const override { return volume_.playing() ? "on" : "off"; }
  bool playing() const override { return volume_.playing(); }
  bool step(double now_s) override { return volume_.step(now_s); }
  Status weigh(const wire::SliceWeights& weights) override;

  Views& views() override { return schedule_; }
  void drop_frames() override { schedule_.drop_frames(); }
  /// Drops the frames. Samplers drop their slabs: these are cut and fetched anew when this plan leads again.
  void put_aside() override;
  void prepare(double now_s) override;
  bool may_begin(const Idle& idle) override;
  bool begin(EpochId epoch, bool turns_only, double now_s) override;
  void give_leases(Idle& idle, double now_s) override;
  void extend(LeaseId lease, const std::string& sampler, double now_s) override {
    schedule_.extend(lease, sampler, now_s);
  }
  void refused(const wire::TileRefused& refused, const std::string& sampler, double now_s) override;
  bool done(const wire::TileDone& tile, const std::string& sampler, double now_s) override;
  /// True if views of a wall wait: they may soon begin without a late one.
  bool hurried() const override { return schedule_.walls_here() && schedule_.view_waiting(); }
  Ticked tick(double now_s) override;
  void join(const std::string& sampler, double now_s) override;
  void heard_of(const std::string& sampler) override { asked_.insert(sampler); }
  void slab_ready(const std::string& sampler, const wire::SlabReady& slab) override;
  int release_sampler(const std::string& sampler) override;
  size_t leases_of(const std::string& sampler) const override { return schedule_.leases_of(sampler); }
  Figures figures() const override;

  void add_status(nlohmann::ordered_json& status) const override;
  void add_counters(std::map<std::string, double>& counters) const override;

 private:
  /// A sampler whose lease ran out, or whose slab cannot be used.
  struct Failed {
    double since_s = 0;
    double wait_s = 0, until_s = 0;  ///< it gets no slab for wait_s, until until_s; twice as long each time
    bool asks = false;               ///< it wants a slab again
  };
  void fail(const std::string& sampler, bool asks, double now_s);
  Result<Obeyed> set(std::map<std::string, std::string> arguments);
  void assign(const Partition& partition, double now_s);

  PlanLinks links_;
  VolumeScene volume_;
  VolumeSchedule schedule_;
  SlabPartitions partitions_;
  std::map<std::string, Failed> failed_;
  std::set<std::string> asked_;  // samplers that ask for work since their newest lease
  bool whole_ = false;           // all parts of the volume are known; partitions and schedule follow it
  double since_s_ = 0;           // when the volume became whole, or was replaced
  TokenBucket log_{10, 200};     // limits log lines about hellos to what a person can read
};

}  // namespace telesplat::master
