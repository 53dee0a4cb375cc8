// Cameras in half the bytes: numbers of a lattice, and nothing that follows from others (docs/protocol.md).
// The images that viewers get are small, and each says its camera.
#pragma once

#include <optional>
#include <string>

#include "common/geometry/camera.h"
#include "common/wire/limits.h"

namespace telesplat::wire {

/// Positions (metres) and tangents are multiples of 2^-19, three components of the orientation of 2^-20.
inline constexpr int kPlaceBits = 19, kTurnBits = 20;

/// The camera beside `camera` that has a short form: less than two micrometres and three millionths of a radian away.
/// One that has a short form, or beside which there is none that geometry::validate takes, stays as it is.
geometry::Camera shortened(const geometry::Camera& camera);

/// Bytes that read as exactly this camera; nothing if it has no short form.
std::optional<std::string> short_form(const geometry::Camera& camera);

/// Reads what short_form() made. Error, with value and limit: bytes that are too few or too many, numbers out of range,
/// a camera that geometry::validate refuses.
Result<geometry::Camera> read_short_form(Bytes bytes);

}  // namespace telesplat::wire
