// Real volumes of several formats, if this machine has them.
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>

#include "services/data/volume/volume.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

std::string data_folder() {
  if (const char* folder = std::getenv("TELESPLAT_DATA")) return folder;
  const char* home = std::getenv("HOME");
  return std::string(home ? home : "") + "/.cache/telesplat-data";
}

struct RealVolume {
  std::string name, format;
  std::array<int, 3> size;
  VoxelType type;
  std::array<double, 3> spacing;
  double lo, hi;
  size_t steps = 1;
  bool hounsfield = false;
};

class RealVolumes : public testing::TestWithParam<RealVolume> {};

TEST_P(RealVolumes, AreAsTheirSourcesSay) {
  const RealVolume& expected = GetParam();
  const std::string path = data_folder() + "/volumes/" + expected.name;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  EXPECT_TRUE(looks_like_volume(path));
  const auto source = find_volume(path);
  ASSERT_TRUE(source.ok()) << source.error().text;
  EXPECT_EQ(source->steps.size(), expected.steps);
  double last = -1;
  const auto volume = read_volume(*source, 0, [&](double fraction) {
    EXPECT_GE(fraction, last);
    EXPECT_LE(fraction, 1.0);
    last = fraction;
  });
  ASSERT_TRUE(volume.ok()) << volume.error().text;
  EXPECT_GT(last, 0.5);
  EXPECT_EQ(volume->format, expected.format);
  EXPECT_EQ(volume->size, expected.size);
  EXPECT_EQ(volume->type, expected.type) << name_of(volume->type);
  EXPECT_EQ(volume->stored.size(),
            size_t(expected.size[0]) * expected.size[1] * expected.size[2] * voxel_bytes(expected.type));
  for (int a = 0; a < 3; ++a)
    EXPECT_NEAR(glm::length(glm::dvec3(volume->index_to_data[a])), expected.spacing[size_t(a)], 1e-4) << a;
  EXPECT_NEAR(volume->lo, expected.lo, 1e-3);
  EXPECT_NEAR(volume->hi, expected.hi, 1e-3);
  EXPECT_EQ(volume->not_finite, 0u);
  EXPECT_EQ(volume->hounsfield, expected.hounsfield);
}

constexpr double kMm = 0.546899974;
INSTANTIATE_TEST_SUITE_P(
    All, RealVolumes,
    testing::Values(
        RealVolume{"bonsai.nii.gz", "nifti", {256, 256, 256}, VoxelType::kU8, {1, 1, 1}, 0, 255},
        RealVolume{"heptane.nii.gz", "nifti", {302, 302, 302}, VoxelType::kU8, {1, 1, 1}, 0, 255},
        RealVolume{"fuel.nii.gz", "nifti", {64, 33, 32}, VoxelType::kU8, {1, 1, 1}, 0, 255},
        RealVolume{"avm-angio.nii.gz", "nifti", {337, 319, 154}, VoxelType::kU8, {kMm, kMm, 1}, 0, 563.2},
        RealVolume{"alderson-ct-512x512x199.mha",
                   "metaimage",
                   {512, 512, 199},
                   VoxelType::kI16,
                   {1.328125, 1.328125, 3},
                   -1024,
                   3071,
                   1,
                   true},
        RealVolume{
            "alderson-dicom", "dicom", {512, 512, 40}, VoxelType::kU16, {1.328125, 1.328125, 3}, -1024, 3071, 1, true},
        RealVolume{"heart-cine", "nrrd", {128, 128, 65}, VoxelType::kU16, {1.85185, 1.85185, 1.85}, 0, 1459, 13}),
    [](const auto& info) {
      auto n = info.param.name;
      std::replace_if(
          n.begin(), n.end(), [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); }, '_');
      return n;
    });

Volume read_or_fail(const std::string& path, size_t step = 0) {
  const auto source = find_volume(path);
  EXPECT_TRUE(source.ok()) << source.error().text;
  auto volume = source ? read_volume(*source, step, nullptr) : source.error();
  EXPECT_TRUE(volume.ok()) << volume.error().text;
  return volume ? std::move(*volume) : Volume{};
}

// The folder holds 40 neighbouring slices of the scan in the single file, turned half round about x: two readers that
// share nothing must agree.
TEST(RealVolumeSlices, OfTheDicomFolderAreThoseOfTheMetaImage) {
  const std::string folder = data_folder() + "/volumes/";
  for (const char* name : {"alderson-dicom", "alderson-ct-512x512x199.mha"})
    if (!std::filesystem::exists(folder + name)) GTEST_SKIP() << folder << name << " is not there (set TELESPLAT_DATA)";
  const Volume part = read_or_fail(folder + "alderson-dicom"),
               all = read_or_fail(folder + "alderson-ct-512x512x199.mha");
  ASSERT_EQ(part.size[0], all.size[0]);
  ASSERT_EQ(part.size[1], all.size[1]);
  const size_t width = size_t(part.size[0]), height = size_t(part.size[1]);
  const auto same = [&](size_t k_part, int k_all, size_t stride) {
    if (k_all < 0 || k_all >= all.size[2]) return false;
    for (size_t at = 0; at < width * height; at += stride) {
      const size_t i = at % width, j = at / width;
      if (part.value(k_part * width * height + at) != all.value((size_t(k_all) * height + height - 1 - j) * width + i))
        return false;
    }
    return true;
  };
  int first = 0;
  while (first < all.size[2] && !same(0, first, 97)) ++first;
  ASSERT_LT(first, all.size[2]) << "the first slice is nowhere in the whole scan";
  const int step = same(1, first + 1, 97) ? 1 : -1;
  for (int k = 0; k < part.size[2]; ++k) EXPECT_TRUE(same(size_t(k), first + step * k, 1)) << k;
}

TEST(RealVolumeSeries, PlaysInTheOrderOfItsNumbers) {
  const std::string path = data_folder() + "/volumes/heart-cine";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  const auto source = find_volume(path);
  ASSERT_TRUE(source.ok()) << source.error().text;
  EXPECT_EQ(source->name, "heart-cine");
  ASSERT_EQ(source->steps.size(), 13u);
  for (size_t s = 0; s < 13; ++s) EXPECT_TRUE(source->steps[s].ends_with(fmt::format("phase{:02}.nrrd", 2 * s)));
  const Volume first = read_or_fail(path), last = read_or_fail(path, 12);
  EXPECT_EQ(first.size, last.size);
  EXPECT_NE(first.stored, last.stored);
  EXPECT_FALSE(read_volume(*source, 13, nullptr).ok());
}

TEST(RealVolumeFolder, OfUnrelatedVolumesIsNoSeries) {
  const std::string path = data_folder() + "/volumes";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there (set TELESPLAT_DATA)";
  const auto source = find_volume(path);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().text.find("not one numbered series"), std::string::npos) << source.error().text;
}

}  // namespace
}  // namespace telesplat::data::test
