// Every message between Telesplat processes: one struct each, with units, shapes and limits. docs/protocol.md has the tables.
//
// On the wire a message is two ZeroMQ frames: its kName, then one msgpack map of the fields below plus "v", the protocol version.
// Times are seconds of the master's clock. Bulk fields are spans: when encoding they point to the sender's bytes; when decoded
// they point into the received frame, which must outlive them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/box.h"
#include "common/geometry/camera.h"
#include "common/geometry/mesh_chunk.h"
#include "common/volume/levels.h"
#include "common/volume/shear.h"

namespace telesplat::wire {

// Structs and their fields() stand as tables.
// clang-format off

inline constexpr uint64_t kProtocolVersion = 3;

inline constexpr size_t kMaxString = 4096;            ///< bytes of any string
inline constexpr size_t kMaxFact = 64u << 10;         ///< bytes of a text in facts and arguments: transfer functions
inline constexpr size_t kMaxControlBytes = 1u << 20;  ///< whole body of a message without bulk fields
inline constexpr size_t kMaxBulkBytes = 256u << 20;   ///< whole body of a message with bulk fields
inline constexpr size_t kMaxKeys = 1u << 21;          ///< cluster keys in one message
inline constexpr size_t kMaxEntries = 4096;           ///< entries of a map or list
inline constexpr uint64_t kMaxTiles = 1u << 16;       ///< tiles of a frame, and blocks
inline constexpr uint64_t kMaxStep = 16;              ///< of a coarse frame
inline constexpr int64_t kMaxTilePixels = 1 << 24;    ///< of a tile: what the codec takes
inline constexpr uint64_t kMaxSlabs = 1024;           ///< of a volume, and samplers that share it
inline constexpr uint64_t kMaxBuffers = 8;            ///< of a loosely coupled viewer
inline constexpr size_t kMaxViews = 64;               ///< viewers that one sampling frame of a volume serves

using Bytes = std::span<const std::byte>;

// ---- control: every process (DEALER) <-> master (ROUTER) ----------------------------------------------------------------

/// First message of every process, repeated when the master asks "who_are_you" or a bound endpoint changes.
struct Hello {
  static constexpr std::string_view kName = "hello";
  std::string role;      ///< "data", "sampler", "packer", "viewer", "ctl"
  std::string name;      ///< for people: "sampler-1"
  InstanceId instance;
  uint64_t pid = 0;
  double sent_s = 0;     ///< sender's own clock: for the clock offset
  std::map<std::string, std::string> endpoints;  ///< bound sockets others connect to: data {"chunks"}, packer {"tiles","patches","state"}
  std::map<std::string, std::string> facts;      ///< data: "scene", "kind", "triangles"; sampler: "sampler"; viewer: "renderer", ...
  std::map<std::string, double> parameters;      ///< data: of the scene, as it begins: julia/parameters.h; empty otherwise
  geometry::Box box_room;  ///< data: the data set's box; empty otherwise
  template <class F> static void fields(F& f, auto& m) {
    f("role", m.role); f("name", m.name); f("instance", m.instance); f("pid", m.pid); f("sent_s", m.sent_s);
    f("endpoints", m.endpoints); f("facts", m.facts, kMaxFact); f("parameters", m.parameters); f("box_room", m.box_room);
  }
};

/// The session as the master knows it; sent in answer to hello and again to everyone whenever it changes.
struct Welcome {
  static constexpr std::string_view kName = "welcome";
  InstanceId master;
  double hello_sent_s = 0;  ///< Hello::sent_s, echoed; 0 in an unasked welcome
  double master_s = 0;      ///< master's clock when sent
  EpochId epoch;
  uint64_t octree_depth = 0;
  geometry::Box box_room;                        ///< empty until a data server said hello
  std::map<std::string, std::string> endpoints;  ///< "chunks", "tiles", "patches", "state": as far as known
  std::map<std::string, std::string> facts;      ///< "scene", "kind", "triangles"
  std::map<std::string, double> parameters;      ///< of the scene in this epoch
  std::map<std::string, double> settings;        ///< packing.* and session.* values
  template <class F> static void fields(F& f, auto& m) {
    f("master", m.master); f("hello_sent_s", m.hello_sent_s); f("master_s", m.master_s); f("epoch", m.epoch);
    f("octree_depth", m.octree_depth); f("box_room", m.box_room); f("endpoints", m.endpoints); f("facts", m.facts, kMaxFact);
    f("parameters", m.parameters); f("settings", m.settings);
  }
};

/// Master to a peer it does not know (it was restarted): say hello again.
struct WhoAreYou {
  static constexpr std::string_view kName = "who_are_you";
  InstanceId master;
  template <class F> static void fields(F& f, auto& m) { f("master", m.master); }
};

/// Viewer -> master: sample this view. With `buffers` 0 (asynchronous coupling) only the newest request of a viewer waits; it replaces the one
/// before. Otherwise (synchronous: 1, loose: the buffers of T6.4) requests wait in order, at most so many of a viewer; more are dropped.
struct ViewRequest {
  static constexpr std::string_view kName = "view_request";
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;  ///< predicted pose; width x height is the sampling size
  double sent_s = 0;
  uint64_t buffers = 0;     ///< at most kMaxBuffers
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("request", m.request); f("camera", m.camera); f("sent_s", m.sent_s); f("buffers", m.buffers);
  }
};

/// Sampler -> master: one tile, please, as soon as there is one.
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
  InstanceId viewer;      ///< who asked
  RequestId request;      ///< which of its requests
  uint64_t tile = 0;        ///< its number in the frame; a tile that is leased anew keeps it
  uint64_t step = 1;        ///< the frame has every step-th pixel of every step-th row of the view (geometry::subsample)
  uint64_t block = 0, blocks_in_frame = 0;  ///< the packer packs and publishes all tiles of a block as one
  geometry::Camera camera;  ///< of the whole frame
  geometry::Rect rect;      ///< the tile in it
  geometry::Rect block_rect;  ///< the block in it; the tile lies in the block
  double leased_s = 0;
  template <class F> static void fields(F& f, auto& m) {
    f("lease", m.lease); f("frame", m.frame); f("epoch", m.epoch); f("viewer", m.viewer); f("request", m.request);
    f("tile", m.tile); f("step", m.step); f("block", m.block); f("blocks_in_frame", m.blocks_in_frame); f("camera", m.camera);
    f("rect", m.rect); f("block_rect", m.block_rect); f("leased_s", m.leased_s);
  }
};

/// Sampler -> master: still fetching what this lease needs; do not give it to another yet.
struct LeaseExtend {
  static constexpr std::string_view kName = "lease_extend";
  InstanceId sampler;
  LeaseId lease;
  template <class F> static void fields(F& f, auto& m) { f("sampler", m.sampler); f("lease", m.lease); }
};

/// Packer -> master: the packer has this tile (end-to-end completion). Times tell who did what when.
struct TileDone {
  static constexpr std::string_view kName = "tile_done";
  FrameId frame;
  uint64_t tile = 0;
  LeaseId lease;
  InstanceId sampler;
  uint64_t step = 1;                           ///< Lease::step
  geometry::Rect rect;                         ///< Lease::rect
  uint64_t samples = 0, kept = 0;              ///< covered pixels before and after redundancy elimination
  uint64_t bytes_sampled = 0, bytes_sent = 0;  ///< encoded tile as received, as published
  double leased_s = 0, sample_begin_s = 0, sample_end_s = 0, encode_end_s = 0, receive_s = 0, packed_s = 0;
  template <class F> static void fields(F& f, auto& m) {
    f("frame", m.frame); f("tile", m.tile); f("lease", m.lease); f("sampler", m.sampler); f("step", m.step); f("rect", m.rect);
    f("samples", m.samples); f("kept", m.kept); f("bytes_sampled", m.bytes_sampled); f("bytes_sent", m.bytes_sent); f("leased_s", m.leased_s);
    f("sample_begin_s", m.sample_begin_s); f("sample_end_s", m.sample_end_s); f("encode_end_s", m.encode_end_s);
    f("receive_s", m.receive_s); f("packed_s", m.packed_s);
  }
};

/// Every process -> master, once a second: it lives, and its counters ("rss_mb", "messages_rejected", "points", ...).
struct StatusReport {
  static constexpr std::string_view kName = "status";
  InstanceId instance;
  std::map<std::string, double> values;
  template <class F> static void fields(F& f, auto& m) { f("instance", m.instance); f("values", m.values); }
};

/// Every process -> master: rows of a metrics table ("frames", "updates", "spans"; docs/metrics.md).
struct MetricRows {
  static constexpr std::string_view kName = "metric_rows";
  InstanceId instance;
  std::string table;
  std::vector<std::string> columns;  ///< for "spans": the span names that column "name" indexes
  std::vector<double> values;        ///< rows x columns, row-major (as bin, little-endian f64)
  template <class F> static void fields(F& f, auto& m) {
    f("instance", m.instance); f("table", m.table); f("columns", m.columns); f("values", m.values);
  }
};

/// telesplat ctl -> master, and its answer.
struct Control {
  static constexpr std::string_view kName = "control";
  std::string command;  ///< "status", "stop", "epoch", "set" (arguments: parameter -> value), "animate" (argument "timeline": as
                        ///< julia::parse_timeline takes it, or "off"), "tf" (argument "transfer": a preset's name or points, as
                        ///< volume::parse_transfer takes them)
  std::map<std::string, std::string> arguments;
  template <class F> static void fields(F& f, auto& m) { f("command", m.command); f("arguments", m.arguments, kMaxFact); }
};
struct ControlReply {
  static constexpr std::string_view kName = "control_reply";
  bool ok = false;
  std::string text;  ///< JSON for "status", else one line; at most kMaxControlBytes
  template <class F> static void fields(F& f, auto& m) { f("ok", m.ok); f("text", m.text, kMaxControlBytes); }
};

/// Master -> everyone: finish, flush metrics, say goodbye, exit 0. A process that leaves by itself sends Goodbye too.
struct Shutdown {
  static constexpr std::string_view kName = "shutdown";
  std::string reason;
  template <class F> static void fields(F& f, auto& m) { f("reason", m.reason); }
};
struct Goodbye {
  static constexpr std::string_view kName = "goodbye";
  InstanceId instance;
  template <class F> static void fields(F& f, auto& m) { f("instance", m.instance); }
};

// ---- blocks: sampler (DEALER) <-> data (ROUTER) ---------------------------------------------------------------------------

struct ChunkListRequest {
  static constexpr std::string_view kName = "chunk_list_request";
  EpochId epoch;
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); }
};
struct ChunkList {
  static constexpr std::string_view kName = "chunk_list";
  EpochId epoch;
  std::vector<geometry::ChunkInfo> chunks;  ///< at most kMaxChunks
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); f("chunks", m.chunks); }
};
struct ChunkRequest {
  static constexpr std::string_view kName = "chunk_request";
  EpochId epoch;
  ChunkId chunk;
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); f("chunk", m.chunk); }
};
struct Chunk {
  static constexpr std::string_view kName = "chunk";
  EpochId epoch;
  ChunkId chunk;
  Bytes data;  ///< layout: geometry/mesh_chunk.h; empty if the server has no such chunk
  template <class F> static void fields(F& f, auto& m) { f("epoch", m.epoch); f("chunk", m.chunk); f("data", m.data, kMaxBulkBytes); }
};

// ---- depth images: sampler (PUSH) -> packer (PULL) -------------------------------------------------------------------------

struct DepthTile {
  static constexpr std::string_view kName = "depth_tile";
  InstanceId sampler;
  Lease lease;  ///< as leased
  double sample_begin_s = 0, sample_end_s = 0, encode_end_s = 0;
  Bytes image;  ///< codec stream of lease.rect's size
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("lease", m.lease); f("sample_begin_s", m.sample_begin_s); f("sample_end_s", m.sample_end_s);
    f("encode_end_s", m.encode_end_s); f("image", m.image, kMaxBulkBytes);
  }
};

// ---- point-model events: packer (PUB) -> viewers (SUB), and in answer to state_request (ROUTER -> DEALER) --------------------

struct Patch {
  static constexpr std::string_view kName = "patch";
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  FrameId frame;
  InstanceId viewer;
  RequestId request;
  uint64_t tile = 0, tiles_in_frame = 0;  ///< of what is published of a frame at once: the leases' blocks
  uint64_t step = 1;                      ///< Lease::step
  bool frame_complete = false;  ///< the last tile of its frame to be packed
  uint64_t samples = 0, kept = 0;
  geometry::Camera camera;  ///< of the whole frame
  geometry::Rect rect;      ///< the tile in it
  Bytes image;              ///< codec stream; eliminated pixels are not covered
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("frame", m.frame); f("viewer", m.viewer);
    f("request", m.request); f("tile", m.tile); f("tiles_in_frame", m.tiles_in_frame); f("step", m.step);
    f("frame_complete", m.frame_complete);
    f("samples", m.samples); f("kept", m.kept); f("camera", m.camera); f("rect", m.rect); f("image", m.image, kMaxBulkBytes);
  }
};
struct Forget {
  static constexpr std::string_view kName = "forget";
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  std::vector<uint32_t> clusters;  ///< keys (as bin, little-endian u32), at most kMaxKeys
  std::vector<uint32_t> frames;    ///< empty: whole clusters; else one a cluster: only its mosaics with this frame tag
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("clusters", m.clusters);
    f("frames", m.frames);
  }
};
struct EpochBegin {
  static constexpr std::string_view kName = "epoch_begin";
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  template <class F> static void fields(F& f, auto& m) { f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); }
};
/// Twice a second on PUB: lets a viewer notice that it missed the last events. Also ends a state answer.
struct StateMark {
  static constexpr std::string_view kName = "state_mark";
  InstanceId packer;
  Sequence sequence;  ///< of the newest event
  EpochId epoch;
  bool answer = false;  ///< true: everything a state_request asked for has been sent
  uint64_t points = 0;  ///< points of the model after that event
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("answer", m.answer); f("points", m.points);
  }
};

// ---- state: viewer (DEALER) <-> packer (ROUTER) -----------------------------------------------------------------------------

/// Bring me up to date. after = newest sequence applied, of that packer instance; 0: everything.
struct StateRequest {
  static constexpr std::string_view kName = "state_request";
  InstanceId viewer;
  InstanceId packer;
  Sequence after;
  template <class F> static void fields(F& f, auto& m) { f("viewer", m.viewer); f("packer", m.packer); f("after", m.after); }
};
/// Clusters drawn since the last report.
struct AccessReport {
  static constexpr std::string_view kName = "access_report";
  InstanceId viewer;
  std::vector<uint32_t> clusters;
  std::vector<uint32_t> frames;  ///< empty: not told; else one a cluster: the frame tag of mosaics that were drawn of it
  template <class F> static void fields(F& f, auto& m) { f("viewer", m.viewer); f("clusters", m.clusters); f("frames", m.frames); }
};

// ---- volumes (T4.5, T5.3, T7.4) ---------------------------------------------------------------------------------------------

/// Data server -> master: how many voxels of each of its slices are not transparent in this epoch. What slabs are cut by.
struct SliceWeights {
  static constexpr std::string_view kName = "slice_weights";
  InstanceId data;
  EpochId epoch;
  uint64_t begin = 0;             ///< the first slice
  std::vector<uint32_t> voxels;   ///< of slices begin, begin + 1, ... (as bin, little-endian u32)
  double bytes_per_voxel = 0;     ///< estimated
  template <class F> static void fields(F& f, auto& m) {
    f("data", m.data); f("epoch", m.epoch); f("begin", m.begin); f("voxels", m.voxels); f("bytes_per_voxel", m.bytes_per_voxel);
  }
};

/// One transfer of the assignment sheet (T5.3): in `round` this sampler fetches slices [begin, end) from this data server.
struct SheetEntry {
  uint64_t round = 0;
  std::string endpoint;
  uint64_t begin = 0, end = 0;
  bool operator==(const SheetEntry&) const = default;
  template <class F> static void fields(F& f, auto& m) {
    f("round", m.round); f("endpoint", m.endpoint); f("begin", m.begin); f("end", m.end);
  }
};

/// Master -> sampler: of this partition of the volume you hold the slab [begin, end); fetch what you lack of it, in the sheet's order.
/// The sheet covers one slice more on both sides. An older partition may still be leased until the new one is ready.
struct SlabAssignment {
  static constexpr std::string_view kName = "slab_assignment";
  uint64_t partition = 0;           ///< numbered from 1
  uint64_t slab = 0, slabs = 1;     ///< begin == end: this sampler is spare
  uint64_t begin = 0, end = 0;
  std::vector<SheetEntry> sheet;    ///< at most kMaxSlabs
  template <class F> static void fields(F& f, auto& m) {
    f("partition", m.partition); f("slab", m.slab); f("slabs", m.slabs); f("begin", m.begin); f("end", m.end); f("sheet", m.sheet);
  }
};

/// Sampler -> master: it holds its slab of this partition, in the session's newest epoch that it knows of.
struct SlabReady {
  static constexpr std::string_view kName = "slab_ready";
  InstanceId sampler;
  uint64_t partition = 0;
  EpochId epoch;
  uint64_t voxels = 0, bytes = 0;   ///< held; received for it
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("partition", m.partition); f("epoch", m.epoch); f("voxels", m.voxels); f("bytes", m.bytes);
  }
};

/// A viewer that a sampling frame is for.
struct SliceView {
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;   ///< as requested
  uint64_t buffers = 0;      ///< ViewRequest::buffers
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("request", m.request); f("camera", m.camera); f("buffers", m.buffers);
  }
};

/// Master -> sampler, in answer to a lease_request: splat your slab into slice images of this frame.
struct SliceLease {
  static constexpr std::string_view kName = "slice_lease";
  LeaseId lease;
  FrameId frame;
  EpochId epoch;
  uint64_t partition = 0;
  uint64_t slab = 0, slabs = 1;   ///< the frame is complete with one delivery of each
  uint64_t begin = 0, end = 0;    ///< the slab's slices
  volume::ShearFrame shear;       ///< validated against the session's grid by whoever uses it
  std::vector<SliceView> views;   ///< at least one, at most kMaxViews
  double leased_s = 0;
  template <class F> static void fields(F& f, auto& m) {
    f("lease", m.lease); f("frame", m.frame); f("epoch", m.epoch); f("partition", m.partition); f("slab", m.slab);
    f("slabs", m.slabs); f("begin", m.begin); f("end", m.end); f("shear", m.shear); f("views", m.views); f("leased_s", m.leased_s);
  }
};

/// Sampler -> data (DEALER -> ROUTER): voxels of these slices, please, that the epoch's transfer function shows and whose level is not in `have`.
struct VoxelRequest {
  static constexpr std::string_view kName = "voxel_request";
  EpochId epoch;
  uint64_t step = 0;              ///< of a time-varying volume
  uint64_t begin = 0, end = 0;    ///< slices
  uint64_t round = 0;             ///< of the sheet: requests of earlier rounds are served first
  Bytes have;                     ///< volume::LevelSet; empty: none
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("step", m.step); f("begin", m.begin); f("end", m.end); f("round", m.round);
    f("have", m.have, size_t{volume::kMaxLevels / 8});
  }
};
/// Its answer. A server that does not know the epoch (yet), has none of the slices or too much to do, says so with `known` false: ask again
/// after a while. It may have fewer slices than were asked for - those from begin to end, at most 64 or about 32 MB -: ask for the rest.
struct VoxelData {
  static constexpr std::string_view kName = "voxel_data";
  EpochId epoch;
  uint64_t step = 0;
  uint64_t begin = 0, end = 0;
  bool known = false;
  uint64_t voxels = 0;
  Bytes have;                     ///< as requested
  Bytes shown;                    ///< volume::LevelSet: the levels of which the sampler has all voxels of these slices now
  Bytes data;                     ///< volume::encode_voxels
  template <class F> static void fields(F& f, auto& m) {
    f("epoch", m.epoch); f("step", m.step); f("begin", m.begin); f("end", m.end); f("known", m.known); f("voxels", m.voxels);
    f("have", m.have, size_t{volume::kMaxLevels / 8}); f("shown", m.shown, size_t{volume::kMaxLevels / 8});
    f("data", m.data, kMaxBulkBytes);
  }
};

/// Sampler (PUSH) -> packer (PULL), beside depth tiles: the slice images of one slab.
struct SliceImages {
  static constexpr std::string_view kName = "slice_images";
  InstanceId sampler;
  SliceLease lease;               ///< as leased
  uint64_t voxels = 0;            ///< splatted
  double sample_begin_s = 0, sample_end_s = 0, encode_end_s = 0;
  Bytes data;                     ///< volume/slice_image.h, one after the other
  template <class F> static void fields(F& f, auto& m) {
    f("sampler", m.sampler); f("lease", m.lease); f("voxels", m.voxels); f("sample_begin_s", m.sample_begin_s);
    f("sample_end_s", m.sample_end_s); f("encode_end_s", m.encode_end_s); f("data", m.data, kMaxBulkBytes);
  }
};

/// Packer (state ROUTER) -> viewer (DEALER): a complete frame, cropped to what this viewer may see of it. In order of frames; never more
/// of them unacknowledged than the viewer has buffers.
struct SliceFrame {
  static constexpr std::string_view kName = "slice_frame";
  InstanceId packer;
  EpochId epoch;
  FrameId frame;
  InstanceId viewer;
  RequestId request;
  geometry::Camera camera;        ///< as requested
  volume::ShearFrame shear;
  uint64_t slabs = 1, voxels = 0; ///< that it was made from
  double leased_s = 0, packed_s = 0;  ///< first lease; when it was complete
  Bytes data;                     ///< volume/slice_image.h
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("epoch", m.epoch); f("frame", m.frame); f("viewer", m.viewer); f("request", m.request);
    f("camera", m.camera); f("shear", m.shear); f("slabs", m.slabs); f("voxels", m.voxels); f("leased_s", m.leased_s);
    f("packed_s", m.packed_s); f("data", m.data, kMaxBulkBytes);
  }
};
/// Viewer -> packer: this frame has left its buffer (it is decoded and replaced an older one, or was displayed and let go). Frame 0: here I am.
struct SliceAck {
  static constexpr std::string_view kName = "slice_ack";
  InstanceId viewer;
  FrameId frame;
  uint64_t buffers = 1;           ///< it has, 1 to kMaxBuffers
  bool in_order = false;          ///< false: of frames that wait for it only the newest is worth sending
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("frame", m.frame); f("buffers", m.buffers); f("in_order", m.in_order);
  }
};

// clang-format on

}  // namespace telesplat::wire
