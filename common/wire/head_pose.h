// A head's pose as any program may send it: not a message of this protocol, but a plain msgpack map without a version
// (docs/tracking.md).
#pragma once

#include <optional>
#include <string>

#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

struct HeadPose {
  std::optional<double> t_s;  ///< sender's clock, seconds; empty: the time of arrival counts
  geometry::Pose pose;
};

inline constexpr size_t kMaxHeadPoseBytes = 4096;
inline constexpr double kFarthestHead_m = 1e4;  ///< from the room's centre, along each axis

/// {"t": seconds, "p": [x, y, z], "q": [w, x, y, z]}
std::string encode_head_pose(const HeadPose& pose);
/// Refuses, naming field, value and limit: bodies over kMaxHeadPoseBytes, bytes that are not one msgpack map, fields
/// that are missing ("t" may be) or of another type, numbers that are not finite, positions beyond kFarthestHead_m,
/// quaternions whose length differs from 1 by more than 5 %. Ignores other fields. Normalises the quaternion.
Result<HeadPose> decode_head_pose(Bytes body);

}  // namespace telesplat::wire
