// Messages between the packer and the viewers of a point model.
#pragma once

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

// ---- events of the model: packer (PUB) -> viewers (SUB), and in answer to state_request (ROUTER -> DEALER) ----------

/// Covered pixels of a tile before and after elimination.
struct SampleCounts {
  uint64_t samples = 0, kept = 0;
};

/// Rays finer than a view's that met nothing; no words: no rays.
struct MissedRays {
  std::vector<uint32_t> words;  ///< codec::encode_mask
  geometry::Rect rect{0, 0, 1, 1};  ///< where they lie
};

/// When a patch's points are removed, by their tag (points::tagged).
struct Lifetime {
  uint64_t rest = 0;    ///< not 0: when the head has moved on from this rest
  bool coarse = false;  ///< DepthTile::coarse: when a later frame of the viewer is complete
};
struct Patch {
  static constexpr std::string_view kName = "patch";
  static constexpr bool kBulk = true;
  static constexpr bool kBrief = true;  ///< fields by number; those that hold their default are not sent
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  FrameId frame;
  InstanceId viewer;
  RequestId request;
  uint64_t tile = 0, tiles_in_frame = 0;  ///< blocks (Lease::block): a frame is published block by block
  uint64_t step = 1;  ///< Lease::step
  bool extra = false;  ///< Lease::extra
  bool frame_complete = false;  ///< the last tile of its frame to be packed
  uint64_t left_out = 0;  ///< tiles that are not sampled (FrameEnd): this patch ends the frame
  SampleCounts counts;
  geometry::Camera camera;  ///< camera of the whole frame
  geometry::Rect rect;  ///< the tile in it
  Bytes image;  ///< codec stream; eliminated pixels are not covered
  MissedRays missed;
  Moments moments;  ///< moments of its last tile, if it completes an update; empty when resent
  bool refinable = false;  ///< points that its image leaves out may follow: Refine
  Lifetime lifetime;
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("frame", m.frame); f("viewer", m.viewer);
    f("request", m.request); f("tile", m.tile); f("tiles_in_frame", m.tiles_in_frame); f("step", m.step);
    f("extra", m.extra); f("frame_complete", m.frame_complete); f("left_out", m.left_out); f("samples", m.counts.samples); f("kept", m.counts.kept);
    f("camera", m.camera); f("rect", m.rect); f("image", m.image, kMaxBulkBytes);
    f("missed", m.missed.words, kMaxMaskWords); f("missed_rect", m.missed.rect); f("moments", m.moments);
    f("refinable", m.refinable); f("rest", m.lifetime.rest); f("coarse", m.lifetime.coarse);
  }
};
struct Forget {
  static constexpr std::string_view kName = "forget";
  static constexpr bool kBulk = true;
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  std::vector<uint32_t> clusters;  ///< keys (as bin, little-endian u32), at most kMaxKeys
  std::vector<uint32_t> frames;  ///< empty: whole clusters; else one a cluster: only its mosaics with this frame tag
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("clusters", m.clusters);
    f("frames", m.frames);
  }
};
/// The points of an earlier patch become exact.
struct Refine {
  static constexpr std::string_view kName = "refine";
  static constexpr bool kBulk = true;
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  Sequence patch;  ///< patch that becomes exact
  Bytes image;  ///< the part that its image left out (codec::decode_refinement)
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("patch", m.patch);
    f("image", m.image, kMaxBulkBytes);
  }
};
struct EpochBegin {
  static constexpr std::string_view kName = "epoch_begin";
  InstanceId packer;
  Sequence sequence;
  EpochId epoch;
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch);
  }
};
/// Twice a second on PUB: lets a viewer notice that it missed the last events. Also ends a state answer.
struct StateMark {
  static constexpr std::string_view kName = "state_mark";
  InstanceId packer;
  Sequence sequence;  ///< sequence of the newest event
  EpochId epoch;
  bool answer = false;  ///< true: everything a state_request asked for has been sent
  uint64_t points = 0;  ///< points of the model after that event
  uint64_t digest = 0;  ///< points::PointModel::digest() of the model after that event; 0: not sent
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("sequence", m.sequence); f("epoch", m.epoch); f("answer", m.answer);
    f("points", m.points); f("digest", m.digest);
  }
};

// ---- state: viewer (DEALER) <-> packer (ROUTER) --------------------------------------------------------------------

/// Bring me up to date.
struct StateRequest {
  static constexpr std::string_view kName = "state_request";
  InstanceId viewer;
  InstanceId packer;  ///< packer that the viewer follows; 0: none yet
  Sequence after;  ///< newest event that was applied; 0: send everything
  bool anew = false;  ///< the viewer drops all answers to earlier requests over this connection
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("packer", m.packer); f("after", m.after); f("anew", m.anew);
  }
};
/// Begins an answer. It leaves out points forgotten since `after`: only a replica in that state may apply it.
struct StateBegin {
  static constexpr std::string_view kName = "state_begin";
  InstanceId packer;
  Sequence after;
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("after", m.after);
  }
};
/// Viewer -> packer: send parts of the base, if there is one.
struct BaseRequest {
  static constexpr std::string_view kName = "base_request";
  InstanceId viewer;
  uint64_t base = 0;  ///< base that the viewer has begun; 0: none yet
  uint64_t part = 0, parts = 1;  ///< the first one; their number, 0: only what is hidden
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("base", m.base); f("part", m.part); f("parts", m.parts);
  }
};
/// Packer -> viewers (PUB, now and then): the base, the coarse form of the whole data set, is this one.
struct BaseBegin {
  static constexpr std::string_view kName = "base_begin";
  InstanceId packer;
  uint64_t base = 0;   ///< counts bases: another scene or colouring has another one
  uint64_t nodes = 0;  ///< nodes of its tree; 0: there is no base
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("base", m.base); f("nodes", m.nodes);
  }
};
/// Packer -> viewer, in answer to a request for another base: its tree, the levels of the mesh's store. A node has a
/// part for each kBasePart triangles; parts are numbered from those of node 0 on.
struct BaseTree {
  static constexpr std::string_view kName = "base_tree";
  static constexpr bool kBulk = true;
  static constexpr size_t kElements = 13 * geometry::kMaxChunks;
  InstanceId packer;
  uint64_t base = 0;
  std::vector<geometry::ChunkInfo> nodes;  ///< at most kMaxChunks; kMaxBaseParts parts
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("base", m.base); f("nodes", m.nodes);
  }
};
/// Number of the first part of each node of a base, and of its end.
inline std::vector<uint64_t> first_base_parts(const std::vector<geometry::ChunkInfo>& nodes) {
  std::vector<uint64_t> out{0};
  for (const auto& node : nodes) out.push_back(out.back() + (node.triangles + kBasePart - 1) / kBasePart);
  return out;
}
/// Packer -> viewer: some triangles of the base. Triangle i of part n has the number kBasePart n + i.
struct BasePart {
  static constexpr std::string_view kName = "base_part";
  static constexpr bool kBulk = true;
  InstanceId packer;
  uint64_t base = 0, part = 0;
  Bytes mesh;  ///< a coded chunk with colours (geometry/chunk_code.h)
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("base", m.base); f("part", m.part); f("mesh", m.mesh, kMaxBulkBytes);
  }
};
/// Packer -> viewers (PUB, and in answer to a request for a tree, or for no part): triangles of the base that are
/// hidden, because rays passed them. Words that are not named stay as they were.
struct BaseHidden {
  static constexpr std::string_view kName = "base_hidden";
  static constexpr bool kBulk = true;
  InstanceId packer;
  uint64_t base = 0;
  uint64_t number = 0;  ///< counts these messages on PUB; in an answer: number of the newest one that it includes
  bool whole = false;   ///< words that are not named are 0
  /// Three numbers each: index i, then 64 bits of the triangles from 64 i on, low half first.
  std::vector<uint32_t> words;
  template <class F> static void fields(F& f, auto& m) {
    f("packer", m.packer); f("base", m.base); f("number", m.number); f("whole", m.whole); f("words", m.words);
  }
};
/// Clusters drawn since the last report.
struct AccessReport {
  static constexpr std::string_view kName = "access_report";
  static constexpr bool kBulk = true;
  InstanceId viewer;
  std::vector<uint32_t> clusters;
  std::vector<uint32_t> frames;  ///< empty: not known; else one a cluster: frame tag of the mosaics that were drawn
  template <class F> static void fields(F& f, auto& m) {
    f("viewer", m.viewer); f("clusters", m.clusters); f("frames", m.frames);
  }
};

// clang-format on

}  // namespace telesplat::wire
