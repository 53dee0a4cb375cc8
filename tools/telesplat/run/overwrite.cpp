#include "tools/telesplat/run/overwrite.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/metrics/run_folder.h"
#include "common/net/session_file.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

// Whether `file` is this path, or lies in the folder of this path.
bool is_or_holds(const fs::path& path, const fs::path& file) {
  return std::mismatch(path.begin(), path.end(), file.begin(), file.end()).first == path.end();
}

}  // namespace

Status check_overwrite(const RunOptions& o) {
  if (const Status s = net::refuse_folder_in_use(o.out); !s) return s;
  const auto record = metrics::recorded_files(o.out);
  std::error_code error;
  const fs::path folder = fs::canonical(o.out, error);
  for (const std::string& input : {o.data.scene, o.viewer.trajectory, o.data.mesh.elevation.texture,
                                   o.data.volume.transfer, o.data.mesh.colouring.map}) {
    const fs::path path = input.empty() ? fs::path() : fs::canonical(input, error);
    if (path.empty() || is_or_holds(path, folder)) continue;
    if (std::any_of(record.begin(), record.end(), [&](const auto& f) { return is_or_holds(path, folder / f); }))
      return Error{
          fmt::format("{}: is part of the record that --overwrite would remove; copy it elsewhere first, or "
                      "give another --out",
                      input)};
  }
  return ok_status();
}

}  // namespace telesplat::launcher
