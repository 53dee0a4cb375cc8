// Why a pixel of a view is cast; or why not.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace telesplat::packer {

enum class RayClass : uint8_t { kNothing, kUnproven, kSparse, kEdge, kStale, kValidation, kGood, kKnownEmpty };
inline constexpr int kRayClasses = 8;

/// As in figures of plans: "nothing", "known_empty".
inline const char* name_of(RayClass c) {
  constexpr std::array<const char*, kRayClasses> kNames{"nothing", "unproven",   "sparse", "edge",
                                                        "stale",   "validation", "good",   "known_empty"};
  return kNames[static_cast<size_t>(c)];
}

}  // namespace telesplat::packer
