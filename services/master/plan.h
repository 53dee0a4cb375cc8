// What differs by pipeline (scene::Pipeline) at the master: what a scene is, and how its views become leases.
// MasterCore knows no more of a scene than this. No sockets, no clocks: messages and times come in, messages go to
// PlanLinks::outbox.
//
// MasterCore has a plan a pipeline; one of them leads the session. The others remember what their data servers said of
// them, and know who samples, but have no views, no frames and no leases.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"
#include "services/master/control.h"
#include "services/master/idle.h"
#include "services/master/views.h"

namespace telesplat::metrics {
class RunRecord;
}

namespace telesplat::master {

class Outbox;
struct MasterOptions;

/// What a hello of a data server came to.
struct Adopted {
  bool whole = true;      ///< data servers of all parts have been there: the plan may lead the session
  bool changed = false;   ///< the scene is another than before, or looks otherwise
  bool in_parts = false;  ///< of several servers: the first ones were welcomed when the scene was not known yet
};

/// What is shown, and what changes it.
class Scene {
 public:
  virtual ~Scene() = default;
  /// A data server said hello. Error: what it says is refused, and nothing changed.
  virtual Result<Adopted> adopt(const wire::Hello& data, double now_s) = 0;
  /// A data server is gone; the scene stays.
  virtual void leave_data(InstanceId /*data*/) {}
  /// Fills in the scene: box, facts, parameters, and settings that it changed itself.
  virtual void describe(wire::Welcome& welcome) const = 0;
  /// Texts that change with the epoch, for the run's record.
  virtual std::map<std::string, std::string> epoch_texts() const { return {}; }
  /// "set", "animate", "play", "tf", "colour". Error: what is wrong, for the person; then nothing changed.
  virtual Result<Obeyed> obey(const wire::Control& command) = 0;
  /// As status and session.toml tell it.
  virtual std::string animation() const = 0;
  /// It changes with time: each epoch has one instant of it, which everyone who waits is shown in turn.
  virtual bool playing() const = 0;
  /// Takes the instant of now_s. True: it looks otherwise.
  virtual bool step(double now_s) = 0;
  /// Views arrive coarse first.
  virtual bool progressive() const { return false; }
  /// What slices weigh. Error: the sender's fault, or of a scene that has none.
  virtual Status weigh(const wire::SliceWeights& /*weights*/) {
    return Error{"slice weights, but the data server's scene has no slices"};
  }
};

/// Leases that a tick() found wanting.
struct Ticked {
  int expired = 0;                   ///< leases that ran out
  std::vector<std::string> overdue;  ///< samplers of which one would like to know whether they live
};

struct Figures {
  uint64_t frames_completed = 0, frames_in_flight = 0;
  uint64_t released = 0;   ///< leases that were taken back
  uint64_t backups = 0;    ///< leases of what another sampler was slow with
  uint64_t given_up = 0;   ///< frames that ended without tiles or slabs that cannot be had
  uint64_t overtaken = 0;  ///< views that ended early, because their viewer's link is slow and a newer one waited
  uint64_t viewers = 0;    ///< of whom anything is remembered
};

/// How views become frames and leases. Samplers are named by their routing ids.
class Schedule {
 public:
  virtual ~Schedule() = default;
  virtual Views& views() = 0;
  /// New epoch, new packer: the frames' views wait again.
  virtual void drop_frames() = 0;
  /// The packer is another than before: it has none of the tiles that the old one had.
  virtual void new_packer() { drop_frames(); }
  /// Another plan leads the session from now on: drops the frames.
  virtual void put_aside() { drop_frames(); }

  /// To be called whenever something came, before leases are given: what must be settled first.
  virtual void prepare(double /*now_s*/) {}
  /// A view waits, and of the idle samplers there is one that would go on with it at once.
  virtual bool may_begin(const Idle& idle) = 0;
  /// Views may begin though no sampler is idle: they may need none.
  virtual bool begins_early(double /*now_s*/) const { return false; }
  /// Begins the frame or frames of the next view. turns_only: of one whose viewer has a turn. False: none, or enough
  /// are in flight.
  virtual bool begin(EpochId epoch, bool turns_only, double now_s) = 0;
  /// To be called when no view is left to begin.
  virtual void begin_extra(EpochId /*epoch*/, double /*now_s*/) {}
  /// The packer's plan of a frame. Error: the packer's fault.
  virtual Status planned(const wire::Plan& /*plan*/, double /*now_s*/) { return ok_status(); }
  /// Gives out all leases that idle samplers can have of the frames in flight.
  virtual void give_leases(Idle& idle, double now_s) = 0;
  /// Gives a lease of this sampler its full time again, up to ScheduleOptions::longest_fetch_s. Others are ignored.
  virtual void extend(LeaseId lease, const std::string& sampler, double now_s) = 0;
  /// The packer cannot use what this sampler (empty: unknown) made of a tile.
  virtual void refused(const wire::TileRefused& refused, const std::string& sampler, double now_s) = 0;
  /// The packer has this tile, from `sampler` (empty: unknown). False: it has it twice, or nobody waits for it any
  /// more.
  virtual bool done(const wire::TileDone& tile, const std::string& sampler, double now_s) = 0;
  /// How a viewer's link does.
  virtual void on_link(const wire::LinkReport& /*link*/, double /*now_s*/) {}
  /// The same for status; empty: nothing is known of it.
  virtual std::map<std::string, double> link_of(InstanceId /*viewer*/) const { return {}; }
  /// A lease may be due before the next tick of 20 ms, if somebody is idle.
  virtual bool hurried() const { return false; }
  /// To be called every 50 ms or so.
  virtual Ticked tick(double now_s) = 0;

  /// A sampler is here; also for plans that do not lead.
  virtual void join(const std::string& /*sampler*/, double /*now_s*/) {}
  /// It asks for work: it is through with what it had.
  virtual void heard_of(const std::string& /*sampler*/) {}
  /// It holds its slab of a partition.
  virtual void slab_ready(const std::string& /*sampler*/, const wire::SlabReady& /*slab*/) {}
  /// It is gone; also for plans that do not lead. Returns how many leases it held.
  virtual int release_sampler(const std::string& sampler) = 0;
  virtual size_t leases_of(const std::string& sampler) const = 0;
  /// Seconds for which it was leased work and delivered nothing; nullopt: it delivers, or has not had the time.
  virtual std::optional<double> stuck_s(const std::string& /*sampler*/, double /*now_s*/) const { return std::nullopt; }
  virtual Figures figures() const = 0;
};

class Plan : public Scene, public Schedule {
 public:
  /// More for the status that `telesplat ctl status` prints, and for summary.json.
  virtual void add_status(nlohmann::ordered_json& /*status*/) const {}
  virtual void add_counters(std::map<std::string, double>& /*counters*/) const {}
};

/// What plans see of the master. Must outlive them.
struct PlanLinks {
  Outbox& outbox;
  metrics::RunRecord& record;
  /// For people; "?": it is not known.
  std::function<std::string(const std::string& sampler)> name_of;
  std::function<std::string(InstanceId)> name_of_instance;  ///< likewise
  /// Routing id of the packer; empty: there is none.
  std::function<std::string()> packer;
};

/// The one place that knows which plan is for which pipeline.
std::unique_ptr<Plan> make_plan(scene::Pipeline pipeline, const MasterOptions& options, const PlanLinks& links);

}  // namespace telesplat::master
