// The interface of a sampler's work, one implementation a pipeline: TileWork (points) and VolumeWork (slices). Work
// holds leases, says when the next one can be sampled, and makes of it a message for the packer. The service around it
// asks for leases and sends. works.h makes the work for a kind of scene. One thread; nothing here may wait.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/metrics/recorder.h"
#include "common/net/master_link.h"

namespace telesplat::sampler {

/// Whether a lease can be sampled.
struct Readiness {
  enum class State {
    kReady,     ///< it may be sampled now
    kWaits,     ///< not before again_s; sooner if one of sockets() brings something
    kHopeless,  ///< never: the lease is to be dropped; the master gives it to another sampler when it has run out
  };
  State state = State::kReady;
  double again_s = 1e300;
};

/// A message for the packer and how it came about, on this machine's clock.
struct Delivery {
  std::string_view type;
  std::string body;
  double begin_s = 0, sampled_s = 0, encoded_s = 0;
  metrics::SpanOf of;  ///< what was sampled
};

class Work {
 public:
  static constexpr size_t kMaxHeld = 64;  ///< leases; more were not asked for and are dropped

  virtual ~Work() = default;

  /// How it samples, for people and records: "ray", "raster", "julia", "replay", "volume".
  virtual const char* name() const = 0;
  /// A welcome of the master came: every one is told, in order.
  virtual void on_welcome(const wire::Welcome& session) = 0;
  /// Whether enough is known of the scene to ask for leases.
  virtual bool takes_leases() const = 0;

  /// A message of the master, other than those every process knows. `from` counts it if it is nothing for this work.
  /// Leases that come while `takes_leases` is false are dropped.
  virtual void take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) = 0;
  /// How many are held; drop_leases() forgets them.
  virtual size_t leases() const = 0;
  virtual void drop_leases() = 0;

  /// Whether the first lease can be sampled. Hopeless leases are dropped before; without any left it waits.
  virtual Readiness look_at_next(double now_s) = 0;
  /// Takes the first lease and samples it. Precondition: look_at_next() said kReady, and nothing happened since.
  virtual Delivery sample_next() = 0;

  /// Called in every turn of the service's loop: asks others for what the leases need.
  virtual void fetch(double now_s) = 0;
  /// Connections of its own; receive() takes what they brought.
  virtual std::vector<net::Socket*> sockets() = 0;
  virtual void receive(double now_s) = 0;
  /// Adds what it counts to a status report.
  virtual void add_status(net::MasterLink::Values& values) const = 0;
};

}  // namespace telesplat::sampler
