// What a session's settings come to, as docs/tuning.md says it: numbers in, numbers out; no processes, no clocks.
#pragma once

#include "common/links/link.h"

namespace telesplat::launcher {

/// What can be tuned. A parameter that a kind of scene does not have is without effect on it.
struct TuneSettings {
  int samplers = 1;
  int tile_px = 256;           ///< pixels a side of a tile
  double scale = 1;            ///< sampled pixels a displayed pixel, on each axis; above 0, at most 1
  bool adaptive = true;        ///< --sampling-size auto; `scale` is then what it came to when costs were measured
  int octree_depth = 5;        ///< levels
  double update_rate_hz = 20;  ///< view requests a second at most
  bool operator==(const TuneSettings&) const = default;
};

/// A way between processes: half a round trip each way, and seconds a byte.
struct Way {
  double rtt_s = 0, byte_s = 0;
};
/// What a link states of itself; jitter counts by its mean, stalls by the share of time that they take.
Way way_of(const links::Link& link);

/// A time that grows with what there is to do.
struct Line {
  double fixed = 0, slope = 0;
  double at(double x) const { return fixed + slope * x; }
};

/// Costs of computing and of the links. Times are seconds of one core that has nothing else to do.
struct TuneCosts {
  bool slices = false;    ///< a volume: slabs instead of tiles, voxels instead of rays
  bool steered = true;    ///< the packer plans which rays are cast
  bool polled = true;     ///< --coupling async: requests come at the update rate; else when the display has shown one
  double cores = 1;       ///< of this machine
  double others = 0;      ///< 0..1: share of them that others used
  double sample_s = 0;    ///< a ray (of volumes: a voxel); divided among a sampler's threads
  double encode_s = 0;    ///< a ray, by one thread
  double tile_s = 0;      ///< a tile, whatever is in it
  double connect_s = 0;   ///< a connection, each update: a message with what sockets and kernels do
  Line plan;              ///< a view, by its pixels
  Line pack;              ///< a tile, by its samples (of volumes: a slab, by the pixels of its slice images)
  double decode_s = 0;    ///< decoding and insertion of a point (of volumes: a pixel)
  Line patch_bytes;       ///< a tile, by the samples kept
  double tile_bytes = 0;  ///< that a sampler sends, a ray
  Way viewer, sampler;    ///< between viewers, or samplers, and the rest
  double covered = 1;     ///< 0..1: samples a ray
  double kept = 1;        ///< 0..1: what redundancy elimination keeps of the samples
  double checked = 0;     ///< 0..1: share of a view that is cast again whatever the head does
  double tile_share = 1;  ///< 0..1: tiles of a view in which any ray is cast
  double novelty_hz = 0;  ///< share of a view that becomes new in a second of this trajectory
  double voxels = 0, slice_pixels = 0;  ///< of volumes: an update's
  double display_pixels = 0;            ///< columns x rows
  double display_width = 0, display_height = 0;
  double select_s = 0, draw_s = 0;  ///< a frame: choosing; drawing, of one core
  double frame_s = 0;               ///< a frame, from begin to end
  double point_s = 0;               ///< the part of it that a drawn point costs
  double points_drawn = 0;          ///< when costs were measured
  int measured_depth = 5;           ///< of the octree, then
  double target_fps = 60;
  int data_servers = 1, viewers = 1, frames_in_flight = 2;
  int sampler_threads = 0;  ///< of each; 0: the cores shared among them
};

struct Prediction {
  double latency_s = 0;      ///< of a view update
  double updates_per_s = 0;  ///< of a viewer
  double age_s = 0;          ///< of what is displayed, just before the next update
  double quality_db = 0;     ///< proxy: 0 for a view sampled at the display's resolution just now
  double frame_s = 0;        ///< between displayed frames
  // What it is made of:
  double plan_s = 0, connections_s = 0, sampling_s = 0, packing_s = 0, tiles_way_s = 0, patches_way_s = 0,
         decoding_s = 0, queue_s = 0, bottleneck_s = 0;
  double rays = 0;  ///< cast for an update
};

/// Cores that are left to samplers and packer when others and the display have theirs; at least a quarter of one.
double free_cores(const TuneCosts& costs, const TuneSettings& settings);
/// Threads of each sampler.
int threads_of(const TuneCosts& costs, int samplers);
/// How much longer samplers take because their threads outnumber the free cores; 1: not at all.
double crowding(const TuneCosts& costs, const TuneSettings& settings);
/// Connections that an update uses, O(N*M) of N samplers and M partners.
double connections(const TuneCosts& costs, int samplers);
/// A frame of the display, s.
double frame_time(const TuneCosts& costs, const TuneSettings& settings);

/// Preconditions: samplers, tile_px, octree_depth >= 1; 0 < scale <= 1; update_rate_hz > 0.
Prediction predict(const TuneCosts& costs, const TuneSettings& settings);

}  // namespace telesplat::launcher
