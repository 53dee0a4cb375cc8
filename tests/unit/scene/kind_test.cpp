#include "common/scene/kind.h"

#include <gtest/gtest.h>

#include "common/scene/session.h"

namespace telesplat::scene {
namespace {

TEST(SceneKind, NamesReadBack) {
  for (const Kind kind : kKinds) {
    EXPECT_EQ(kind_named(name_of(kind)), kind);
    EXPECT_FALSE(described(kind).empty());
  }
  EXPECT_EQ(kind_named("cloud"), std::nullopt);
  EXPECT_EQ(kind_named(""), std::nullopt);
}

TEST(SceneKind, EachTravelsInOnePipeline) {
  for (const Kind kind : kKinds) {
    const bool points = Kinds::of(Pipeline::kPoints).has(kind), slices = Kinds::of(Pipeline::kSlices).has(kind);
    EXPECT_NE(points, slices) << name_of(kind);
    EXPECT_EQ(points, pipeline_of(kind) == Pipeline::kPoints) << name_of(kind);
    EXPECT_TRUE(Kinds::all().has(kind));
  }
}

TEST(SessionView, SaysWhatIsMissing) {
  wire::Welcome session;
  const SessionView view(session);
  EXPECT_EQ(view.kind(), std::nullopt);
  EXPECT_EQ(view.pipeline(), std::nullopt);
  EXPECT_EQ(view.endpoint("chunks"), "");
  session.facts["kind"] = "volume";
  EXPECT_EQ(view.kind(), Kind::kVolume);
  EXPECT_EQ(view.pipeline(), Pipeline::kSlices);
  session.facts["kind"] = "something later";
  EXPECT_EQ(view.kind(), std::nullopt);
}

}  // namespace
}  // namespace telesplat::scene
