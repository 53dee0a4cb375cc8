// A link of a network in the text form of users, "rtt=40ms,rate=100mbit,jitter=5ms,stall=2s/30s", for simulated links.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::links {

/// Effect of a link on bytes, the same both ways.
struct Link {
  double rtt_s = 0;          ///< both ways together, without waiting; half of it each way; 0..10
  double rate_bit_s = 0;     ///< each way; 10^4..10^11; 0: no limit
  double jitter_s = 0;       ///< random extra delay each way, from 0 to this; 0..10
  double stall_s = 0;        ///< nothing passes for this time; 0: no stalls
  double stall_every_s = 0;  ///< from the begin of one stall to that of the next, above stall_s; at most 3600

  /// True if it changes nothing.
  bool is_local() const { return rtt_s == 0 && rate_bit_s == 0 && jitter_s == 0 && stall_s == 0; }
  bool operator==(const Link&) const = default;
};

/// Place of a link in the pipeline.
enum class Place {
  kViewer,   ///< between each viewer and everything else
  kSampler,  ///< between each sampler and everything else
  kData      ///< between samplers and data servers
};
std::string_view name_of(Place place);

struct PlacedLink {
  Place place = Place::kViewer;
  Link link;
};

/// Reads "local"; RATE ("20mbit"), RTT ("50ms") or RTT:RATE ("50ms:100mbit"); or some of rtt=, rate=, jitter= and
/// stall=FOR/EVERY, separated by commas. Times are numbers with us, ms or s, rates with kbit, mbit or gbit (powers of
/// 1000, bits a second). Error: names the part, its value and the limit.
Result<Link> parse(std::string_view text);
/// The same after a place and a colon, "viewer:", "sampler:" or "data:"; without a place, the link is the viewer's.
Result<PlacedLink> parse_placed(std::string_view text);

/// Writes text for parse(): "rtt=40ms,rate=100mbit", or "local".
std::string text_of(const Link& link);

/// Bytes that wait before a link's bottleneck, each way: as many as it carries in a round trip, or in 100 ms if that is
/// longer. 0: without a rate no bytes wait.
uint64_t queue_bytes(const Link& link);

}  // namespace telesplat::links
