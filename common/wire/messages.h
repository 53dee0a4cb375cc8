// Every message between Telesplat processes: one struct each, with units, shapes and limits. docs/protocol.md has the
// tables.
//
// On the wire a message is two ZeroMQ frames: its kName, then one msgpack map of its fields() plus "v", the protocol
// version. Times are seconds of the master's clock. Bulk fields (Bytes) are spans: when decoded they point into the
// received frame, which must outlive them.
#pragma once

#include <tuple>

#include "common/wire/link_messages.h"
#include "common/wire/point_messages.h"
#include "common/wire/session_messages.h"
#include "common/wire/slice_messages.h"
#include "common/wire/tile_messages.h"
#include "common/wire/wall_messages.h"

namespace telesplat::wire {

/// List of all messages. A message that is not in it cannot be encoded or decoded: the compiler says so. Tests and the
/// fuzz target go through it too.
using Messages = std::tuple<Hello, Welcome, WhoAreYou, ClockRequest, ClockReply, ViewRequest, LeaseRequest, Lease,
                            LeaseExtend, TileDone, TileRefused, PlanRequest, Plan, FrameEnd, StatusReport, MetricRows,
                            Control, ControlReply, Shutdown, Goodbye, ChunkListRequest, ChunkList, ChunkRequest, Chunk,
                            DepthTile, Patch, Forget, Refine, EpochBegin, StateMark, StateRequest, StateBegin,
                            AccessReport, SliceWeights, SlabAssignment, SlabReady, SliceLease, VoxelRequest, VoxelData,
                            SliceImages, SliceFrame, SliceAck, Receipt, LinkReport, SwapReady, Swap, Order, OrderAnswer,
                            PictureTile, Picture, BaseRequest, BaseBegin, BasePart, BaseHidden, BaseTree>;

}  // namespace telesplat::wire
