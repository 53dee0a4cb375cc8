#include "services/data/volume/store.h"

namespace telesplat::data {

Result<std::unique_ptr<VolumeStore>> VolumeStore::open(const std::string& path, const VolumeOptions& options,
                                                       const MeshOptions& mesh, const Progress& progress) {
  const auto source = find_volume(path, options.raw);
  if (!source) return source.error();
  const StepReader read = [source = *source](size_t step, const ReadProgress& told) {
    return read_volume(source, step, told);
  };
  return make(read, source->steps.size(), path, options, mesh, progress);
}

}  // namespace telesplat::data
