#include "services/data/base/mesh_source.h"

#include <xxhash.h>

#include <algorithm>

#include "services/data/base/mapped_file.h"

namespace telesplat::data {

uint64_t hash_files(const std::vector<std::string>& paths, const Progress& progress) {
  constexpr size_t kStep = 64 << 20;
  XXH3_state_t* state = XXH3_createState();
  XXH3_64bits_reset(state);
  for (size_t n = 0; n < paths.size(); ++n) {
    const auto file = MappedFile::open(paths[n]);
    if (!file) continue;
    const auto bytes = (*file)->bytes();
    for (size_t at = 0; at < bytes.size(); at += kStep) {
      const double of_file = static_cast<double>(at) / static_cast<double>(bytes.size());
      progress(kIdentifying, (static_cast<double>(n) + of_file) / static_cast<double>(paths.size()));
      XXH3_64bits_update(state, bytes.data() + at, std::min(kStep, bytes.size() - at));
    }
  }
  const uint64_t hash = XXH3_64bits_digest(state);
  XXH3_freeState(state);
  progress(kIdentifying, 1.0);
  return hash;
}

}  // namespace telesplat::data
