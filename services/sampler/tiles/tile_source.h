// The interface for sampling tiles, with an implementation for each kind of scene: MeshTiles, JuliaTiles. It fetches
// the data that a lease needs, then samples it. TileWork (work.h) holds the leases and encodes the depth images. One
// thread; nothing here may wait.
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

/// A lease and the time when it came, on this machine's clock.
struct HeldLease {
  wire::Lease lease;  ///< without its mask
  double received_s = 0;
  double waits_since_s = 0;              ///< since then it is the next one and its data is missing; 0: it need not wait
  std::optional<image::PixelMask> mask;  ///< lease.mask, decoded: pixels to be sampled, from the rectangle's corner

  const image::PixelMask* pixels() const { return mask ? &*mask : nullptr; }
};

/// A sampled tile, and the times when its sampling began and ended, on this machine's clock.
struct Sampled {
  image::DepthImage image;  ///< canonical, of the lease's rectangle; pixels outside its mask are empty
  double begin_s = 0, end_s = 0;
  bool coarse = false;  ///< wire::DepthTile::coarse
};

class TileSource {
 public:
  virtual ~TileSource() = default;

  /// Returns the way of sampling, for people and records: "ray", "raster", "julia".
  virtual const char* name() const = 0;
  /// To be called for every welcome of the master, in order.
  virtual void on_welcome(const wire::Welcome& session) = 0;
  /// True if enough is known of the scene to ask for leases.
  virtual bool takes_leases() const { return true; }
  /// Precondition of sample(): readiness() said kReady for the lease, and nothing happened since.
  virtual Readiness readiness(const HeldLease& lease, double now_s) = 0;
  virtual Sampled sample(const HeldLease& lease) = 0;

  /// Called in every turn of the service's loop: asks for the data that `next` (null: no lease is held) needs.
  virtual void fetch(const HeldLease* next, double now_s) { (void)next, (void)now_s; }
  /// Sockets of its own; receive() takes their messages.
  virtual std::vector<net::Socket*> sockets() { return {}; }
  virtual void receive() {}
  /// Adds its figures to a status report.
  virtual void add_status(net::MasterLink::Values& values) const { (void)values; }
};

/// Runs `sample` and notes its begin and end.
Sampled timed(auto sample) {
  Sampled out;
  out.begin_s = monotonic_s();
  out.image = sample();
  out.end_s = monotonic_s();
  return out;
}

}  // namespace telesplat::sampler
