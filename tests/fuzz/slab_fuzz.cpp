// Gives a sampler's store any bytes as a data server's answer: the store refuses them, or holds what the header says.
// The first bytes choose the header: lit voxels or not, begin and end of the slices, a second answer for other levels.
#include <cstdlib>

#include "services/sampler/volume/slab_store.h"

namespace {

using namespace telesplat;
using volume::LevelSet;

constexpr int kSizeX = 24, kSizeY = 8, kSizeZ = 12, kLevels = 256;

struct PlainSlab final : sampler::Slab {
  size_t bytes() const override { return 1; }
  std::vector<volume::SliceImage> splat(const std::vector<volume::LevelColour>&, const volume::ShearFrame&, int, int,
                                        const geometry::Clip&, uint64_t&) const override {
    return {};
  }
};

// Checks that the voxels survive encoding and decoding, so that their rows are consistent.
std::shared_ptr<const sampler::Slab> arranged(const volume::Grid&, volume::Voxels voxels) {
  const auto bytes = volume::encode_voxels(voxels, kSizeX, kSizeY);
  const auto again = volume::decode_voxels(bytes, kSizeX, kSizeY, voxels.k_begin, voxels.k_end, kLevels);
  if (!again.ok() || !(*again == voxels)) std::abort();
  return std::make_shared<const PlainSlab>();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 4) return 0;
  const bool lit = data[0] & 1;
  sampler::SlabStore store(arranged, 1 << 20);
  store.set_scene({{{kSizeX, kSizeY, kSizeZ}, glm::dmat4(1)}, {0, 1, kLevels}, lit, 1, ""});
  if (!store.assign({1, 0, 1, 0, kSizeZ, {{0, "tcp://server:1", 0, kSizeZ}}})) std::abort();
  size_t at = 4;
  for (int level = 0; level < 2; ++level) {
    LevelSet shown;
    for (int l = 0; l < kLevels / 2; ++l) shown.add(level * kLevels / 2 + l);
    const auto ask = store.next({0, 0, kSizeZ, {1}, &shown});
    if (!ask) return 0;
    const size_t end = level == 0 ? std::min(size, at + 16 * size_t{data[3]}) : size;
    wire::VoxelData answer{.epoch = {1}, .begin = data[1], .end = data[2], .known = true};
    if (!ask->have.empty()) answer.have = std::as_bytes(ask->have.bytes());
    answer.shown = std::as_bytes(shown.bytes());
    answer.data = std::as_bytes(std::span(data + at, end - at));
    at = end;
    const uint64_t before = store.voxels();
    const auto taken = store.take(*ask, answer, shown);
    if (!taken.ok() || !*taken) {
      if (store.voxels() != before) std::abort();
      continue;
    }
    if (answer.begin == 0 && answer.end == kSizeZ && !store.slab({0, 0, kSizeZ, {1}, &shown})) std::abort();
  }
  return 0;
}
