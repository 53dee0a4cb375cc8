// Follows the session's orders, and the pace at which views come, with the coupling. No sockets, no clocks.
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
  /// Returns the coupling that comes into force now; nothing: it stays. Before the display begins to wait, its open
  /// request is answered and shown, for kPatience_s at most: so no update is lost, and the first frame that waits does
  /// so for a request made after the change.
  std::optional<CouplingState> next(bool answer_open, double now_s);
  /// The session says whether views come as pictures; no order changes that. Returns the coupling that comes into
  /// force; nothing: the present one fits.
  std::optional<CouplingState> follow_pictures(bool pictures) const;
  /// A view came as a picture; ahead: views that were under way when it was asked for. Returns the coupling with as
  /// many views under way as keep servers and link busy; nothing: it stays.
  std::optional<CouplingState> answered(const metrics::StagesMs& stages, uint64_t ahead);

 private:
  CouplingGate& gate_;
  PipelineDepth depth_;
  std::optional<CouplingState> wished_;
  double wished_since_s_ = 0;
};

}  // namespace telesplat::viewer
