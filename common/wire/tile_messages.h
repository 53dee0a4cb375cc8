// Messages about tiles of depth images (surfaces, Julia sets), or of pictures: their leases, the data that samplers
// fetch for them, and the results.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/geometry/mesh_chunk.h"
#include "common/wire/limits.h"
#include "common/wire/moments.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

/// Viewer -> master: sample this view. With `buffers` 0 (asynchronous coupling) only the newest request of a viewer
/// waits: it replaces the one before. Otherwise (synchronous: 1, loose: the buffers of T6.4) requests wait in order, at
/// most `buffers` of a viewer; more are dropped.
struct ViewRequest {
  static constexpr std::string_view kName = "view_request";
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;  ///< predicted pose; width x height is the sampling size
  Moments moments;          ///< requested_s is set; the master adds the others
  uint64_t buffers = 0;     ///< at most kMaxBuffers
  double footprint = 0;     ///< width of a displayed pixel at unit depth, for scenes whose detail depends on it; 0:
                            ///< width\nof one of camera's pixels
  std::string wall;           ///< SwapReady::wall of a viewer that presents with others; empty: it presents alone
  uint64_t wall_viewers = 0;  ///< viewers that the wall has, at most kMaxWallViewers
  uint64_t ask = 0;           ///< Swap::ask: views with the same number show one head's pose; 0: the viewer's own head
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("request", m.request); f("camera", m.camera); f("moments", m.moments);
    f("buffers", m.buffers); f("footprint", m.footprint); f("wall", m.wall); f("wall_viewers", m.wall_viewers);
    f("ask", m.ask);
  }
};

// ---- control: samplers and packer (DEALER) <-> master (ROUTER) -----------------------------------------------------

/// Sampler -> master: send one tile as soon as there is one. Samplers of a volume ask for their next frame with it.
struct LeaseRequest {
  static constexpr std::string_view kName = "lease_request";
  InstanceId sampler;
  template <class F> static void fields(F& f, auto& m) { f("sampler", m.sampler); }
};

/// Master -> sampler: sample this tile before the lease expires.
struct Lease {
  static constexpr std::string_view kName = "lease";
  LeaseId lease;
  FrameId frame;
  EpochId epoch;
  InstanceId viewer;          ///< viewer that asked
  RequestId request;          ///< number of its request
  uint64_t tile = 0;          ///< its number in the frame; a tile that is leased anew keeps it
  uint64_t step = 1;          ///< the frame has every step-th pixel of every step-th row (geometry::subsample)
  uint64_t block = 0, blocks_in_frame = 0;  ///< the packer packs and publishes all tiles of a block as one
  geometry::Camera camera;    ///< camera of the whole frame
  geometry::Rect rect;        ///< the tile in it
  geometry::Rect block_rect;  ///< the block in it; the tile lies in the block
  bool extra = false;         ///< rays beyond those that the view asked for: the tile completes no update
  uint64_t rays = 0;          ///< rays to cast: one for each pixel of mask; without a mask, of rect
  std::vector<uint32_t> mask; ///< codec::encode_mask, of rect's size; empty: all pixels. Samplers do not send it back
  double footprint = 0;       ///< as ViewRequest::footprint; 0: the width of one of camera's pixels, divided by step
  Moments moments;            ///< up to the lease; a sampler sends it back with its own
  InstanceId master;          ///< master that numbers leases and frames
  std::vector<uint32_t> seal; ///< kSealWords numbers, of this master and for this sampler (lease_seal.h)
  template <class F> static void fields(F& f, auto& m) {
    f("lease", m.lease); f("frame", m.frame); f("epoch", m.epoch); f("viewer", m.viewer); f("request", m.request);
    f("tile", m.tile); f("step", m.step); f("block", m.block); f("blocks_in_frame", m.blocks_in_frame);
    f("camera", m.camera); f("rect", m.rect); f("block_rect", m.block_rect); f("extra", m.extra); f("rays", m.rays);
    f("mask", m.mask, kMaxMaskWords); f("footprint", m.footprint); f("moments", m.moments);
    f("master", m.master); f("seal", m.seal, kSealWords);
  }
};

/// Sampler -> master: I still fetch data that this lease needs; do not give it to another sampler yet.
struct LeaseExtend {
  static constexpr std::string_view kName = "lease_extend";
  InstanceId sampler;
  LeaseId lease;
  template <class F> static void fields(F& f, auto& m) { f("sampler", m.sampler); f("lease", m.lease); }
};

/// Packer -> master: the packer has this tile, or this slab of a volume's frame. `moments` has the time of each step.
struct TileDone {
  static constexpr std::string_view kName = "tile_done";
  FrameId frame;
  uint64_t tile = 0;
  LeaseId lease;
  InstanceId sampler;
  RequestId request;                           ///< Lease::request; 0 if a frame serves several viewers
  uint64_t step = 1;                           ///< Lease::step
  bool extra = false;                          ///< Lease::extra
  uint64_t rays = 0;                           ///< Lease::rays
  geometry::Rect rect;                         ///< Lease::rect
  uint64_t samples = 0, kept = 0;              ///< covered pixels before and after redundancy elimination
  uint64_t bytes_sampled = 0, bytes_sent = 0;  ///< bytes of the encoded tile as received, as published
  /// Largest difference between the published and the sampled points: depth, m; angles of normals, degrees; each
  /// channel of colour, in steps of 255. 0: exact.
  double depth_error_m = 0, normal_error_deg = 0, colour_error = 0;
  Moments moments;
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("tile", m.tile); f("lease", m.lease); f("sampler", m.sampler);
    f("request", m.request); f("step", m.step);
    f("extra", m.extra); f("rays", m.rays); f("rect", m.rect); f("samples", m.samples); f("kept", m.kept);
    f("bytes_sampled", m.bytes_sampled); f("bytes_sent", m.bytes_sent);
    f("depth_error_m", m.depth_error_m); f("normal_error_deg", m.normal_error_deg);
    f("colour_error", m.colour_error); f("moments", m.moments);
  }
};

/// Packer -> master: a leased tile, or a slab of a volume's frame, came and cannot be used. Its sampler made it wrong,
/// or the frame is wrong: the master must not lease it for ever.
struct TileRefused {
  static constexpr std::string_view kName = "tile_refused";
  FrameId frame;
  uint64_t tile = 0;  ///< Lease::tile, SliceLease::slab
  LeaseId lease;
  InstanceId sampler;
  std::string why;
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("tile", m.tile); f("lease", m.lease); f("sampler", m.sampler); f("why", m.why);
  }
};

// ---- plans: master (ROUTER) <-> packer (DEALER) --------------------------------------------------------------------

/// Master -> packer: which rays of this view does the model lack?
struct PlanRequest {
  static constexpr std::string_view kName = "plan_request";
  FrameId frame;            ///< frame that its tiles will belong to
  EpochId epoch;
  InstanceId viewer;        ///< viewer that asked
  RequestId request;        ///< number of its request
  geometry::Camera camera;  ///< camera of the view
  bool extra = false;       ///< the view itself is planned already: which further rays are worth casting, from where?
  uint64_t round = 0;       ///< extra: number of earlier questions of this kind about this viewer's views
  bool still = false;       ///< the viewer's previous view had the same camera
  uint64_t tile_size = 256; ///< no tile has longer sides
  uint64_t tile_rays = 0;   ///< a tile that is longer than 32 pixels has no more rays; 0: no limit
  /// extra: upper limit of all rays together, about. Else: limit, about, of rays that refine surfaces which the
  /// model shows too coarsely; other such surfaces wait for later views. 0: no limit.
  uint64_t most_rays = 0;
  Moments moments;          ///< up to the question
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("epoch", m.epoch); f("viewer", m.viewer); f("request", m.request); f("camera", m.camera);
    f("extra", m.extra); f("round", m.round); f("still", m.still); f("tile_size", m.tile_size);
    f("tile_rays", m.tile_rays); f("most_rays", m.most_rays); f("moments", m.moments);
  }
};

/// Packer -> master: the tiles of that frame. Without tiles the frame is over; if it was a view's (not extra), the
/// packer has published that its update is complete.
struct Plan {
  static constexpr std::string_view kName = "plan";
  static constexpr bool kBulk = true;
  FrameId frame;
  EpochId epoch;
  geometry::Camera camera;       ///< camera of the tiles: the request's; for extra rays finer, or from beside
  bool full = false;             ///< the model knows too little: sample all pixels, as without a plan
  std::vector<uint32_t> tiles;   ///< kPlanNumbers a tile: x, y, width, height, rays, words of its mask; most
                                 ///< urgent first; no two overlap
  std::vector<uint32_t> masks;   ///< all tiles' masks, one after the other (codec::encode_mask); 0 words: all pixels
  std::map<std::string, double> figures;  ///< for the record: rays.nothing, rays.sparse, rays.edge, rays.stale,
                                          ///< rays.validation, rays.refinement, rays.cell, pixels.*, plan_ms
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("epoch", m.epoch); f("camera", m.camera); f("full", m.full);
    f("tiles", m.tiles, kPlanNumbers * kMaxTiles); f("masks", m.masks, kMaxPlanWords); f("figures", m.figures);
  }
};

/// Master -> packer: no more tiles of this frame come, because a newer view of its viewer overtook it. The packer keeps
/// the tiles that it has, and publishes that the update is over.
struct FrameEnd {
  static constexpr std::string_view kName = "frame_end";
  FrameId frame;
  EpochId epoch;
  InstanceId viewer;
  RequestId request;
  uint64_t tiles = 0;       ///< Lease::blocks_in_frame
  geometry::Camera camera;  ///< camera of the frame
  Moments moments;          ///< moments of the view, until it was planned
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("epoch", m.epoch); f("viewer", m.viewer); f("request", m.request); f("tiles", m.tiles);
    f("camera", m.camera); f("moments", m.moments);
  }
};

// ---- blocks of a mesh: sampler, packer (DEALER) <-> data (ROUTER) --------------------------------------------------

/// array: the array that colours the mesh in this epoch (scene::Colouring::array): the chunks hold that array's values
/// in place of colours; empty: the file's own colours. A data server that does not have it does not answer.
struct ChunkListRequest {
  static constexpr std::string_view kName = "chunk_list_request";
  EpochId epoch;
  std::string array;
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); f("array", m.array); }
};
struct ChunkList {
  static constexpr std::string_view kName = "chunk_list";
  static constexpr bool kBulk = true;
  static constexpr size_t kElements = 13 * geometry::kMaxChunks;
  EpochId epoch;
  std::vector<geometry::ChunkInfo> chunks;  ///< at most kMaxChunks
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); f("chunks", m.chunks); }
};
struct ChunkRequest {
  static constexpr std::string_view kName = "chunk_request";
  EpochId epoch;
  ChunkId chunk;
  std::string array;
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("chunk", m.chunk); f("array", m.array);
  }
};
struct Chunk {
  static constexpr std::string_view kName = "chunk";
  static constexpr bool kBulk = true;
  EpochId epoch;
  ChunkId chunk;
  Bytes data;  ///< layout: geometry/mesh_chunk.h; empty if the server has no such chunk
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("chunk", m.chunk); f("data", m.data, kMaxBulkBytes);
  }
};

// ---- depth images: sampler (PUSH) -> packer (PULL) -----------------------------------------------------------------

struct DepthTile {
  static constexpr std::string_view kName = "depth_tile";
  static constexpr bool kBulk = true;
  InstanceId sampler;
  Lease lease;  ///< as leased, with moments as far as the encoded tile
  Bytes image;  ///< codec stream of lease.rect's size
  bool coarse = false;  ///< some of it was sampled from coarser data than the lease asks for: it is to be sampled again
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("lease", m.lease); f("image", m.image, kMaxBulkBytes); f("coarse", m.coarse);
  }
};

// ---- pictures, where views come as these: sampler (PUSH) -> packer (PULL), packer (ROUTER) -> viewer (DEALER) -------

/// Sampler -> packer: a tile of a view, drawn and shaded.
struct PictureTile {
  static constexpr std::string_view kName = "picture_tile";
  static constexpr bool kBulk = true;
  InstanceId sampler;
  Lease lease;  ///< as leased, with moments up to the encoded tile
  Bytes image;  ///< JPEG, of lease.rect's size
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("lease", m.lease); f("image", m.image, kMaxBulkBytes);
  }
};

/// Packer -> the viewer that asked: a tile of its view. Tiles come as soon as they are drawn; the last one completes
/// the picture.
struct Picture {
  static constexpr std::string_view kName = "picture";
  static constexpr bool kBulk = true;
  InstanceId packer;
  EpochId epoch;
  FrameId frame;
  InstanceId viewer;
  RequestId request;
  uint64_t tile = 0, tiles_in_frame = 0;
  geometry::Camera camera;  ///< camera of the whole view, as requested
  geometry::Rect rect;      ///< the tile in it
  Moments moments;          ///< moments of the tile, until it was published
  Bytes image;              ///< JPEG, of rect's size
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("epoch", m.epoch); f("frame", m.frame); f("viewer", m.viewer); f("request", m.request);
    f("tile", m.tile); f("tiles_in_frame", m.tiles_in_frame); f("camera", m.camera); f("rect", m.rect);
    f("moments", m.moments); f("image", m.image, kMaxBulkBytes);
  }
};

// clang-format on

}  // namespace telesplat::wire
