// When the viewers of one wall present their frames: together, all from one head, all of one state of the model. A
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
  /// From word to present a frame until it is presented, at least: what a message takes to be there and wake someone.
  static constexpr double kLead_s = 1.5e-3;
  static constexpr double kMostLead_s = 8e-3;  ///< where words come late
  /// From the first viewer of a wall until its frames begin, if not all come sooner.
  static constexpr double kGather_s = 5;
  /// A viewer that was late is waited for again after so many frames in time.
  static constexpr int kInTime = 3;
  /// A frame is taken for no longer than this, however slow a wall is.
  static constexpr double kMostFrame_s = 0.25;
  /// A viewer that receives the model so much later than the others does not hold back what they show, until it has had
  /// what they show for kInTime frames.
  static constexpr double kModelPatience_s = 0.5;

  struct Outgoing {
    std::string peer;
    wire::Swap swap;
  };
  struct Figures {
    uint64_t frames = 0;      ///< presented
    uint64_t incomplete = 0;  ///< of these: without a viewer that was waited for
  };

  explicit SwapBarrier(InstanceId master) : master_(master) {}

  /// peer: where answers go.
  void on(const std::string& peer, const wire::SwapReady& m, double now_s);
  /// It is gone: nobody waits for it.
  void forget(InstanceId viewer, double now_s);
  void unreachable(const std::string& peer, double now_s);
  /// To be called when due_s() has come, and may be called at any time.
  void tick(double now_s);
  /// When tick() has something to do, if nothing comes before.
  std::optional<double> due_s() const;
  std::vector<Outgoing> take_outgoing();

  bool empty() const { return members_.empty(); }
  const Figures& figures() const { return figures_; }

 private:
  struct Member {
    std::string peer;
    wire::SwapReady said;
    bool ready = false;        // for the frame at hand
    bool waited_for = true;    // it was in time, or has been again for long enough
    int in_time = 0;           // frames in a row, while it is not waited for
    uint64_t in_time_for = 0;  // the last of them
    uint64_t told = 0;         // the newest frame that it was told to present
    bool behind = false;       // it receives what is shown later than the others, who do not wait for it
    int caught_up = 0;         // frames in a row for which it had what is shown, while it is behind
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
  uint64_t frame_ = 0;            // that is presented next
  double first_s_ = 0;            // someone came, and nobody was there
  double ready_s_ = 0;            // someone became ready last
  double between_s_ = 0;          // of frames, on average
  double deadline_before_s_ = 0;  // of the frame that was presented last
  double lead_s_ = kLead_s;
  wire::Swap last_;  // what was told last
  struct Presented {
    double first_s = 0, last_s = 0;
    size_t viewers = 0;
  };
  std::map<uint64_t, Presented> presented_;  // the newest few
  struct Reached {
    double at_s;
    uint64_t newest;
  };
  std::deque<Reached> reached_;   // what any viewer could show, of last_.state.source
  double source_differs_s_ = -1;  // viewers receive from several sources since then; < 0: they do not
  std::vector<Outgoing> outgoing_;
  Figures figures_;
};

}  // namespace telesplat::master
