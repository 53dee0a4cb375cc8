// Colours, cuts and window settings as the panel and `telesplat ctl` change them.
#include <gtest/gtest.h>

#include "client/displays/window/panel/scene_controls.h"
#include "client/displays/window/view_settings.h"
#include "common/scene/placement.h"
#include "common/scene/settings.h"

namespace telesplat::viewer {
namespace {

wire::Welcome coloured_session() {
  const std::vector<scene::ArrayInfo> arrays{
      {.name = "temperature", .unit = "K", .spans = {{280, 320}}},
      {.name = "wind", .components = 3, .spans = {{0, 9}, {-5, 5}, {-4, 4}, {-1, 1}}}};
  wire::Welcome w;
  w.facts["kind"] = "mesh";
  w.facts[scene::kArraysFact] = scene::to_text(arrays);
  scene::ColourBy by{.array = "temperature"};
  w.facts[scene::kColouringFact] =
      scene::to_text(*scene::make_colouring(arrays, by, *colour::find_colour_map("viridis")));
  return w;
}

class Colours : public testing::Test {
 protected:
  Colours() { controls.on_session(0, session); }
  std::vector<Order> orders;
  wire::Welcome session = coloured_session();
  ColourControls controls{[this](Order o) { orders.push_back(std::move(o)); }};
};

TEST_F(Colours, ListArraysAndComponentsAndTheRangeOfNow) {
  EXPECT_EQ(controls.arrays(), (std::vector<std::string>{"temperature", "wind", "wind.x", "wind.y", "wind.z"}));
  ASSERT_TRUE(controls.colouring());
  EXPECT_EQ(controls.range(), (std::pair{280.0, 320.0}));
  EXPECT_EQ(controls.whole_range().hi, 320);
}

TEST_F(Colours, ChoicesAreOrdersOfCtl) {
  controls.choose_array("wind.x");
  controls.choose_array(std::string(scene::kNoArray));
  controls.choose_map(*colour::find_colour_map("plasma_r"));
  controls.reset_range();
  ASSERT_EQ(orders.size(), 4u);
  EXPECT_EQ(orders[0].arguments.at("array"), "wind.x");
  EXPECT_TRUE(scene::parse_colour_by(orders[1].arguments.at("array"))->array.empty());
  EXPECT_EQ(orders[2].arguments.at("map"), "plasma_r");
  EXPECT_EQ(orders[3].arguments.at("array"), "temperature");
}

TEST_F(Colours, ARangeIsShownAtOnceAndOrderedUnlessItIsNone) {
  controls.choose_range(1, 290, 300);
  EXPECT_EQ(controls.range(), (std::pair{290.0, 300.0}));
  ASSERT_EQ(orders.size(), 1u);
  const auto by = scene::parse_colour_by(orders[0].arguments.at("array"));
  ASSERT_TRUE(by);
  EXPECT_EQ(by->array, "temperature");
  EXPECT_EQ(by->lo, 290);
  EXPECT_EQ(by->hi, 300);
  controls.on_session(1.5, session);
  EXPECT_EQ(controls.range().first, 290) << "the session does not have it yet";
  controls.on_session(2 + ColourControls::kPatience_s, session);
  EXPECT_EQ(controls.range().first, 280) << "and never will";
  for (const auto& [lo, hi] : {std::pair{300.0, 300.0}, {310.0, 300.0}, {0.0, std::nan("")}, {-HUGE_VAL, 1.0}})
    controls.choose_range(9, lo, hi);
  EXPECT_EQ(orders.size(), 1u);
  controls.choose_range(9, 281, 282);
  controls.on_refusal();
  EXPECT_EQ(controls.range().first, 280);
}

TEST_F(Colours, AnIsosurfaceTellsItsValueAndRange) {
  EXPECT_FALSE(controls.iso());
  controls.choose_iso(4);
  EXPECT_TRUE(orders.empty());
  session.facts = {{"kind", "mesh"}, {scene::kIsoFact, "300 -1000 3000"}};
  controls.on_session(1, session);
  EXPECT_EQ(controls.iso(), 300);
  EXPECT_EQ(controls.iso_range().lo, -1000);
  EXPECT_TRUE(controls.iso_bars().empty());
  session.facts[volume::kHistogramFact] = "-1000:3000:90,0,7,1";
  controls.on_session(1, session);
  ASSERT_EQ(controls.iso_bars().size(), 3u) << "as the transfer function's editor has them";
  EXPECT_EQ(controls.iso_bars()[1].from, 0.5);
  EXPECT_TRUE(controls.arrays().empty());
  controls.choose_iso(450.5);
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_EQ(orders[0].command, "iso");
  EXPECT_EQ(orders[0].arguments.at("value"), "450.5");
  session.facts[scene::kIsoFact] = "300";
  controls.on_session(2, session);
  EXPECT_EQ(controls.iso(), 300);
  EXPECT_TRUE(controls.iso_range().empty());
  for (const char* text : {"300 -1.7e308 1.7e308", "300 nan 5", "300 0 inf", "300 9 5"}) {
    session.facts[scene::kIsoFact] = text;
    controls.on_session(3, session);
    EXPECT_EQ(controls.iso(), 300) << text;
    EXPECT_TRUE(controls.iso_range().empty()) << text;
    EXPECT_TRUE(controls.iso_bars().empty()) << text;
  }
  session.facts[scene::kIsoFact] = "nan 0 1";
  controls.on_session(4, session);
  EXPECT_FALSE(controls.iso());
}

class Cut : public testing::Test {
 protected:
  Cut() {
    session.facts[scene::kPlacementFact] = scene::to_text(scene::placement_of(
        glm::dmat3(1.0), {{0, 0, 0}, {200, 100, 50}}, {{-0.5f, -0.25f, -0.1f}, {0.5f, 0.25f, 0.1f}}));
    controls.on_session(0, session);
  }
  wire::Welcome session;
  std::vector<Order> orders;
  CutControls controls{[this](Order o) { orders.push_back(std::move(o)); }};
};

TEST_F(Cut, SlidersMakeAnOrderOfPlanesThatReadsBackTheSame) {
  ASSERT_TRUE(controls.knows_box());
  EXPECT_EQ(controls.value(0, 25), 50);
  controls.keep(1, 0, {25, 100});
  controls.keep(1, 2, {0, 80});
  ASSERT_EQ(orders.size(), 2u);
  EXPECT_EQ(orders[1].arguments.at("clip"), "plane x>=25%; plane z<=80%");
  EXPECT_TRUE(scene::parse_clip(orders[1].arguments.at("clip")));
  EXPECT_EQ(controls.kept()[0], (CutControls::Kept{25, 100}));
  EXPECT_EQ(controls.kept()[2], (CutControls::Kept{0, 80}));
  controls.keep(1, 0, {});
  controls.keep(1, 2, {});
  EXPECT_EQ(orders.back().arguments.at("clip"), "off");
  controls.keep(1, 1, {99.9, 100});
  EXPECT_EQ(controls.kept()[1].from, 99) << "something is kept";
}

TEST_F(Cut, AnOrderOfOthersMovesTheSliders) {
  session.facts[scene::kClipOrderFact] = "box 50,10%,0,150,90%,25";
  controls.on_session(5, session);
  EXPECT_EQ(controls.kept()[0], (CutControls::Kept{25, 75}));
  EXPECT_EQ(controls.kept()[1], (CutControls::Kept{10, 90}));
  EXPECT_EQ(controls.kept()[2], (CutControls::Kept{0, 50}));
  EXPECT_TRUE(controls.give(6, "plane 1,1,0,20"));
  EXPECT_EQ(controls.order(), "plane 1,1,0,20");
  EXPECT_EQ(controls.kept()[0], CutControls::Kept{}) << "a plane across no axis moves none";
  EXPECT_FALSE(controls.give(6, "plane q>=1"));
  EXPECT_EQ(orders.size(), 1u);
  controls.on_session(7 + CutControls::kPatience_s, session);
  EXPECT_EQ(controls.order(), "box 50,10%,0,150,90%,25") << "the session has not taken it";
}

TEST(ViewSettings, EachHasATextThatGivesItAgain) {
  ViewSettings v;
  v.sampling = {.adaptive = false, .width = 640, .height = 400, .least_sampling = 0.5};
  const auto values = values_of(v);
  for (const auto& [order, value] : values) {
    EXPECT_TRUE(change(v, order, value)) << order << " " << value;
    const auto* setting = scene::setting_of_order(order);
    ASSERT_NE(setting, nullptr) << order;
    EXPECT_EQ(setting->keeper, scene::Keeper::kViewer);
  }
  EXPECT_EQ(values_of(v), values);
  for (const auto& setting : scene::settings())
    if (setting.keeper == scene::Keeper::kViewer && setting.order != "overlay" && setting.order != "panel" &&
        setting.order != "fullscreen")
      EXPECT_TRUE(values.contains(std::string(setting.order))) << setting.order;
}

TEST(ViewSettings, ChangeWhatTheySay) {
  ViewSettings v;
  for (const auto& [order, value] : {std::pair{"splat", "ewa"},
                                     {"finish", "fill,smooth"},
                                     {"detail", "0.5"},
                                     {"background", "white"},
                                     {"shading", "head"},
                                     {"sampling-size", "640x400"},
                                     {"least-sampling", "0.25"},
                                     {"legend", "off"},
                                     {"stereo", "rows"},
                                     {"eye-separation", "0.1"},
                                     {"screen-distance", "2"},
                                     {"swap-eyes", "on"}})
    EXPECT_TRUE(change(v, order, value)) << order;
  EXPECT_EQ(v.look.render.kernel, splat::Kernel::kEwa);
  EXPECT_FALSE(v.look.render.finish.antialias);
  EXPECT_EQ(v.look.most_detail, 0.5);
  EXPECT_EQ(v.look.background, 0xffffffu);
  EXPECT_TRUE(v.look.head_light && v.look.lit);
  EXPECT_EQ(v.sampling, (SamplingWish{false, 640, 400, 0.25}));
  EXPECT_FALSE(v.legend);
  EXPECT_EQ(v.stereo.mode, stereo::Mode::kRows);
  EXPECT_TRUE(v.stereo.swap_eyes);
}

TEST(ViewSettings, WhatChangesNothingInPicturesIsRefused) {
  ViewSettings v{.pictures = true};
  for (const auto& [order, value] : values_of(ViewSettings{})) {
    const bool counts = order == "sampling-size" || order == "least-sampling" || order == "legend";
    const Status s = change(v, order, value);
    EXPECT_EQ(bool(s), counts) << order;
    if (!s) EXPECT_NE(s.error().text.find("--coupling images"), std::string::npos) << order << ": " << s.error().text;
  }
}

TEST(ViewSettings, WhatCannotBeIsRefusedInWordsAndChangesNothing) {
  ViewSettings v;
  const auto before = values_of(v);
  for (const auto& [order, value] : {std::pair{"splat", "round"},
                                     {"finish", "blur"},
                                     {"detail", "0.1"},
                                     {"detail", "nan"},
                                     {"detail", ""},
                                     {"background", "transparent"},
                                     {"background", "no colour"},
                                     {"shading", "dark"},
                                     {"sampling-size", "0x0"},
                                     {"sampling-size", "9999999x9"},
                                     {"least-sampling", "2"},
                                     {"legend", "yes"},
                                     {"stereo", "autostereo"},
                                     {"stereo", "quad-buffer"},
                                     {"eye-separation", "-1"},
                                     {"screen-distance", "1e9"},
                                     {"swap-eyes", "1"},
                                     {"no-such", "1"}}) {
    const Status s = change(v, order, value);
    ASSERT_FALSE(s) << order << " " << value;
    EXPECT_FALSE(s.error().text.empty());
  }
  EXPECT_EQ(values_of(v), before);
}

}  // namespace
}  // namespace telesplat::viewer
