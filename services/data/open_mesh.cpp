#include "services/data/open_mesh.h"

#include "services/data/mesh/file_source.h"
#include "services/data/surface/isosurface.h"

namespace telesplat::data {

Result<std::shared_ptr<MeshStore>> open_mesh(const std::string& path, const MeshOptions& options,
                                             const Progress& user_progress) {
  const Progress progress = user_progress ? user_progress : [](const char*, double) {};
  if (const Status s = validate(options); !s) return s.error();
  const auto source = options.iso ? surface_source(path, options.raw, *options.iso, progress)
                                  : file_source(path, options.elevation, progress);
  if (!source) return source.error();
  return MeshStore::make(path, *source, options, progress);
}

}  // namespace telesplat::data
