#include "tools/telesplat/inspect/npy.h"

#include <fmt/format.h>

#include <bit>

#include "common/core/check.h"
#include "common/core/whole_file.h"

namespace telesplat::launcher {

Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns) {
  static_assert(std::endian::native == std::endian::little, "floats are written as they lie in memory");
  CHECK(values.size() == size_t(rows) * size_t(columns));
  constexpr size_t kAlign = 64, kPrefix = 10;  // magic, version, length of what follows
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", rows, columns);
  header.append(kAlign - 1 - (kPrefix + header.size()) % kAlign, ' ');
  header += '\n';
  const std::string prefix{'\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0, char(header.size() & 255), char(header.size() >> 8)};

  std::string all = prefix + header;
  all.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  return write_whole(path, all);
}

}  // namespace telesplat::launcher
