// Which plans are asked of the packer, and which answers are waited for: of views, and of what is worth casting beyond
// them when nothing else is to be done. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/metrics/plans/plan_row.h"
#include "common/wire/messages.h"
#include "services/master/views.h"

namespace telesplat::master {

/// A view is sampled whole if its plan takes longer than this, and than so many usual answers: a packer that is busy is
/// worth waiting for, one that is stuck is not.
inline constexpr double kLeastPatience_s = 1, kLongestPatience_s = 3, kUsualAnswers = 4;
/// What is beyond a view is looked for when the packer has time, and nobody waits for it.
inline constexpr double kExtraAnswer_s = 10;
/// Where a view always waits or is under way, one of so many views of a viewer is followed by an extra frame.
inline constexpr int kViewsPerExtra = 2;
/// A head that rests gets so many times as many refining rays in a view: it waits for them, and nothing else.
inline constexpr uint64_t kStillViews = 16;
/// Its extra frames have so many times as many rays: each of them waits for a question, an answer and its last tile.
inline constexpr uint64_t kStillExtras = 8;
/// A packer that let two views on end wait in vain is not asked for so long; twice as long each further time, up to the
/// second.
inline constexpr double kFirstRest_s = 1, kLongestRest_s = 30;

/// A view that waits for its plan, or is over the wait: what becomes a frame.
struct PlannedView {
  FrameId frame, coarse;  ///< coarse: of the coarse pass, should there be one; 0: none
  EpochId epoch;
  wire::ViewRequest view;
};

/// How much a plan's tiles hold: see wire::PlanRequest.
struct PlanLimits {
  int tile_size = 256;
  uint64_t tile_rays = 0;
  uint64_t most_rays = 0;      ///< of an extra frame
  uint64_t link_rays = 0;      ///< that the viewer's link carries in an update's time; 0: no limit
  uint64_t refining_rays = 0;  ///< of a view: PlanRequest::most_rays
};

class PlanQuestions {
 public:
  struct Asked {
    PlannedView view;
    wire::PlanRequest request;
    double asked_s = 0;
  };

  void set_on(bool on) { on_ = on; }
  /// Plans are asked for, now.
  bool on(double now_s) const { return on_ && now_s >= rests_until_s_; }

  /// How long an answer may take, now: of a view.
  double patience_s() const;

  /// Notes that the view is asked for; its viewer's earlier view is not refined any more.
  wire::PlanRequest ask(const PlannedView& view, const PlanLimits& limits, double now_s);
  /// Notes that it is sampled without a plan.
  void begin_unplanned(const PlannedView& view) { see(view); }
  /// The view has its plan, or is complete: more may be cast for it.
  void known(const PlannedView& view);

  enum class Extra {
    kAny,  ///< there is nothing else to do
    kDue   ///< only of viewers that have had no extra frame for kViewsPerExtra views
  };
  /// There is a view for which ask_extra() has a question.
  bool extra_wanted(EpochId epoch, Extra which) const;
  /// For the view, in turn of those that want it, of which more is to be cast. Precondition: extra_wanted().
  wire::PlanRequest ask_extra(FrameId frame, EpochId epoch, Extra which, const PlanLimits& limits, double now_s);

  /// What `plan` answers. nullopt: nobody waits for it (any more).
  std::optional<wire::PlanRequest> waiting_for(const wire::Plan& plan) const;
  /// Takes out the question that `plan` answers. nullopt: nobody waits for it (any more).
  std::optional<Asked> answered(const wire::Plan& plan, double now_s);
  /// Takes out those that were asked too long ago, oldest first.
  std::vector<Asked> give_up(double now_s);
  const std::vector<Asked>& open() const { return open_; }
  bool extra_open() const;
  size_t viewers() const { return viewers_.size(); }
  void forget_viewer(InstanceId viewer);
  /// Nothing is asked any more, and no view is known: a new epoch, a new packer.
  void clear();
  /// Another packer may be quicker.
  void trust() { rests_until_s_ = -1e9, rest_s_ = 0, in_vain_ = 0, answer_s_ = RunningMean(0.2); }

 private:
  // What is known of a viewer's newest view.
  struct Seen {
    PlannedView view;
    bool still = false;      // by the same camera as the one before
    bool known = false;      // to the packer
    bool exhausted = false;  // nothing beyond it is worth casting
    uint64_t round = 0;      // extra questions, of earlier views too: so a moving head gets all sorts of rays
    int since_extra = 0;     // views, this one included
    bool wants(EpochId epoch, Extra which) const {
      return known && !exhausted && view.epoch == epoch && (which == Extra::kAny || since_extra >= kViewsPerExtra);
    }
  };
  Seen& see(const PlannedView& view);
  void exhaust(const wire::PlanRequest& extra);

  bool on_ = false;
  double rests_until_s_ = -1e9, rest_s_ = 0;
  int in_vain_ = 0;            // views that waited, one after the other
  RunningMean answer_s_{0.2};  // to views
  std::vector<Asked> open_;    // few, oldest first
  std::map<InstanceId, Seen> viewers_;
  InstanceId last_;  // whose turn it was
};

}  // namespace telesplat::master
