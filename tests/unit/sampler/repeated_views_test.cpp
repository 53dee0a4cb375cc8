#include <gtest/gtest.h>

#include "services/sampler/volume/repeated_views.h"

namespace telesplat::sampler {
namespace {

wire::SliceLease lease_of(uint64_t slab_end, double eye, uint64_t frame) {
  wire::SliceLease lease;
  lease.frame = FrameId{frame};
  lease.epoch = EpochId{1};
  lease.end = slab_end;
  lease.shear.eye.z = eye;
  return lease;
}

TEST(RepeatedViews, AreFoundOnceTheyWereSampledOftenEnough) {
  RepeatedViews views(2);
  EXPECT_EQ(views.find(lease_of(5, 1, 1)), nullptr);
  views.add(lease_of(5, 1, 1), {1, 2}, 7, 0.3, 0.1);
  EXPECT_EQ(views.find(lease_of(5, 1, 2)), nullptr);
  views.add(lease_of(5, 1, 2), {1, 2}, 7, 0.2, 0.2);
  const auto* view = views.find(lease_of(5, 1, 3));
  ASSERT_NE(view, nullptr);
  EXPECT_EQ(view->bytes, (std::vector<uint8_t>{1, 2}));
  EXPECT_EQ(view->voxels, 7u);
  EXPECT_DOUBLE_EQ(view->cost_s(), 0.3) << "the least of each";
  EXPECT_EQ(views.find(lease_of(6, 1, 3)), nullptr) << "another slab";
  EXPECT_EQ(views.find(lease_of(5, 2, 3)), nullptr) << "another eye";
  auto later = lease_of(5, 1, 3);
  later.epoch = EpochId{2};
  EXPECT_EQ(views.find(later), nullptr) << "another epoch";
}

TEST(RepeatedViews, ForgetTheOneThatWasNotUsedForLongest) {
  RepeatedViews views(1);
  for (size_t i = 0; i < RepeatedViews::kViews; ++i) views.add(lease_of(i + 1, 1, 1), {}, i, 0.1, 0.1);
  ASSERT_NE(views.find(lease_of(1, 1, 2)), nullptr);
  views.add(lease_of(999, 1, 1), {}, 1, 0.1, 0.1);
  EXPECT_NE(views.find(lease_of(1, 1, 3)), nullptr);
  EXPECT_EQ(views.find(lease_of(2, 1, 3)), nullptr);
  EXPECT_NE(views.find(lease_of(999, 1, 3)), nullptr);
}

TEST(RepeatedViews, CanBeOff) {
  RepeatedViews views(0);
  views.add(lease_of(5, 1, 1), {1}, 7, 0.3, 0.1);
  EXPECT_EQ(views.find(lease_of(5, 1, 2)), nullptr);
}

}  // namespace
}  // namespace telesplat::sampler
