// NumPy's file format for one array of floats.
#pragma once

#include <span>
#include <string>

#include "common/core/result.h"

namespace telesplat::launcher {

/// Writes `values`, rows x columns of them row by row, as little-endian float32 (numpy.load reads it). The file appears
/// whole or not at all. Errors name the path. Source: NEP 1, "A Simple File Format for NumPy Arrays", version 1.0.
Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns);

}  // namespace telesplat::launcher
