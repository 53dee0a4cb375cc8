// Makes the viewers of one wall present their frames together, all from one head, all of one state of the model. A
// viewer that is late or dead does not hold the others for longer than a frame. No sockets, no clocks: messages and
// times come in, messages go out. Times are the master's.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/wire/wall_messages.h"

namespace telesplat::master {

class SwapBarrier {
 public:
  /// Least time from the Swap message to the presentation: the message must arrive and wake the viewer.
  static constexpr double kLead_s = 1.5e-3;
  static constexpr double kMostLead_s = 8e-3;  ///< limit of that time if messages come late
  /// Time from a wall's first viewer until its frames begin, if not all viewers come sooner.
  static constexpr double kGather_s = 5;
  /// A viewer that was late is waited for again after this many frames in time.
  static constexpr int kInTime = 3;
  /// A frame counts for no longer than this, however slow a wall is.
  static constexpr double kMostFrame_s = 0.25;
  /// A viewer that receives the model this much later than the others does not hold them back, until it has had the
  /// state that they show for kInTime frames.
  static constexpr double kModelPatience_s = 0.5;

  struct Outgoing {
    std::string peer;
    wire::Swap swap;
  };
  struct Figures {
    uint64_t frames = 0;      ///< frames presented
    uint64_t incomplete = 0;  ///< frames presented without a viewer that was waited for
    void operator+=(const Figures& more) { frames += more.frames, incomplete += more.incomplete; }
  };

  explicit SwapBarrier(InstanceId master) : master_(master) {}

  /// A viewer is ready for a frame. peer: routing id for the answer.
  void on(const std::string& peer, const wire::SwapReady& m, double now_s);
  /// The viewer is gone: the others do not wait for it.
  void forget(InstanceId viewer, double now_s);
  void unreachable(const std::string& peer, double now_s);
  /// To be called when due_s() has come, and may be called at any time.
  void tick(double now_s);
  /// Time at which tick() has something to do, if no message comes before; nullopt: it has nothing to do.
  std::optional<double> due_s() const;
  std::vector<Outgoing> take_outgoing();

  bool empty() const { return members_.empty(); }
  const Figures& figures() const { return figures_; }

 private:
  struct Member {
    std::string peer;
    wire::SwapReady said;
    bool ready = false;        // ready for the next frame
    bool waited_for = true;    // it was in time, or has been so again for kInTime frames
    int in_time = 0;           // frames in a row, while it is not waited for
    uint64_t in_time_for = 0;  // the last of these frames
    uint64_t told = 0;         // newest frame in a Swap that it was sent
    bool behind = false;       // it receives the model later than the others, which do not wait for it
    int caught_up = 0;         // frames in a row for which it had the state shown, while it is behind
  };

  double frame_s() const;
  double deadline_s() const;
  bool gathered(double now_s) const;
  bool complete() const;
  void note_presented(const wire::SwapReady& m);
  void go_on(double now_s);
  void swap(double now_s);
  void leave_out_the_late();
  static void note_pace(Member& member, uint64_t frame, bool in_time);
  const Member& leader() const;
  static const wire::ShownState& first_of_most(const std::vector<const Member*>& members);
  void choose_state(double now_s);
  void note_behind(uint64_t newest);
  void tell(Member& member, const wire::Swap& swap);

  InstanceId master_;
  std::map<InstanceId, Member> members_;
  bool begun_ = false;
  uint64_t frame_ = 0;            // number of the next frame
  double first_s_ = 0;            // when the first viewer came
  double ready_s_ = 0;            // when a viewer last became ready
  double between_s_ = 0;          // mean time between frames
  double deadline_before_s_ = 0;  // deadline of the last frame
  double lead_s_ = kLead_s;
  wire::Swap last_;  // the last one sent
  struct Presented {
    double first_s = 0, last_s = 0;
    size_t viewers = 0;
  };
  std::map<uint64_t, Presented> presented_;  // newest frames, by number
  struct Reached {
    double at_s;
    uint64_t newest;
  };
  std::deque<Reached> reached_;   // newest state that any viewer could show, of last_.state.source
  double source_differs_s_ = -1;  // viewers receive from several sources since then; < 0: they do not
  std::vector<Outgoing> outgoing_;
  Figures figures_;
};

}  // namespace telesplat::master
