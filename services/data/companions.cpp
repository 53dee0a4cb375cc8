#include "services/data/companions.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "services/data/base/mapped_file.h"
#include "services/data/kinds.h"
#include "services/data/mesh/reader.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/volume.h"

namespace telesplat::data {
namespace {

namespace fs = std::filesystem;

bool is_below(const fs::path& folder, const fs::path& file) {
  return std::mismatch(folder.begin(), folder.end(), file.begin(), file.end()).first == folder.end();
}

Status check_named(const std::string& path, const std::string& named) {
  std::error_code error;
  const fs::path file = fs::canonical(named, error);
  if (error) return ok_status();  // it is missing
  const fs::path parent = fs::path(path).parent_path();
  const fs::path folder = fs::canonical(parent.empty() ? fs::path(".") : parent, error);
  if (!error && is_below(folder, file)) return ok_status();
  return Error{
      fmt::format("{}: names {}, which lies outside of its folder; --companions anywhere allows that", path, named)};
}

// The file's own voxels lie in itself, or in the file that its header names.
Status check_volume(const DataOptions& o) {
  const auto source = find_volume(o.scene, o.volume);
  if (!source) return ok_status();
  if (source->dicom) return ok_status();  // slices name nothing
  for (const std::string& step : source->steps) {
    const auto header = read_volume_header(step, o.volume.raw);
    if (!header) continue;
    std::vector<std::string> named = header->more_paths;
    if (!header->data_path.empty() && header->data_path != step) named.push_back(header->data_path);
    for (const std::string& file : named)
      if (const Status s = check_named(step, file); !s) return s;
  }
  return ok_status();
}

Status check_mesh(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return ok_status();
  const std::string_view content = (*file)->text();
  for (const std::string& named : companion_files(content, detect_format(content, path).format, path))
    if (const Status s = check_named(path, named); !s) return s;
  return ok_status();
}

}  // namespace

Status check_companions(const DataOptions& o) {
  if (o.companions == "anywhere") return ok_status();
  const auto kind = kind_of(o);
  if (!kind || *kind == scene::Kind::kJulia) return ok_status();
  return *kind == scene::Kind::kVolume || o.mesh.iso ? check_volume(o) : check_mesh(o.scene);
}

}  // namespace telesplat::data
