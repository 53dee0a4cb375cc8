#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "tools/lab/make_volume/tree.h"

namespace telesplat::made_volume {

Status write_scan(const Scan& scan, int bits, const std::string& path) {
  const auto ends = [&](const char* with) { return path.ends_with(with); };
  if (!ends(".nrrd") && !ends(".mha") && !ends(".raw"))
    return Error{fmt::format("{}: its name ends neither in .nrrd nor in .mha nor in .raw", path)};
  if (bits != 8 && bits != 16) return Error{fmt::format("{} bits a voxel: neither 8 nor 16", bits)};
  const int n = scan.side;
  std::string header;
  if (ends(".nrrd"))
    header = fmt::format(
        "NRRD0004\n# made by make-volume\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
        "space directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
        "space origin: (0,0,0)\n\n",
        bits == 8 ? "uint8" : "uint16", n, n, n);
  if (ends(".mha"))
    header = fmt::format(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = 1 1 1\nDimSize = {} {} {}\n"
        "ElementType = {}\nElementDataFile = LOCAL\n",
        n, n, n, bits == 8 ? "MET_UCHAR" : "MET_USHORT");
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "wb"), std::fclose);
  const auto failed = [&] { return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))}; };
  if (!file) return failed();
  if (std::fwrite(header.data(), 1, header.size(), file.get()) != header.size()) return failed();
  const size_t slice = size_t(n) * size_t(n);
  std::vector<uint8_t> bytes;
  for (size_t z = 0; z < size_t(n); ++z) {
    const uint16_t* from = scan.values.data() + z * slice;
    if (bits == 16) {
      if (std::fwrite(from, 2, slice, file.get()) != slice) return failed();
      continue;
    }
    bytes.resize(slice);
    for (size_t i = 0; i < slice; ++i) bytes[i] = uint8_t(from[i] >> 8);
    if (std::fwrite(bytes.data(), 1, slice, file.get()) != slice) return failed();
  }
  if (std::fflush(file.get()) != 0) return failed();
  return ok_status();
}

}  // namespace telesplat::made_volume
