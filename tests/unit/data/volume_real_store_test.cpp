// Real volumes, if this machine has them: opened, classified by every preset, coded within the limit of bytes a voxel.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "services/data/volume/store.h"

namespace telesplat::data {
namespace {

std::string data_folder() {
  if (const char* folder = std::getenv("TELESPLAT_DATA")) return folder;
  const char* home = std::getenv("HOME");
  return std::string(home ? home : "") + "/.cache/telesplat-data";
}

struct RealVolume {
  std::string name;
  int levels, steps;
};

class RealVolumes : public testing::TestWithParam<RealVolume> {};

TEST_P(RealVolumes, TakeAtMostFourBytesAVisibleVoxel) {
  const std::string path = data_folder() + "/volumes/" + GetParam().name;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  const auto store = VolumeStore::open(path, {}, {}, [](const char*, double) {});
  ASSERT_TRUE(store) << store.error().text;
  const volume::Session& session = (*store)->session();
  EXPECT_EQ(session.levels.count, GetParam().levels);
  EXPECT_EQ(session.steps, GetParam().steps);
  const auto& size = session.grid.size;
  const glm::vec3 extent = session.grid.box_room().size();
  EXPECT_NEAR(std::max({extent.x, extent.y, extent.z}), 0.8, 1e-5);
  for (const auto& preset : volume::transfer_presets()) {
    const auto transfer = *volume::transfer_preset(preset.name, session.range);
    const auto shown = shown_levels(transfer, session.levels);
    size_t voxels = 0, bytes = 0;
    for (int k = 0; k < size[2]; k += 64) {
      const auto slab = *(*store)->voxels(session.steps - 1, k, std::min(k + 64, size[2]), shown, {});
      const auto encoded = volume::encode_voxels(slab, size[0], size[1]);
      const auto again =
          volume::decode_voxels(encoded, size[0], size[1], slab.k_begin, slab.k_end, session.levels.count);
      ASSERT_TRUE(again) << again.error().text;
      ASSERT_EQ(*again, slab);
      voxels += slab.size(), bytes += encoded.size();
    }
    EXPECT_GT(voxels, 0u) << preset.name;
    EXPECT_LT(double(bytes), 4.0 * double(voxels)) << preset.name;
  }
}

INSTANTIATE_TEST_SUITE_P(All, RealVolumes,
                         testing::Values(RealVolume{"bonsai.nii.gz", 256, 1}, RealVolume{"heptane.nii.gz", 256, 1},
                                         RealVolume{"fuel.nii.gz", 256, 1}, RealVolume{"avm-angio.nii.gz", 256, 1},
                                         RealVolume{"heart-cine", 1479, 13},
                                         RealVolume{"alderson-ct-512x512x199.mha", 4096, 1}),
                         [](const auto& info) {
                           auto n = info.param.name;
                           for (char& c : n)
                             if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
                           return n;
                         });

}  // namespace
}  // namespace telesplat::data
