// Numbers that the Julia kernels and their oracle share. Those marked (tuned) were set with JuliaFrame of
// telesplat-bench and julia_reference_test: fewest estimates a ray at which no surface is missed.
#pragma once

#include <cstdint>

namespace telesplat::sampler {

inline constexpr float kNothing = 3e38f;  ///< depth of rays that meet nothing

// log
inline constexpr uint32_t kSqrtHalfBits = 0x3f3504f3;
inline constexpr float kLog2 = 0.693147181f, kArtanh3 = 1.0f / 3, kArtanh5 = 1.0f / 5, kArtanh7 = 1.0f / 7;

inline constexpr float kParallel = 1e-20f;  ///< directions below it are parallel to a face of the box
inline constexpr float kTiny = 1e-37f;      ///< divisors are at least this

// Cones
inline constexpr int kMaxConeSteps = 64;
inline constexpr float kConeMargin = 2;  ///< thresholds that a cone keeps off the surface, beyond its radius
/// A cone stops where it could go on by less than this part of its radius (tuned).
inline constexpr float kConeStop = 0.5f;

// Marching
inline constexpr int kMaxSteps = 1024;
inline constexpr float kRelax = 1.8f;     ///< 2: free balls just touch if the estimate goes on changing evenly (tuned)
inline constexpr float kMaxSlope = 0.5f;  ///< slope of the estimate along a ray, for the length of steps (tuned)
/// Where the estimate is below this many thresholds, steps are kNearRatio of it at most (tuned).
inline constexpr float kNear = 3;
inline constexpr float kNearRatio = 0.8f;
inline constexpr float kSlack = 1.01f;  ///< keeps rounding from making a safe step count as too long
inline constexpr float kTrust = 1.0f;   ///< radii of a new point's free ball that may be relied on
inline constexpr int kRefinements = 2;
inline constexpr int kMarchWays = 2;  ///< vectors of rays that are marched side by side (tuned)
inline constexpr int kRefill = 2;     ///< lanes that are given new rays at once (tuned)

inline constexpr float kLeast = 0.02f;  ///< cosine to which normals that face away are turned

// Steep normals: the mean of two, the second half a pixel further in (julia/plain.h, widen)
inline constexpr float kSteep = 0.95f;    ///< cosine between normal and ray below which a normal is steep
inline constexpr float kInward = 0.5f;    ///< pixels
inline constexpr float kInwardSlope = 4;  ///< slope of the surface against the screen, used to find the second point
inline constexpr float kLeastLean = 0.1f;
inline constexpr int kInwardSteps = 4;
inline constexpr float kInwardOff = 0.5f;  ///< pixels off the surface at which a second point still counts

// Occlusion: estimates along the normal, in radii of the set's ball; open country has estimates of kOpen times the
// distance from the surface.
inline constexpr int kOcclusionSteps = 4;
inline constexpr float kOcclusionAt[kOcclusionSteps] = {0.03f, 0.08f, 0.18f, 0.36f};
inline constexpr float kOcclusionWeight[kOcclusionSteps] = {0.3f, 0.3f, 0.25f, 0.15f};
inline constexpr float kOpen = 0.5f;

// Soft shadow
inline constexpr int kShadowSteps = 32;
inline constexpr float kShadowBegin = 0.01f, kShadowEnd = 2.0f, kShadowLeast = 0.015f;  ///< in radii
inline constexpr float kShadowSharpness = 8;  ///< the rim is lit where the estimate is more than 1/8 of the way

}  // namespace telesplat::sampler
