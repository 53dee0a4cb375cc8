// Messages about the links of viewers: how much of what was published has arrived.
#pragma once

#include <string_view>

#include "common/core/ids.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

/// Viewer (DEALER) -> packer (ROUTER), while events arrive and twice a second: I have everything up to this one.
struct Receipt {
  static constexpr std::string_view kName = "receipt";
  InstanceId viewer;
  InstanceId packer;  ///< whose sequences
  Sequence newest;    ///< applied
  double viewer_s = 0;  ///< when, on the viewer's own clock
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("packer", m.packer); f("newest", m.newest); f("viewer_s", m.viewer_s);
  }
};
/// Packer -> master, after each receipt: what it says of that viewer's link.
struct LinkReport {
  static constexpr std::string_view kName = "link_report";
  InstanceId viewer;
  double rate_bytes_s = 0;     ///< what the link carried when it was busy; 0: not known
  uint64_t backlog_bytes = 0;  ///< published and not received
  double rtt_s = 0;            ///< least, lately; 0: not known
  double oldest_s = 0;         ///< it has had a backlog so long and received nothing of it
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("rate_bytes_s", m.rate_bytes_s); f("backlog_bytes", m.backlog_bytes);
    f("rtt_s", m.rtt_s); f("oldest_s", m.oldest_s);
  }
};

// clang-format on

}  // namespace telesplat::wire
