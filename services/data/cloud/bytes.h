// Inside services/data/cloud: numbers in the bytes of files.
#pragma once

#include <cstring>
#include <string_view>

namespace telesplat::data {

/// Reads a number in Intel's byte order, which this machine has. Precondition: it lies in the bytes.
template <class T>
T number(std::string_view bytes, size_t at) {
  T out;
  std::memcpy(&out, bytes.data() + at, sizeof out);
  return out;
}

}  // namespace telesplat::data
