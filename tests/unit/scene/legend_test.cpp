#include "common/scene/legend.h"

#include <gtest/gtest.h>

namespace telesplat::scene {
namespace {

TEST(SceneLegend, AColouringHasItsArrayUnitAndRange) {
  const Colouring c{"stress", "MPa", -2, 8, 0, *colour::find_colour_map("plasma")};
  const auto legend = legend_of({{kColouringFact, to_text(c)}}, {});
  ASSERT_TRUE(legend);
  EXPECT_EQ(legend->title, "stress [MPa]");
  EXPECT_EQ(legend->lo, -2);
  EXPECT_EQ(legend->hi, 8);
  EXPECT_EQ(legend->map, c.map);
  EXPECT_TRUE(legend->opacity.empty());
  EXPECT_EQ(legend_of(Colouring{"id", "", 0, 1, 0, c.map}).title, "id");
}

TEST(SceneLegend, ThereIsNoneWhereThereIsNothingToTell) {
  EXPECT_FALSE(legend_of({}, {}));
  EXPECT_FALSE(legend_of({{kColouringFact, ""}}, {}));
  EXPECT_FALSE(legend_of({{kColouringFact, "nonsense"}}, {}));
  EXPECT_FALSE(legend_of({{"transfer", "0:#000000:0"}}, {})) << "without the volume's parameters";
}

TEST(SceneLegend, AVolumeShowsItsTransferFunctionOverTheDatasValues) {
  volume::Session session;
  session.grid.size = {4, 4, 4};
  session.levels = {-1000, 1, 3000};
  session.range = {-1000, 2000, 0, 1000, true};
  session.transfer = *volume::parse_transfer("-3000:#000000:0, 0:#ff0000:0, 1000:#ffffff:0.5", session.range);
  const auto legend = legend_of(volume::to_facts(session), volume::to_parameters(session));
  ASSERT_TRUE(legend);
  EXPECT_EQ(legend->title, "CT number [HU]");
  EXPECT_EQ(legend->lo, -1000);
  EXPECT_EQ(legend->hi, 1000);
  ASSERT_FALSE(legend->opacity.empty());
  EXPECT_EQ(legend->opacity.front(), 0);
  EXPECT_FLOAT_EQ(legend->opacity.back(), 0.5f);
  EXPECT_EQ(legend->map.at(1), 0xffffffu);
  EXPECT_TRUE(image::legend_from_text(image::to_text(*legend)));
}

}  // namespace
}  // namespace telesplat::scene
