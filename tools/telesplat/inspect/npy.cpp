#include "tools/telesplat/inspect/npy.h"

#include <fmt/format.h>

#include <bit>
#include <cstdio>
#include <fstream>

#include "common/core/check.h"

namespace telesplat::launcher {

Status write_npy(const std::string& path, std::span<const float> values, int rows, int columns) {
  static_assert(std::endian::native == std::endian::little, "floats are written as they lie in memory");
  CHECK(values.size() == size_t(rows) * size_t(columns));
  constexpr size_t kAlign = 64, kPrefix = 10;  // magic, version, length of what follows
  std::string header = fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", rows, columns);
  header.append(kAlign - 1 - (kPrefix + header.size()) % kAlign, ' ');
  header += '\n';
  const std::string prefix{'\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0, char(header.size() & 255), char(header.size() >> 8)};

  const std::string part = path + ".part";
  {
    std::ofstream out(part, std::ios::binary);
    out << prefix << header;
    out.write(reinterpret_cast<const char*>(values.data()), std::streamsize(values.size_bytes()));
    out.close();
    if (!out) {
      std::remove(part.c_str());
      return Error{fmt::format("cannot write {}", path)};
    }
  }
  if (std::rename(part.c_str(), path.c_str()) != 0) {
    std::remove(part.c_str());
    return Error{fmt::format("cannot write {}: renaming {} failed", path, part)};
  }
  return ok_status();
}

}  // namespace telesplat::launcher
