// Changes the coupling as the session orders it and as views come. No sockets, no clocks.
#pragma once

#include <optional>

#include "client/viewer/coupling/view_requester.h"
#include "common/metrics/stages.h"

namespace telesplat::viewer {

class CouplingFollower {
 public:
  explicit CouplingFollower(CouplingGate& gate) : gate_(gate) {}
  CouplingGate& gate() const { return gate_; }

  /// Takes the session's order (`telesplat ctl coupling`), which next() carries out. A session without one changes
  /// nothing.
  void follow(const wire::SessionSettings& session, double now_s);
  /// An order waits: no view is asked for until next() has carried it out.
  bool waits() const { return wished_.has_value(); }
  /// The coupling that comes into force now; nothing: none does. A display that does not wait yet goes on to show what
  /// comes until its open request is answered, so that the first frame that waits has an update to wait for.
  std::optional<CouplingState> next(bool answer_open, double now_s);
  /// The session's views come as pictures or as points. Returns the coupling that comes into force; nothing: that
  /// in force fits.
  std::optional<CouplingState> follow_pictures(bool pictures) const;
  /// A view came, where views come as pictures; ahead: views that were under way when it was asked for. Returns the
  /// coupling with another number of views under way; nothing: it stays.
  std::optional<CouplingState> answered(const metrics::StagesMs& stages, uint64_t ahead);

 private:
  CouplingGate& gate_;
  PipelineDepth depth_;
  std::optional<CouplingState> wished_;
  double wished_since_s_ = 0;
};

}  // namespace telesplat::viewer
