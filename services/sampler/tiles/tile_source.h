// The interface of what samples tiles, one implementation a kind of scene: MeshTiles, JuliaTiles; ReplayTiles for
// studies. It fetches what a lease needs, then samples it. TileWork (work.h) holds the leases and encodes the depth
// images. One thread; nothing here may wait.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/core/clock.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"
#include "common/net/master_link.h"
#include "services/sampler/work.h"

namespace telesplat::sampler {

/// A lease and when it came, on this machine's clock.
struct HeldLease {
  wire::Lease lease;  ///< without its mask
  double received_s = 0;
  double waits_since_s = 0;  ///< it was the next one, and what it needs was not there; 0: that was not so
  std::optional<image::PixelMask> mask;  ///< what lease.mask says: the pixels to be sampled, counted from its rectangle

  const image::PixelMask* pixels() const { return mask ? &*mask : nullptr; }
};

/// A sampled tile and when its sampling began and ended, on this machine's clock.
struct Sampled {
  image::DepthImage image;  ///< canonical, of the lease's rectangle, empty where its mask is
  double begin_s = 0, end_s = 0;
};

class TileSource {
 public:
  virtual ~TileSource() = default;

  /// How it samples, for people and records: "ray", "raster", "julia", "replay".
  virtual const char* name() const = 0;
  /// A welcome of the master came: every one is told, in order.
  virtual void on_welcome(const wire::Welcome& session) = 0;
  /// Whether enough is known of the scene to ask for leases.
  virtual bool takes_leases() const { return true; }
  /// Precondition of sample(): this said kReady for the lease, and nothing happened since.
  virtual Readiness readiness(const HeldLease& lease, double now_s) = 0;
  virtual Sampled sample(const HeldLease& lease) = 0;

  /// Called in every turn of the service's loop: asks others for what `next` (null: no lease is held) needs.
  virtual void fetch(const HeldLease* next, double now_s) { (void)next, (void)now_s; }
  /// Connections of its own; receive() takes what they brought.
  virtual std::vector<net::Socket*> sockets() { return {}; }
  virtual void receive() {}
  /// Adds what it counts to a status report.
  virtual void add_status(net::MasterLink::Values& values) const { (void)values; }
};

/// Runs `sample` and takes its time.
Sampled timed(auto sample) {
  Sampled out;
  out.begin_s = monotonic_s();
  out.image = sample();
  out.end_s = monotonic_s();
  return out;
}

}  // namespace telesplat::sampler
