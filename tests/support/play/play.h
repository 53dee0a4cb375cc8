// Plays: bytes choose what happens to a part of the pipeline, message by message. Everyone may say anything that its
// messages can say; nobody can do harm. Fuzz targets play what a fuzzer thinks of, property tests what seeds say.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace telesplat::test {

/// What is wrong; nothing: all is well.
using Complaint = std::optional<std::string>;

/// How often a play came to something, by name: so tests see that plays reach what they are about.
using Reached = std::map<std::string, uint64_t>;

/// A play. Its figures are added to `reached`, if there is one.
using Play = Complaint (*)(std::span<const uint8_t> bytes, Reached* reached);

/// Valid messages of anyone at the master, also those that nobody sends who is well. Whatever they were, what the
/// master sends can be decoded, its messages are bounded, nobody gets a lease but samplers, and when those who played
/// have gone, a session of honest processes gets its view.
Complaint play_master(std::span<const uint8_t> bytes, Reached* reached = nullptr);

/// Events of several packers at a viewer, out of order, doubled, lost and made up. In the end one packer is there, and
/// the replica has its digest.
Complaint play_receiver(std::span<const uint8_t> bytes, Reached* reached = nullptr);

}  // namespace telesplat::test
