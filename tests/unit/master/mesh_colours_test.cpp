// Colours of a mesh: chosen by the data server, then by commands; another array is fetched before its epoch.
#include "services/master/tiles/mesh_colours.h"

#include <gtest/gtest.h>

namespace telesplat::master {
namespace {

wire::Hello data(const std::string& colouring = "", const std::string& answer = "") {
  const std::vector<scene::ArrayInfo> arrays{{"heat", "K", false, 1, {{0, 10}}}, {"area", "", true, 1, {{1, 2}}}};
  wire::Hello h;
  h.facts = {{"kind", "mesh"},
             {"content_hash", "1"},
             {scene::kArraysFact, scene::to_text(arrays)},
             {scene::kColourMapFact, "plasma"}};
  if (!colouring.empty()) h.facts[scene::kColouringFact] = colouring;
  if (!answer.empty()) h.facts[scene::kArrayAnswerFact] = answer;
  return h;
}

std::string heat() { return scene::to_text({"heat", "K", 0, 10, 0, *colour::find_colour_map("viridis")}); }

wire::Control colour(std::map<std::string, std::string> arguments) { return {"colour", std::move(arguments)}; }

class MeshColoursTest : public testing::Test {
 protected:
  bool adopt(const wire::Hello& hello) {
    problem.clear();
    return colours.adopt(hello, problem);
  }
  std::map<std::string, std::string> told() const {
    wire::Welcome w;
    colours.describe(w);
    return w.facts;
  }
  std::string refusal(const wire::Control& command) {
    const auto before = told();
    const auto done = colours.obey(command);
    EXPECT_EQ(told(), before);
    return done ? "" : done.error().text;
  }
  scene::Colouring now() const { return *scene::colouring_from_text(colours.text()); }

  MeshColours colours;
  std::string problem;
};

TEST_F(MeshColoursTest, RangeAndMapBeginAnEpochAtOnce) {
  EXPECT_TRUE(adopt(data(heat())));
  EXPECT_EQ(told().at(scene::kColouringFact), heat());
  auto done = colours.obey(colour({{"array", "heat:2:3"}}));
  ASSERT_TRUE(done.ok()) << done.error().text;
  EXPECT_TRUE(done->begins_epoch);
  EXPECT_EQ(now().lo, 2);
  EXPECT_EQ(now().map.name, "viridis");
  ASSERT_TRUE(colours.obey(colour({{"map", "magma"}})).ok());
  EXPECT_EQ(now().map.name, "magma");
  EXPECT_EQ(now().hi, 3);
  ASSERT_TRUE(colours.obey(colour({{"array", "heat"}, {"map", "own=0:#000000,1:#ffffff"}})).ok());
  EXPECT_EQ(now().hi, 10);
  EXPECT_EQ(now().map.name, "own");
  EXPECT_FALSE(adopt(data(heat())));  // the data server was restarted: the choice stays
  EXPECT_EQ(now().map.name, "own");
}

TEST_F(MeshColoursTest, AnotherArrayIsFetchedFirst) {
  adopt(data(heat()));
  const auto done = colours.obey(colour({{"array", "area"}}));
  ASSERT_TRUE(done.ok()) << done.error().text;
  EXPECT_FALSE(done->begins_epoch);
  EXPECT_TRUE(done->tells_all);
  EXPECT_EQ(told().at(scene::kArrayOrderFact), "1 area");
  EXPECT_EQ(colours.waits_for(), "area is being fetched");
  EXPECT_EQ(now().array, "heat");
  EXPECT_FALSE(adopt(data(heat(), "7")));  // the answer to another order
  EXPECT_TRUE(adopt(data(heat(), "1")));
  EXPECT_EQ(now().array, "area");
  EXPECT_EQ(now().hi, 2);
  EXPECT_FALSE(told().contains(scene::kArrayOrderFact));
  EXPECT_FALSE(adopt(data(heat(), "1")));

  ASSERT_TRUE(colours.obey(colour({{"array", "none"}})).ok());
  EXPECT_EQ(told().at(scene::kArrayOrderFact), "2 ");
  EXPECT_TRUE(adopt(data(heat(), "2")));
  EXPECT_EQ(colours.text(), "");
  EXPECT_FALSE(told().contains(scene::kColouringFact));
}

TEST_F(MeshColoursTest, AnArrayThatCannotBeHadChangesNothing) {
  EXPECT_FALSE(adopt(data()));
  ASSERT_TRUE(colours.obey(colour({{"array", "area"}})).ok());
  EXPECT_FALSE(adopt(data("", "1 disk full")));
  EXPECT_NE(problem.find("disk full"), std::string::npos);
  EXPECT_NE(colours.waits_for().find("disk full"), std::string::npos);
  EXPECT_EQ(colours.text(), "");
  EXPECT_FALSE(told().contains(scene::kArrayOrderFact));
}

TEST_F(MeshColoursTest, TheLastOrderCounts) {
  adopt(data());
  ASSERT_TRUE(colours.obey(colour({{"array", "area"}})).ok());
  ASSERT_TRUE(colours.obey(colour({{"array", "heat"}})).ok());
  EXPECT_FALSE(adopt(data("", "1")));
  EXPECT_EQ(colours.text(), "");
  EXPECT_TRUE(adopt(data("", "2")));
  EXPECT_EQ(now().array, "heat");
  EXPECT_EQ(now().map.name, "plasma");  // the data server's first map
}

TEST_F(MeshColoursTest, MapsOfAnArrayThatIsOnItsWayAreTaken) {
  adopt(data());
  ASSERT_TRUE(colours.obey(colour({{"array", "area"}})).ok());
  ASSERT_TRUE(colours.obey(colour({{"map", "magma"}})).ok());
  EXPECT_EQ(told().at(scene::kArrayOrderFact), "2 area");
  EXPECT_TRUE(adopt(data("", "2")));
  EXPECT_EQ(now().map.name, "magma");
}

TEST_F(MeshColoursTest, WhatIsWrongIsRefusedAndChangesNothing) {
  EXPECT_NE(refusal(colour({{"array", "heat"}})), "");  // no data server yet
  adopt(data());
  EXPECT_NE(refusal(colour({{"array", "cold"}})).find("heat, area"), std::string::npos);
  EXPECT_NE(refusal(colour({{"array", "heat:3:2"}})).find("MIN"), std::string::npos);
  EXPECT_NE(refusal(colour({{"map", "viridis"}})).find("ctl colour ARRAY"), std::string::npos);
  EXPECT_NE(refusal(colour({{"array", "heat"}, {"map", "nonesuch"}})), "");
  EXPECT_NE(refusal(colour({})), "");
  wire::Hello julia;
  julia.facts = {{"kind", "julia"}};
  adopt(julia);
  EXPECT_NE(refusal(colour({{"array", "heat"}})), "");
}

TEST_F(MeshColoursTest, HostileFactsAreTakenForNothing) {
  wire::Hello h = data("{\"array\":");
  h.facts[scene::kArraysFact] = "[{}]";
  h.facts[scene::kColourMapFact] = std::string(60000, '=');
  EXPECT_FALSE(adopt(h));
  EXPECT_NE(problem, "");
  EXPECT_EQ(colours.text(), "");
}

}  // namespace
}  // namespace telesplat::master
