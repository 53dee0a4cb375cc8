// Interface to all that differs by pipeline (scene::Pipeline) at the master: the scene, and the way from its views to
// leases. MasterCore knows no more of a scene than this. No sockets, no clocks: messages and times come in, messages go
// to PlanLinks::outbox.
//
// MasterCore has one plan per pipeline; one of them leads the session. The others remember the hellos of their data
// servers, and the samplers, but have no views, no frames and no leases.
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
#include "services/master/peers/idle.h"
#include "services/master/views.h"

namespace telesplat::metrics {
class RunRecord;
}

namespace telesplat::master {

class Outbox;
struct MasterOptions;

/// Outcome of a data server's hello.
struct Adopted {
  bool whole = true;      ///< data servers of all parts have said hello: the plan may lead the session
  bool changed = false;   ///< the scene is another one, or looks different
  bool in_parts = false;  ///< several servers have the scene: the first were welcomed before it was known
};

/// The scene that is shown, and the commands that change it.
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
  /// Returns the animation as status and session.toml show it.
  virtual std::string animation() const = 0;
  /// True if the scene changes with time: each epoch has one instant of it, which all viewers that wait get in turn.
  virtual bool playing() const = 0;
  /// Moves to the instant of now_s. True: the scene looks different.
  virtual bool step(double now_s) = 0;
  /// True if views arrive coarse first.
  virtual bool progressive() const { return false; }
  /// Takes the weights of slices. Error: the sender's fault, or the scene has no slices.
  virtual Status weigh(const wire::SliceWeights& /*weights*/) {
    return Error{"slice weights, but the data server's scene has no slices"};
  }
};

/// Late leases that a tick() found.
struct Ticked {
  int expired = 0;                   ///< leases that ran out
  std::vector<std::string> overdue;  ///< samplers with late leases: they may be dead
};

struct Figures {
  uint64_t frames_completed = 0, frames_in_flight = 0;
  uint64_t expired = 0;    ///< leases that ran out, or whose sampler fell silent
  uint64_t released = 0;   ///< leases that were taken back
  uint64_t backups = 0;    ///< tiles that were leased to a second sampler, as the first was slow
  uint64_t given_up = 0;   ///< frames that ended without tiles or slabs that cannot be had
  uint64_t overtaken = 0;  ///< views that ended early, because their viewer's link is slow and a newer one waited
  uint64_t viewers = 0;    ///< viewers that are remembered
};

/// Makes frames and leases of views. Samplers are named by their routing ids.
class Schedule {
 public:
  virtual ~Schedule() = default;
  virtual Views& views() = 0;
  /// Drops the frames, for a new epoch or packer; their views wait again.
  virtual void drop_frames() = 0;
  /// Another packer leads: it has no tiles of the old one.
  virtual void new_packer() { drop_frames(); }
  /// Another plan leads the session from now on: drops the frames.
  virtual void put_aside() { drop_frames(); }

  /// Does what must be done before leases are given. To be called after each message.
  virtual void prepare(double /*now_s*/) {}
  /// True if a view waits, and an idle sampler would go on with it at once.
  virtual bool may_begin(const Idle& idle) = 0;
  /// True if views may begin though no sampler is idle: they may need no sampler.
  virtual bool begins_early(double /*now_s*/) const { return false; }
  /// Begins the frame or frames of the next view. turns_only: only of viewers that have a turn. False: no view waits,
  /// or enough are in flight.
  virtual bool begin(EpochId epoch, bool turns_only, double now_s) = 0;
  /// To be called when no view is left to begin.
  virtual void begin_extra(EpochId /*epoch*/, double /*now_s*/) {}
  /// Takes the packer's plan of a frame. Error: the packer's fault.
  virtual Status planned(const wire::Plan& /*plan*/, double /*now_s*/) { return ok_status(); }
  /// Gives out all leases that idle samplers can have of the frames in flight.
  virtual void give_leases(Idle& idle, double now_s) = 0;
  /// Gives a lease of this sampler its full time again, up to ScheduleOptions::longest_fetch_s. Ignores others.
  virtual void extend(LeaseId lease, const std::string& sampler, double now_s) = 0;
  /// The packer cannot use this sampler's tile. sampler: empty: unknown.
  virtual void refused(const wire::TileRefused& refused, const std::string& sampler, double now_s) = 0;
  /// The packer has this tile, from `sampler` (empty: unknown). False: it came twice, or its frame is not in flight
  /// any more.
  virtual bool done(const wire::TileDone& tile, const std::string& sampler, double now_s) = 0;
  /// Takes a report about a viewer's link.
  virtual void on_link(const wire::LinkReport& /*link*/, double /*now_s*/) {}
  /// Returns figures of a viewer's link, for status; empty: nothing is known of it.
  virtual std::map<std::string, double> link_of(InstanceId /*viewer*/) const { return {}; }
  /// True if a lease for an idle sampler may be due before the next tick, in 20 ms.
  virtual bool hurried() const { return false; }
  /// Takes back leases that ran out. To be called every 50 ms or so.
  virtual Ticked tick(double now_s) = 0;

  /// A sampler is here; called for plans that do not lead, too.
  virtual void join(const std::string& /*sampler*/, double /*now_s*/) {}
  /// A sampler asks for work: it has finished what it had.
  virtual void heard_of(const std::string& /*sampler*/) {}
  /// A sampler holds its slab of a partition.
  virtual void slab_ready(const std::string& /*sampler*/, const wire::SlabReady& /*slab*/) {}
  /// A sampler is gone; called for plans that do not lead, too. Returns the number of leases that it held.
  virtual int release_sampler(const std::string& sampler) = 0;
  virtual size_t leases_of(const std::string& sampler) const = 0;
  /// Returns for how many seconds it had leases and delivered nothing; nullopt: it delivers, or had too little time.
  virtual std::optional<double> stuck_s(const std::string& /*sampler*/, double /*now_s*/) const { return std::nullopt; }
  virtual Figures figures() const = 0;
};

class Plan : public Scene, public Schedule {
 public:
  /// Add the plan's figures to the status that `telesplat ctl status` prints, and to summary.json.
  virtual void add_status(nlohmann::ordered_json& /*status*/) const {}
  virtual void add_counters(std::map<std::string, double>& /*counters*/) const {}
};

/// The parts of the master that plans use. Must outlive them.
struct PlanLinks {
  Outbox& outbox;
  metrics::RunRecord& record;
  /// Returns a sampler's name, for people; "?": it is not known.
  std::function<std::string(const std::string& sampler)> name_of;
  std::function<std::string(InstanceId)> name_of_instance;  ///< likewise
  /// Routing id of the packer; empty: no packer is here.
  std::function<std::string()> packer;
};

/// Makes the plan for a pipeline.
std::unique_ptr<Plan> make_plan(scene::Pipeline pipeline, const MasterOptions& options, const PlanLinks& links);

}  // namespace telesplat::master
