#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "services/data/volume/formats/dicom.h"

namespace telesplat::data {
namespace {

DicomSlice slice(double z, int number = 0) {
  DicomSlice s;
  s.path = "slice" + std::to_string(number);
  s.uid = "1." + std::to_string(number);
  s.instance = number;
  s.pixels.rows = 4, s.pixels.columns = 5;
  s.plane.position = glm::dvec3(1, 2, z);
  return s;
}

std::vector<DicomSlice> at(const std::vector<double>& heights) {
  std::vector<DicomSlice> out;
  for (const double z : heights) out.push_back(slice(z, int(out.size())));
  return out;
}

DicomOrder order(std::vector<DicomSlice> slices, bool same = false) {
  return order_slices(std::move(slices), [=](auto&, auto&) { return same; });
}

// Heights of the layers: mixed from their slices'.
std::vector<double> heights_of(const DicomOrder& o, size_t step = 0) {
  std::vector<double> out;
  for (const DicomLayer& l : o.steps[step])
    out.push_back(o.slices[l.below].plane.position->z * (1 - l.share) + o.slices[l.above].plane.position->z * l.share);
  return out;
}

void expect_even(const DicomOrder& o, double from, double distance, size_t count) {
  ASSERT_EQ(o.steps[0].size(), count) << o.remark;
  EXPECT_NEAR(o.step.z, distance, 1e-9);
  EXPECT_NEAR(o.origin.z, from, 1e-9);
  const auto heights = heights_of(o);
  for (size_t k = 0; k < count; ++k) EXPECT_NEAR(heights[k], from + distance * double(k), 1e-6) << k;
}

TEST(DicomOrder, GoesByHeightWhateverTheNumber) {
  const DicomOrder o = order(at({6, 2, 0, 4}));
  expect_even(o, 0, 2, 4);
  EXPECT_EQ(o.remark, "");
}

TEST(DicomOrder, MixesWhatIsMissingAndSaysWhere) {
  const DicomOrder o = order(at({0, 2, 4, 12, 14, 18}));
  expect_even(o, 0, 2, 10);
  EXPECT_EQ(o.remark,
            "4 missing slices, 2 mm apart, mixed from neighbours: 3 between slice2 and slice3, 1 between "
            "slice4 and slice5");
  EXPECT_EQ(o.steps[0][4].share, 0.5);
  EXPECT_EQ(o.steps[0][6].share, 0);
}

TEST(DicomOrder, OneSliceMissingNearTheEndOfManyIsNotEvened) {
  std::vector<double> heights;
  for (int k = 0; k < 300; ++k)
    if (k != 298) heights.push_back(k * 0.625);
  expect_even(order(at(heights)), 0, 0.625, 300);
}

TEST(DicomOrder, EvensSmallStepsAsideAndResamplesLargeOnes) {
  const DicomOrder evened = order(at({0, 2.02, 3.98, 6}));
  ASSERT_EQ(evened.steps[0].size(), 4u);
  EXPECT_EQ(evened.remark, "slices are 1.96 to 2.02 mm apart and were evened");
  const DicomOrder resampled = order(at({0, 2, 4, 7, 10, 13, 20}));
  expect_even(resampled, 0, 2, 11);
  EXPECT_EQ(resampled.remark, "slices are 2 to 7 mm apart; resampled to 2 mm");
  // Two slices that nearly touch do not cause many layers.
  EXPECT_LE(order(at({0, 0.01, 1000, 2000})).steps[0].size(), 81u);
}

TEST(DicomOrder, LeavesOutLocalizersOthersAndCopies) {
  auto slices = at({0, 2, 4});
  slices.push_back(slices[1]);
  DicomSlice scout = slice(3, 9);
  scout.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER";
  for (int n = 0; n < 9; ++n) scout.uid += "0", slices.push_back(scout);
  DicomSlice coronal = slice(1, 20), small = slice(1, 21);
  coronal.plane.along_column = {0, 0, -1}, small.pixels.rows = 3;
  slices.push_back(coronal), slices.push_back(small);
  const DicomOrder o = order(slices);
  expect_even(o, 0, 2, 3);
  EXPECT_EQ(o.slices.size(), 3u);
  EXPECT_EQ(o.remark,
            "left out 9 slices: a localizer (slice9); left out 1 slice: turned, spaced or placed otherwise (slice20); "
            "left out 1 "
            "slice: of 5 x 3 pixels instead of 5 x 4 (slice21); left out 1 slice that are there twice (slice1)");
  EXPECT_EQ(order({scout}).steps[0].size(), 1u) << "a localizer alone is shown";
}

TEST(DicomOrder, SamePlacesAreTimeStepsIfAllHaveAsMany) {
  std::vector<DicomSlice> slices;
  for (int t = 0; t < 3; ++t)
    for (int k = 0; k < 4; ++k) {
      slices.push_back(slice(k * 2, t * 4 + k));
      slices.back().times[0] = 3 - t;
    }
  const DicomOrder o = order(slices);
  ASSERT_EQ(o.steps.size(), 3u);
  for (size_t t = 0; t < 3; ++t)
    for (const DicomLayer& l : o.steps[t]) EXPECT_EQ(o.slices[l.below].times[0], double(t + 1));
  EXPECT_EQ(o.remark, "3 slices at each place, told apart by temporal position: time steps");
  slices.pop_back();
  const DicomOrder uneven = order(slices);
  ASSERT_EQ(uneven.steps.size(), 1u);
  expect_even(uneven, 0, 2, 4);
  EXPECT_NE(uneven.remark.find("left out 7 slices at places"), std::string::npos) << uneven.remark;
}

TEST(DicomOrder, SamePixelsAtAllPlacesAreCopiesAndAirIsNot) {
  std::vector<DicomSlice> slices;
  for (int t = 0; t < 2; ++t)
    for (int k = 0; k < 3; ++k) slices.push_back(slice(k, t * 3 + k));
  const DicomOrder copies = order(slices, true);
  EXPECT_EQ(copies.steps.size(), 1u);
  EXPECT_EQ(copies.remark, "left out 3 slices with the pixels of others at their place");
  const DicomOrder air =
      order_slices(slices, [](const DicomSlice& a, const DicomSlice&) { return a.plane.position->z == 2; });
  EXPECT_EQ(air.steps.size(), 2u) << air.remark;
}

TEST(DicomOrder, KeepsWhatIsAskewAskew) {
  auto slices = at({0, 2, 4});
  for (DicomSlice& s : slices) s.plane.position->y += s.plane.position->z * std::tan(0.2);
  const DicomOrder o = order(slices);
  EXPECT_NEAR(o.step.y, 2 * std::tan(0.2), 1e-9);
  EXPECT_NEAR(o.step.z, 2, 1e-9);
  EXPECT_NE(o.remark.find("askew by 11.5 degrees"), std::string::npos) << o.remark;
}

TEST(DicomOrder, TakesAnyValuesOfHostileFiles) {
  for (const double odd : {0.0, -1.0, 1e11, -1e11, 1e-300}) {
    auto slices = at({0, 1, 2});
    slices[1].plane.position->z = odd;
    slices[2].plane.spacing = {odd, odd};
    EXPECT_FALSE(order(slices).steps.empty());
    for (DicomSlice& s : slices) s.plane.along_row = s.plane.along_column = {1, 0, 0}, s.plane.spacing = {odd, odd};
    EXPECT_FALSE(order(slices).steps.empty());
  }
}

}  // namespace
}  // namespace telesplat::data
