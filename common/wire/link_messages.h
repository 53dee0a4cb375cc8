// Messages about the links of viewers: the part of the published events that has arrived.
#pragma once

#include <string_view>

#include "common/core/ids.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

/// Viewer (DEALER) -> packer (ROUTER), while events arrive and twice a second: I have all events up to `newest`.
struct Receipt {
  static constexpr std::string_view kName = "receipt";
  InstanceId viewer;
  InstanceId packer;  ///< packer that numbers the events
  Sequence newest;    ///< newest event that was applied
  double viewer_s = 0;  ///< when it was applied, on the viewer's own clock
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("packer", m.packer); f("newest", m.newest); f("viewer_s", m.viewer_s);
  }
};
/// Packer -> master, after each receipt: figures of that viewer's link that follow from it.
struct LinkReport {
  static constexpr std::string_view kName = "link_report";
  InstanceId viewer;
  double rate_bytes_s = 0;     ///< rate that the link carried when it was busy; 0: not known
  uint64_t backlog_bytes = 0;  ///< published and not received
  double rtt_s = 0;            ///< least recent round trip; 0: not known
  double oldest_s = 0;         ///< for this long it has had a backlog and received nothing of it
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("rate_bytes_s", m.rate_bytes_s); f("backlog_bytes", m.backlog_bytes);
    f("rtt_s", m.rtt_s); f("oldest_s", m.oldest_s);
  }
};

// clang-format on

}  // namespace telesplat::wire
