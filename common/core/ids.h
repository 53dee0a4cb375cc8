// Strong identifiers: a frame number cannot be passed where a sequence number is meant.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace telesplat {

template <class Tag>
struct Id {
  uint64_t value = 0;
  auto operator<=>(const Id&) const = default;
  Id next() const { return {value + 1}; }
};

using FrameId = Id<struct FrameTag>;        ///< a sampling frame, numbered by the master from 1
using Sequence = Id<struct SequenceTag>;    ///< a point-model event, numbered by the packer from 1
using EpochId = Id<struct EpochTag>;        ///< a version of the data set
using RequestId = Id<struct RequestTag>;    ///< a view request, numbered by its viewer from 1
using LeaseId = Id<struct LeaseTag>;        ///< one handing-out of a tile to a sampler
using InstanceId = Id<struct InstanceTag>;  ///< one life of a process: drawn at random when it starts
using ChunkId = Id<struct ChunkTag>;        ///< a spatial part of a mesh, numbered from 0

}  // namespace telesplat

template <class Tag>
struct std::hash<telesplat::Id<Tag>> {
  size_t operator()(const telesplat::Id<Tag>& id) const { return std::hash<uint64_t>{}(id.value); }
};
