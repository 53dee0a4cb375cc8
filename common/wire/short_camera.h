// Cameras in half the bytes: numbers of a lattice, without those that follow from others (docs/protocol.md).
// The images that viewers get are small, and each states its camera.
#pragma once

#include <optional>
#include <string>

#include "common/geometry/camera.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

/// Positions (metres) and tangents are multiples of 2^-19, three components of the orientation of 2^-20.
inline constexpr int kPlaceBits = 19, kTurnBits = 20;

/// Returns the nearest camera that has a short form: less than two micrometres and three millionths of a radian away.
/// Keeps a camera that has a short form already, or if geometry::validate refuses the nearest one.
geometry::Camera shortened(const geometry::Camera& camera);

/// Bytes that read as exactly this camera; nothing if the camera has no short form.
std::optional<std::string> short_form(const geometry::Camera& camera);

/// Reads what short_form() made. Error, with value and limit: bytes that are too few or too many, numbers out of range,
/// a camera that geometry::validate refuses.
Result<geometry::Camera> read_short_form(Bytes bytes);

}  // namespace telesplat::wire
