// Volumes of the formats that VTK reads, in the program telesplat-import.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "services/data/import/process.h"
#include "services/data/import/report.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {

Result<StreamedVolume> read_volume_with_vtk(const VolumeFileHeader& header, const std::string& path,
                                            const ReadProgress& progress) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Error{fmt::format("{}: no pipe for reading it: {}", path, std::strerror(errno))};
  fcntl(ends[1], F_SETPIPE_SZ, 1 << 20);  // fewer turns between the two processes; smaller ones do as well
  const auto child = start_import({header.format, path}, {path}, ends[1]);
  close(ends[1]);
  if (!child) {
    close(ends[0]);
    return child.error();
  }
  // VTK's own format alone tells its type only to VTK.
  const uint64_t most = header.format == "vti" ? 8 * header.voxels() : header.voxel_bytes();
  auto received = receive_volume(ends[0], most, path, progress);
  close(ends[0]);  // if it still writes, that ends it
  const auto ended = end_import(*child, "VTK's " + header.format, header.format, path);
  if (received) return std::move(*received);  // what it said itself is better than how it ended
  if (!ended) return ended.error();
  return Error{fmt::format("{}: what {} gave of it is incomplete", path, kImportProgram)};
}

}  // namespace telesplat::data
