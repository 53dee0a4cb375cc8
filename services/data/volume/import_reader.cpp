// Volumes that come from the program telesplat-import.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "services/data/import/process.h"
#include "services/data/import/report.h"
#include "services/data/volume/formats/import_stream.h"

namespace telesplat::data {

Result<StreamedVolume> import_volume(std::vector<std::string> words, const std::vector<std::string>& files,
                                     uint64_t most_bytes, const std::string& reader, const ReadProgress& progress) {
  const std::string format = words[0], path = words[1];
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    return Error{fmt::format("{}: no pipe for reading it: {}", path, std::strerror(errno))};
  fcntl(ends[1], F_SETPIPE_SZ, 1 << 20);  // fewer turns between the two processes; smaller ones do as well
  const auto child = start_import(std::move(words), files, ends[1]);
  close(ends[1]);
  if (!child) {
    close(ends[0]);
    return child.error();
  }
  auto received = receive_volume(ends[0], most_bytes, path, progress);
  close(ends[0]);  // if it still writes, that ends it
  const auto ended = end_import(*child, reader, format, path);
  if (received) return std::move(*received);  // what it said itself is better than how it ended
  if (!ended) return ended.error();
  return Error{fmt::format("{}: what {} gave of it is incomplete", path, kImportProgram)};
}

}  // namespace telesplat::data
