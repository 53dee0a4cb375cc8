// How far reading and preparing a data set has come.
#pragma once

#include <functional>

namespace telesplat::data {

/// Fraction of a file read, 0..1; called now and then on the reading thread.
using ReadProgress = std::function<void(double fraction)>;

/// The same of several stages. stage: "hash", "read", "normals", "chunk", "write", "classify", "looking for the set".
using Progress = std::function<void(const char* stage, double fraction)>;

}  // namespace telesplat::data
