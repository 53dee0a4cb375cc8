// View requests -> sampling frames -> leases (T7.3): leases are pulled by idle samplers, expire, and are handed out
// again; a tile is done only when the packer has it. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "common/wire/messages.h"
#include "services/master/record/plan_row.h"
#include "services/master/tiles/frame_tiles.h"
#include "services/master/tiles/pacing.h"
#include "services/master/views.h"

namespace telesplat::master {

inline constexpr double kLeastOverdue_s = 0.015;  ///< a tile that has been out for less gets no backup

/// Least target of a lease for each sampler there is, s: so master and packer handle no more than 4000 leases of rows a
/// second, however many samplers there are. Set by `telesplat-lab scaling`: on two cores this leaves enough time to the
/// samplers' processes.
inline constexpr double kTargetPerSampler_s = 0.25e-3;

/// A busy sampler gets none of a frame's last rows if a row takes longer than this: it would delay the frame. It may
/// keep cheaper rows in store, since it would wait longer for its next lease (3 to 8 ms between idle and busy with 40
/// samplers on two cores; `telesplat-lab scaling`).
inline constexpr double kDearRow_s = 0.01;

/// Time that all samplers together should take for an extra frame: a view that comes waits for its tiles that are out.
inline constexpr double kExtraFrame_s = 0.05;
/// When another view begins, open tiles of extra frames older than this are dropped.
inline constexpr double kExtraPatience_s = 0.25;
/// A view whose viewer's link takes nothing for this time waits again if a view of another viewer could begin.
inline constexpr double kHeld_s = 1;

/// An asynchronous view whose tiles wait for its viewer's link ends this long after its plan, if a newer view of the
/// viewer waits.
inline constexpr double kOvertaken_s = 0.25;
/// A view that is sampled whole arrives coarse first if its viewer's link would need longer than this for it.
inline constexpr double kCoarseFrom_s = 0.25;

/// Seconds that samplers may take for a whole view. A slower one is sampled coarser if much of it is unseen; else its
/// refining rays are limited (RefiningRays). A quicker one has all of its rays cast.
inline constexpr double kWhole_s = 0.1;

/// A frame ends without a tile that was refused, or whose leases were lost, more often than these.
inline constexpr int kMostRefused = 2, kMostLost = 7;

/// The way in which a scene's frames are leased.
struct Cut {
  bool rows = false;            ///< bands of rows of blocks instead of square tiles
  bool coarse = false;          ///< a view is two frames: one of step kCoarseStep, then one of step 1
  bool coarse_if_slow = false;  ///< likewise, but only if the viewer's link is slow
  bool steered = false;   ///< the packer is asked first which rays are needed; without its plan, rows and coarse apply
  bool pictures = false;  ///< one band of all columns for each sampler
  bool operator==(const Cut&) const = default;
};

/// A view is sampled whole if its plan takes longer than kUsualAnswers usual answers, within these limits, s: a packer
/// that is busy is worth waiting for, one that is stuck is not.
inline constexpr double kLeastPatience_s = 1, kLongestPatience_s = 3, kUsualAnswers = 4;
/// Likewise for plans of extra frames: the packer makes them when it has time, and no view waits for them.
inline constexpr double kExtraAnswer_s = 10;
/// While views are always waiting or under way, an extra frame follows each kViewsPerExtra-th view of a viewer.
inline constexpr int kViewsPerExtra = 2;
/// A head that rests gets kStillViews times as many refining rays in a view: it waits for these and nothing else.
inline constexpr uint64_t kStillViews = 16;
/// Its extra frames have kStillExtras times as many rays: each waits for a question, an answer and its last tile.
inline constexpr uint64_t kStillExtras = 8;
/// A packer that let two views in a row wait in vain is not asked for kFirstRest_s, then twice as long each time, up to
/// kLongestRest_s.
inline constexpr double kFirstRest_s = 1, kLongestRest_s = 30;

/// A view that waits for its plan, or has waited: it becomes a frame.
struct PlannedView {
  FrameId frame, coarse;  ///< coarse: frame of the coarse pass; 0: no coarse pass
  EpochId epoch;
  wire::ViewRequest view;
};

/// Limits of a plan's tiles: see wire::PlanRequest.
struct PlanLimits {
  int tile_size = 256;
  uint64_t tile_rays = 0;
  uint64_t most_rays = 0;      ///< rays of an extra frame
  uint64_t link_rays = 0;      ///< rays that the viewer's link carries in an update's time; 0: no limit
  uint64_t refining_rays = 0;  ///< refining rays of a view: PlanRequest::most_rays
};

/// Questions to the packer for plans, and those without an answer yet: plans of views, and of rays that are worth
/// casting beyond the views when there is nothing else to do.
class PlanQuestions {
 public:
  struct Asked {
    PlannedView view;
    wire::PlanRequest request;
    double asked_s = 0;
  };

  void set_on(bool on) { on_ = on; }
  /// True if plans are asked for now.
  bool on(double now_s) const { return on_ && now_s >= rests_until_s_; }

  /// Seconds that the plan of a view may take now.
  double patience_s() const;

  /// Returns and notes the question for the view's plan; the viewer's earlier view is not refined any more.
  wire::PlanRequest ask(const PlannedView& view, const PlanLimits& limits, double now_s);
  /// Notes that the view is sampled without a plan.
  void begin_unplanned(const PlannedView& view) { see(view); }
  /// The view has its plan, or is complete: extra rays may be cast for it.
  void known(const PlannedView& view);

  enum class Extra {
    kAny,  ///< all viewers', as there is nothing else to do
    kDue   ///< only of viewers that have had no extra frame for kViewsPerExtra views
  };
  /// True if ask_extra() has a question for some view.
  bool extra_wanted(EpochId epoch, Extra which) const;
  /// Returns the question for extra rays of the view that is next in turn to want some. Precondition: extra_wanted().
  wire::PlanRequest ask_extra(FrameId frame, EpochId epoch, Extra which, const PlanLimits& limits, double now_s);

  /// Returns the question that `plan` answers. nullopt: it is not open (any more).
  std::optional<wire::PlanRequest> waiting_for(const wire::Plan& plan) const;
  /// Takes out the question that `plan` answers. nullopt: it is not open (any more).
  std::optional<Asked> answered(const wire::Plan& plan, double now_s);
  /// Takes out questions that were asked too long ago, oldest first.
  std::vector<Asked> give_up(double now_s);
  const std::vector<Asked>& open() const { return open_; }
  bool extra_open() const;
  size_t viewers() const { return viewers_.size(); }
  void forget_viewer(InstanceId viewer);
  /// Drops all questions; the packer knows no view: a new epoch or packer.
  void clear();
  /// Ends a rest and forgets the time of answers: another packer may be quicker.
  void trust() { rests_until_s_ = -1e9, rest_s_ = 0, in_vain_ = 0, answer_s_ = RunningMean(0.2); }

 private:
  // A viewer's newest view.
  struct Seen {
    PlannedView view;
    bool still = false;      // its camera is that of the view before
    bool known = false;      // the packer knows it
    bool exhausted = false;  // nothing beyond it is worth casting
    uint64_t round = 0;      // number of extra questions, with earlier views': a moving head gets all sorts of rays
    int since_extra = 0;     // views since the last extra question, with this one
    bool wants(EpochId epoch, Extra which) const {
      return known && !exhausted && view.epoch == epoch && (which == Extra::kAny || since_extra >= kViewsPerExtra);
    }
  };
  Seen& see(const PlannedView& view);
  void exhaust(const wire::PlanRequest& extra);

  bool on_ = false;
  double rests_until_s_ = -1e9, rest_s_ = 0;
  int in_vain_ = 0;            // views in a row that waited in vain
  RunningMean answer_s_{0.2};  // time of answers for views
  std::vector<Asked> open_;    // few, oldest first
  std::map<InstanceId, Seen> viewers_;
  InstanceId last_;  // viewer of the last extra question
};

class FrameSchedule : public Views {
 public:
  explicit FrameSchedule(const ScheduleOptions& options) : Views(options) {
    gate_.set_most(options.max_rate_mbit * 1e6 / 8);
  }

  /// Sets the cut of frames that begin from now on.
  void set_cut(Cut cut) {
    cut_ = cut;
    plans_.set_on(cut.steered);
  }
  Cut cut() const { return cut_; }

  /// Begins the next view that waits; see Views::take_view(). Its frame or frames follow at once, or with its plan.
  /// False: no view may begin.
  bool begin_view(EpochId epoch, bool turns_only = false, double now_s = 0);

  /// Asks for rays that are worth casting beyond the views: when there is nothing else to do, and after every second
  /// view of a viewer that always has another one waiting.
  void begin_extra(EpochId epoch, double now_s);
  /// Takes the questions for the packer, in order, each once.
  std::vector<wire::PlanRequest> take_questions() { return std::exchange(questions_, {}); }
  /// Takes messages for the packer about frames that ended before all of their tiles were sampled, each once.
  std::vector<wire::FrameEnd> take_ends(double now_s);
  /// Takes the packer's answer; drops it if its question is not open. Error: it does not fit the question
  /// (check_answer()), and counts as full.
  Status take_plan(const wire::Plan& plan, double now_s);
  /// Begins views that waited too long for their plans: they are sampled whole.
  void give_up_plans(double now_s);
  /// Takes the rows for the record about plans since the last call.
  std::vector<metrics::PlanRow> take_plan_rows() { return std::exchange(plan_rows_, {}); }
  bool steered(double now_s) const { return plans_.on(now_s); }
  /// True if views begin though no sampler is idle: the packer is asked first, or persons would wait for each other.
  bool begins_early(double now_s) const { return plans_.on(now_s) || another_waits(); }
  /// Another packer leads.
  void trust_packer() { plans_.trust(), forget_links(); }
  /// Forgets all links: nothing is under way to any viewer.
  void forget_links() { gate_.clear(); }
  void forget_viewer(InstanceId viewer) override;

  /// Takes a report about a viewer's link: its views begin, and their tiles are leased, only while its queue is short.
  void on_link(const wire::LinkReport& link, double now_s) { gate_.report(link, now_s); }
  /// Ends views that a newer one overtook while they waited for a link. take_ends() has the messages for the packer.
  void end_overtaken(double now_s);
  const LinkGate& links() const { return gate_; }

  /// Leases the next tile to `sampler`: an open tile of the oldest frame that has one; or a backup of a tile that has
  /// been out for long in a frame without open tiles (see backup_after_s()). A sampler that failed (see Trust) gets
  /// copies of tiles that a trusted one has, one at a time. The newest frame's last rows, one for each sampler, go only
  /// to samplers that hold no other lease, if a row takes longer than kDearRow_s. even_own: also tiles whose lease ran
  /// out at this very sampler. idle: it holds no lease, though the packer may not have reported so yet.
  std::optional<wire::Lease> lease(const std::string& sampler, double now_s, bool even_own = true, bool idle = false);
  /// Gives a lease of this sampler its full time again, until longest_fetch_s after it was leased. Others are ignored.
  void extend(LeaseId lease, const std::string& sampler, double now_s);
  /// The packer cannot use a tile of this sampler. The tile goes to another; a frame ends without a tile that is
  /// refused more than kMostRefused times.
  void refused(const wire::TileRefused& refused, const std::string& sampler, double now_s);
  /// The packer has this tile, which `sampler` (empty: unknown) sampled. Returns true the first time, from any of its
  /// leases; false for duplicates, tiles never leased and unknown frames. Learns from the tile's times.
  bool tile_done(const wire::TileDone& tile, const std::string& sampler, double now_s);

  /// The sampler asked for work, so it no longer works on tiles that a backup delivered first.
  void heard_of(const std::string& sampler);
  /// Takes back leases that ran out, also of tiles that a backup delivered first, and calls lost_sampler with the
  /// sampler of each. Returns their number.
  int expire(double now_s, const std::function<void(const std::string&)>& lost_sampler);
  /// Takes back all leases of a sampler that left. Returns their number.
  int release_sampler(const std::string& sampler);
  size_t leases_of(const std::string& sampler) const;
  /// Drops all frames and plans (new epoch, new packer). Their views wait again, unless a newer request of the viewer
  /// does.
  void drop_frames();

  bool tile_open() const;
  /// True if a tile has been out so long that any sampler other than its own could take a backup.
  bool backup_due(double now_s) const;
  /// Takes the news of samplers that deliver nothing, or deliver again: Trust::news().
  std::vector<Trust::News> take_news(double now_s);
  std::optional<double> stuck_s(const std::string& sampler, double now_s) const {
    return trust_.stuck_s(sampler, now_s);
  }
  size_t frames_in_flight() const { return frames_.size(); }
  uint64_t tiles_released() const { return released_; }
  uint64_t backups() const { return backups_; }
  uint64_t given_up() const { return given_up_; }          ///< frames that ended without tiles that cannot be had
  uint64_t overtaken() const { return overtaken_views_; }  ///< views that ended early
  size_t viewers_remembered() const { return plans_.viewers(); }
  const SamplingCosts& costs() const { return costs_; }
  /// Seconds after which a lease expires now: 25 typical tile times, within [0.3, lease_timeout_s]; for a sampler
  /// that has finished no tile, lease_timeout_s. planned: for tiles of plans.
  double lease_time_s(bool planned = false) const;
  /// Seconds after which a tile that is out may be leased to another sampler too: 3 typical tile times, at least
  /// kLeastOverdue_s; infinite while no tile time is known.
  double backup_after_s(bool planned = false) const;

 private:
  struct Frame {
    FrameId id;
    EpochId epoch;
    wire::ViewRequest request;
    int step = 1;
    geometry::Camera camera;
    FrameTiles tiles;
    bool planned = false;              // the tiles are a plan's
    bool extra = false;                // its rays lie beyond a view
    double begun_s = 0;                // time of its plan; without a plan, its view's begin
    double refining = 0, put_off = 0;  // RefiningRays::learn()
    double held_from_s = 0;            // since then its viewer's link takes nothing; 0: it takes more
  };
  // A lease whose tile another sampler delivered first; the lease's own sampler may be dead or slow.
  struct Overtaken {
    std::string sampler;
    double leased_s, expires_s;
    bool heard = false;  // it asked for work since
  };
  void begin_frame(const PlannedView& view, FrameId id, const geometry::Camera& camera, int step);
  /// Divides the view's width and height by `times`; above 1 there is no coarse frame.
  void begin_whole(const PlannedView& view, int times = 1);
  /// Returns the divisor of width and height, 1 to kCoarseStep, that keeps a whole view within kWhole_s.
  int coarser(const PlanQuestions::Asked& asked, const wire::Plan& plan) const;
  void take_answer(const wire::Plan& plan, double now_s);
  void begin_planned(const PlanQuestions::Asked& asked, const wire::Plan& plan, double now_s);
  /// Inserts a frame; views stand before extra frames.
  void insert(Frame frame);
  void close_extras(const wire::ViewRequest& view, double now_s);
  void view_complete(const PlannedView& view, bool whole = true);
  void note(const PlanQuestions::Asked& asked, const wire::Plan& plan, double now_s);
  /// viewer: the view's; nullopt: for extra rays, which go to all viewers.
  PlanLimits limits(std::optional<InstanceId> viewer, double now_s) const;
  PlanLimits limits(const wire::ViewRequest& view, double now_s) const;
  /// Seconds that all samplers need for all pixels of a view; 0: not known yet.
  double whole_s(const geometry::Camera& camera) const {
    return double(camera.width) * camera.height * whole_ray_s_.value() / double(std::max<size_t>(workers(), 1));
  }
  bool open(InstanceId viewer, double now_s) const { return in_turns_ || gate_.open(viewer, now_s); }
  bool may_lease(const Frame& frame, double now_s) const;
  bool is_overtaken(const Frame& frame, double now_s) const;
  bool arrives_coarse(const wire::ViewRequest& view) const;
  bool other_waits(InstanceId viewer, double now_s) const;
  void put_back_held(double now_s);
  double target_s() const;
  std::deque<Frame>::iterator end_frame(std::deque<Frame>::iterator frame);
  void end_closed();
  void end_hopeless();
  wire::Lease lease_tile(Frame& frame, size_t tile, const std::string& sampler, double now_s);
  std::vector<Frame*> in_turn(double now_s);
  std::optional<wire::Lease> lease_copy(const std::string& sampler, double now_s);
  /// True if a trusted sampler holds a lease, or one delivered lately.
  bool trusted_here(double now_s) const;
  bool trusts(const std::string& sampler, double now_s) const { return !trusted_here(now_s) || trust_.has(sampler); }
  /// Number of samplers for which work is cut: those that deliver; all if no sampler does.
  size_t workers() const {
    const size_t all = costs_.samplers();
    return trust_.stuck() < all ? all - trust_.stuck() : all;
  }
  void note_delivery(const wire::TileDone& tile, const std::string& sampler, double now_s);

  Cut cut_;
  PlanQuestions plans_;
  std::vector<wire::PlanRequest> questions_;
  std::vector<wire::FrameEnd> ends_;
  std::vector<metrics::PlanRow> plan_rows_;
  std::deque<Frame> frames_;  // extra ones last
  std::map<LeaseId, Overtaken> overtaken_;
  SamplingCosts costs_;
  Trust trust_;
  LinkGate gate_;
  bool in_turns_ = false;  // an animation plays: a view that waited for its link would hold up the others
  RefiningRays refining_;
  RunningMean whole_ray_s_{0.2};      // seconds a ray, in tiles that are cast whole
  RunningMean tile_time_s_{0.05};     // lease -> done
  RunningMean planned_time_s_{0.05};  // likewise for tiles of plans, which have few rays
  uint64_t released_ = 0, backups_ = 0, overtaken_views_ = 0, given_up_ = 0;
};

}  // namespace telesplat::master
