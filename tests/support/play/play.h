// Plays: bytes choose the messages to a part of the pipeline, one by one. Any peer may send anything that its messages
// can express; none can do harm. Fuzz targets play a fuzzer's bytes, property tests those of seeds.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace telesplat::test {

/// Describes a fault; nothing: all is well.
using Complaint = std::optional<std::string>;

/// Name of a state -> how often a play reached it: tests check that plays reach what they are about.
using Reached = std::map<std::string, uint64_t>;

/// A play. Its figures are added to `reached`, if there is one.
using Play = Complaint (*)(std::span<const uint8_t> bytes, Reached* reached);

/// Sends the master valid messages of any peer, also ones that no healthy peer sends. After any of them, the master's
/// messages can be decoded and are bounded, only samplers get leases, and when these peers have gone, a session of
/// honest processes gets its view.
Complaint play_master(std::span<const uint8_t> bytes, Reached* reached = nullptr);

/// Sends a viewer events of several packers, out of order, doubled, lost and made up. At the end one packer is there,
/// and the replica has its digest.
Complaint play_receiver(std::span<const uint8_t> bytes, Reached* reached = nullptr);

}  // namespace telesplat::test
