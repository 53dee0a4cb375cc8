// The interface of a sampler's work, with an implementation for each pipeline: TileWork (points), VolumeWork (slices).
// It holds leases, says when the next one can be sampled, and turns it into a message for the packer. The service
// around it asks for leases and sends. works.h makes the work for a kind of scene. One thread; nothing here may wait.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/metrics/recorder.h"
#include "common/net/master_link.h"

namespace telesplat::sampler {

/// Says if a lease can be sampled.
struct Readiness {
  enum class State {
    kReady,     ///< it may be sampled now
    kWaits,     ///< not before again_s, or before a message comes over one of sockets()
    kHopeless,  ///< never: drop the lease; when it has run out, the master gives it to another sampler
  };
  State state = State::kReady;
  double again_s = 1e300;
};

/// A message for the packer, and the times of its making on this machine's clock.
struct Delivery {
  std::string_view type;
  std::string body;
  double begin_s = 0, sampled_s = 0, encoded_s = 0;
  metrics::SpanOf of;  ///< frame and tile that were sampled
};

class Work {
 public:
  static constexpr size_t kMaxHeld = 64;  ///< leases held at most; more were not asked for and are dropped

  virtual ~Work() = default;

  /// Returns the way of sampling, for people and records: "ray", "raster", "julia", "volume".
  virtual const char* name() const = 0;
  /// To be called for every welcome of the master, in order.
  virtual void on_welcome(const wire::Welcome& session) = 0;
  /// True if enough is known of the scene to ask for leases.
  virtual bool takes_leases() const = 0;

  /// Takes a message of the master that not every process knows. Rejects it through `from` if it is not for this work.
  /// Drops leases while `takes_leases` is false.
  virtual void take(net::Socket& from, const net::Message& message, bool takes_leases, double now_s) = 0;
  /// Number of leases held; drop_leases() forgets them.
  virtual size_t leases() const = 0;
  virtual void drop_leases() = 0;

  /// Drops hopeless leases, then says if the first lease can be sampled; without leases it waits.
  virtual Readiness look_at_next(double now_s) = 0;
  /// Takes the first lease and samples it. Precondition: look_at_next() said kReady, and nothing happened since.
  virtual Delivery sample_next() = 0;

  /// Called in every turn of the service's loop: asks data servers for the data that the leases need.
  virtual void fetch(double now_s) = 0;
  /// Sockets of its own; receive() takes their messages.
  virtual std::vector<net::Socket*> sockets() = 0;
  virtual void receive(double now_s) = 0;
  /// Adds its figures to a status report.
  virtual void add_status(net::MasterLink::Values& values) const = 0;
};

}  // namespace telesplat::sampler
