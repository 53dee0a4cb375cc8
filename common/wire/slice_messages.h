// Messages about volumes: the slabs of samplers, the voxels they fetch, the slice images they make (T4.5, T5.3, T7.4).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/volume/levels.h"
#include "common/volume/shear.h"
#include "common/wire/limits.h"
#include "common/wire/moments.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

// ---- control: data and samplers (DEALER) <-> master (ROUTER) -------------------------------------------------------

/// Data server -> master: the number of visible voxels of each of its slices in this epoch. The master cuts slabs by
/// them.
struct SliceWeights {
  static constexpr std::string_view kName = "slice_weights";
  InstanceId data;
  EpochId epoch;
  uint64_t begin = 0;            ///< the first slice
  std::vector<uint32_t> voxels;  ///< voxels of slices begin, begin + 1, ... (as bin, little-endian u32)
  double bytes_per_voxel = 0;    ///< estimated
  template <class F> static void fields(F& f, auto& m) {
    f("data", m.data); f("epoch", m.epoch); f("begin", m.begin); f("voxels", m.voxels);
    f("bytes_per_voxel", m.bytes_per_voxel);
  }
};

/// One transfer of the assignment sheet (T5.3): in `round` this sampler fetches slices [begin, end) from this data
/// server.
struct SheetEntry {
  uint64_t round = 0;
  std::string endpoint;
  uint64_t begin = 0, end = 0;
  bool operator==(const SheetEntry&) const = default;
  template <class F> static void fields(F& f, auto& m) {
    f("round", m.round); f("endpoint", m.endpoint); f("begin", m.begin); f("end", m.end);
  }
};

/// Master -> sampler: in this partition of the volume you hold the slab [begin, end). Fetch the slices that you lack,
/// in the sheet's order. The sheet covers one slice more on both sides. Leases of an older partition come until this
/// one is ready.
struct SlabAssignment {
  static constexpr std::string_view kName = "slab_assignment";
  uint64_t partition = 0;         ///< numbered from 1
  uint64_t slab = 0, slabs = 1;   ///< begin == end: this sampler is spare
  uint64_t begin = 0, end = 0;
  std::vector<SheetEntry> sheet;  ///< at most kMaxSlabs
  template <class F> static void fields(F& f, auto& m) {
    f("partition", m.partition); f("slab", m.slab); f("slabs", m.slabs); f("begin", m.begin); f("end", m.end);
    f("sheet", m.sheet, kMaxSlabs);
  }
};

/// Sampler -> master: I hold my slab of this partition, in the session's newest epoch that I know.
struct SlabReady {
  static constexpr std::string_view kName = "slab_ready";
  InstanceId sampler;
  uint64_t partition = 0;
  EpochId epoch;
  uint64_t voxels = 0, bytes = 0;  ///< voxels held; bytes received for them
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("partition", m.partition); f("epoch", m.epoch); f("voxels", m.voxels);
    f("bytes", m.bytes);
  }
};

/// A viewer that a sampling frame serves.
struct SliceView {
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;  ///< as requested
  uint64_t buffers = 0;     ///< ViewRequest::buffers
  Moments moments;          ///< up to the frame's beginning
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("request", m.request); f("camera", m.camera); f("buffers", m.buffers);
    f("moments", m.moments);
  }
};

/// Master -> sampler, in answer to a lease_request: splat your slab into slice images of this frame.
struct SliceLease {
  static constexpr std::string_view kName = "slice_lease";
  LeaseId lease;
  FrameId frame;
  EpochId epoch;
  uint64_t partition = 0;
  uint64_t slab = 0, slabs = 1;  ///< the frame is complete with one delivery of each
  uint64_t begin = 0, end = 0;   ///< the slab's slices
  volume::ShearFrame shear;      ///< the receiver checks it against the session's grid before use
  std::vector<SliceView> views;  ///< at least one, at most kMaxViews
  Moments moments;               ///< from the lease on; a sampler sends it back with its own
  InstanceId master;             ///< master that numbers leases and frames
  std::vector<uint32_t> seal;    ///< as Lease::seal
  template <class F> static void fields(F& f, auto& m) {
    f("lease", m.lease); f("frame", m.frame); f("epoch", m.epoch); f("partition", m.partition); f("slab", m.slab);
    f("slabs", m.slabs); f("begin", m.begin); f("end", m.end); f("shear", m.shear); f("views", m.views, kMaxViews);
    f("moments", m.moments); f("master", m.master); f("seal", m.seal, kSealWords);
  }
};

// ---- voxels: sampler (DEALER) <-> data (ROUTER) --------------------------------------------------------------------

/// Sampler -> data: send voxels of these slices that the epoch's transfer function shows and whose level is not in
/// `have`.
struct VoxelRequest {
  static constexpr std::string_view kName = "voxel_request";
  EpochId epoch;
  uint64_t step = 0;            ///< step of a time-varying volume
  uint64_t begin = 0, end = 0;  ///< slices
  uint64_t round = 0;           ///< round of the sheet: requests of earlier rounds are served first
  Bytes have;                   ///< volume::LevelSet; empty: no levels
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("step", m.step); f("begin", m.begin); f("end", m.end); f("round", m.round);
    f("have", m.have, size_t{volume::kMaxLevels / 8});
  }
};
/// Its answer. `known` is false if the server does not know the epoch (yet), has none of the slices or is too busy: ask
/// again after a while. It may have fewer slices than were asked for (those from begin to end, at most 64 or about
/// 32 MB): ask for the rest.
struct VoxelData {
  static constexpr std::string_view kName = "voxel_data";
  static constexpr bool kBulk = true;
  EpochId epoch;
  uint64_t step = 0;
  uint64_t begin = 0, end = 0;
  bool known = false;
  uint64_t voxels = 0;
  Bytes have;   ///< as requested
  Bytes shown;  ///< volume::LevelSet: the sampler now has all voxels of these slices in these levels
  Bytes data;   ///< volume::encode_voxels
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("step", m.step); f("begin", m.begin); f("end", m.end); f("known", m.known);
    f("voxels", m.voxels); f("have", m.have, size_t{volume::kMaxLevels / 8});
    f("shown", m.shown, size_t{volume::kMaxLevels / 8}); f("data", m.data, kMaxBulkBytes);
  }
};

// ---- slice images: sampler (PUSH) -> packer (PULL), packer (ROUTER) -> viewer (DEALER) -----------------------------

/// Sampler -> packer: the slice images of one slab.
struct SliceImages {
  static constexpr std::string_view kName = "slice_images";
  static constexpr bool kBulk = true;
  InstanceId sampler;
  SliceLease lease;     ///< as leased, with moments up to the encoded images
  uint64_t voxels = 0;  ///< number of voxels that were splatted
  Bytes data;           ///< images (volume/slices/image.h), one after the other
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("lease", m.lease); f("voxels", m.voxels);
    f("data", m.data, kMaxBulkBytes);
  }
};

/// Packer -> viewer: a complete frame, cropped to the part that this viewer may see. Frames go in order; at most as
/// many are unacknowledged as the viewer has buffers.
struct SliceFrame {
  static constexpr std::string_view kName = "slice_frame";
  static constexpr bool kBulk = true;
  InstanceId packer;
  EpochId epoch;
  FrameId frame;
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;            ///< as requested
  volume::ShearFrame shear;
  uint64_t slabs = 1, voxels = 0;     ///< slabs and voxels that the frame was made from
  Moments moments;                    ///< moments of the slab that completed it
  Bytes data;                         ///< image (volume/slices/image.h)
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("epoch", m.epoch); f("frame", m.frame); f("viewer", m.viewer); f("request", m.request);
    f("camera", m.camera); f("shear", m.shear); f("slabs", m.slabs); f("voxels", m.voxels); f("moments", m.moments);
    f("data", m.data, kMaxBulkBytes);
  }
};
/// Viewer -> packer: this frame has left its buffer (it was decoded and replaced an older one, or was displayed and
/// freed). Frame 0: the viewer has just connected.
struct SliceAck {
  static constexpr std::string_view kName = "slice_ack";
  InstanceId viewer;
  FrameId frame;
  uint64_t buffers = 1;   ///< buffers that the viewer has, 1 to kMaxBuffers
  bool in_order = false;  ///< false: of the frames that wait for this viewer, send only the newest
  bool damaged = false;   ///< the frame could not be decoded
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("frame", m.frame); f("buffers", m.buffers); f("in_order", m.in_order);
    f("damaged", m.damaged);
  }
};

// clang-format on

}  // namespace telesplat::wire
