// Moments of a view's way: each process that takes part writes down when it did its step, and sends that on with its
// result. So the viewer knows how long each step of an update took (docs/metrics.md, stages.csv).
#pragma once

namespace telesplat::wire {

/// Seconds of the master's clock, in the order in which they come; 0: not reached yet, or this way lacks the step.
struct Moments {
  double requested_s = 0;      ///< the viewer sent its request
  double received_s = 0;       ///< the master had it
  double begun_s = 0;          ///< its turn came: the master asked for a plan, or cut the view into tiles
  double planned_s = 0;        ///< the plan came, or was given up
  double leased_s = 0;         ///< the master leased the tile, or the slab, to a sampler
  double lease_arrived_s = 0;  ///< the lease reached the sampler's machine
  double fetch_s = 0;          ///< a duration: before sample_begin_s, spent fetching data that the sampler lacked
  double sample_begin_s = 0, sample_end_s = 0;
  double encode_end_s = 0;
  double arrived_s = 0;    ///< the tile reached the packer's machine
  double receive_s = 0;    ///< the packer took it from its queue
  double packed_s = 0;     ///< decoded, reduced and encoded; for a part of a block: taken into the block
  double published_s = 0;  ///< handed to viewers with its block or frame; 0: another tile completed that

  bool operator==(const Moments&) const = default;
};

/// All moments, in their order on the wire.
inline constexpr double Moments::*kMoments[] = {
    &Moments::requested_s,  &Moments::received_s,      &Moments::begun_s,   &Moments::planned_s,
    &Moments::leased_s,     &Moments::lease_arrived_s, &Moments::fetch_s,   &Moments::sample_begin_s,
    &Moments::sample_end_s, &Moments::encode_end_s,    &Moments::arrived_s, &Moments::receive_s,
    &Moments::packed_s,     &Moments::published_s};

}  // namespace telesplat::wire
