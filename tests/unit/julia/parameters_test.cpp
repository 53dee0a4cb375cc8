// Names, limits, presets and flags of Julia sets.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "common/julia/flags.h"
#include "common/options/parser.h"

namespace telesplat::julia {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

TEST(JuliaParameters, EachNameSetsOneValueWithinItsLimits) {
  std::set<std::string_view> names;
  for (const auto& info : parameter_infos()) {
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
    EXPECT_FALSE(info.text.empty()) << info.name;
    for (const double value : {info.least, info.most}) {
      Parameters p;
      ASSERT_TRUE(set(p, info.name, value).ok()) << info.name;
      EXPECT_EQ(get(p, info.name), value) << info.name;
      Parameters undone = p;
      ASSERT_TRUE(set(undone, info.name, get(Parameters{}, info.name)).ok());
      EXPECT_EQ(undone, Parameters{}) << info.name << " changes something else too";
    }
    for (const double value : {info.least - 0.5, info.most * 1.5 + 1, kNan, kInfinity, -kInfinity}) {
      Parameters p;
      const Status s = set(p, info.name, value);
      ASSERT_FALSE(s.ok()) << info.name << " " << value;
      EXPECT_EQ(p, Parameters{}) << info.name;
      for (const std::string& part : {std::string(info.name), fmt::format("{}", info.most)})
        EXPECT_NE(s.error().text.find(part), std::string::npos) << s.error().text;
    }
    if (info.whole) {
      Parameters p;
      EXPECT_FALSE(set(p, info.name, info.least + 0.5).ok()) << info.name;
    }
  }
  EXPECT_EQ(names.size(), 18u);
  Parameters p;
  const Status unknown = set(p, "c.q", 1);
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().text.find("c.q"), std::string::npos);
  EXPECT_NE(unknown.error().text.find("slice.turn-z"), std::string::npos);
}

TEST(JuliaParameters, MapsGoThereAndBackAndIgnoreWhatIsNotTheirs) {
  for (const auto& preset : presets()) {
    auto values = to_map(preset.parameters);
    EXPECT_EQ(values.size(), parameter_infos().size());
    values["room.x"] = 7;
    const auto back = from_map(values);
    ASSERT_TRUE(back.ok()) << back.error().text;
    EXPECT_EQ(*back, preset.parameters);
  }
  EXPECT_EQ(*from_map({}), Parameters{});
  EXPECT_FALSE(from_map({{"iterations", 1e9}}).ok());
}

TEST(JuliaParameters, ValidateSaysWhatIsWrong) {
  const Parameters good = presets().front().parameters;
  EXPECT_TRUE(validate(good).ok());
  const auto wrong = [&](auto change, const char* part) {
    Parameters p = good;
    change(p);
    const Status s = validate(p);
    ASSERT_FALSE(s.ok()) << part;
    EXPECT_NE(s.error().text.find(part), std::string::npos) << s.error().text;
  };
  wrong([](Parameters& p) { p.c.x = kNan; }, "c.x is nan");
  wrong([](Parameters& p) { p.iterations = 0; }, "iterations is 0, limits are 1..4096");
  wrong([](Parameters& p) { p.iterations = 1'000'000'000; }, "iterations is 1000000000");
  wrong([](Parameters& p) { p.slice_offset = 3; }, "the slice is empty");
  wrong([](Parameters& p) { p.c = {4, 4, 4, 4}, p.bailout = 2; }, "bailout is 2");
  wrong([](Parameters& p) { p.colour = Colour(17); }, "colour is 17");
  wrong([](Parameters& p) { p.palette = -1; }, "palette is -1");
}

TEST(JuliaPresets, AreValidNamedOnceAndFound) {
  std::set<std::string_view> names;
  EXPECT_GE(presets().size(), 8u);
  for (const auto& p : presets()) {
    EXPECT_TRUE(names.insert(p.name).second) << p.name;
    EXPECT_TRUE(validate(p.parameters).ok()) << p.name;
    EXPECT_FALSE(p.text.empty());
    ASSERT_TRUE(preset_named(p.name).ok());
    EXPECT_EQ(*preset_named(p.name), p.parameters);
    EXPECT_NE(describe_presets().find(p.name), std::string::npos);
  }
  const auto none = preset_named("no-such");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find(presets().front().name), std::string::npos);
}

TEST(JuliaPlacement, GoesThroughMessagesAndPutsTheBoxInTheMiddle) {
  const geometry::DBox box{{-1, 0, 2}, {3, 1, 4}};
  const Placement p = place(box, 0.8);
  EXPECT_EQ(p.centre, glm::dvec3(1, 0.5, 3));
  EXPECT_DOUBLE_EQ(p.scale, 0.2);
  EXPECT_EQ(p.box_room.lo, -p.box_room.hi);
  EXPECT_FLOAT_EQ(p.box_room.size().x, 0.8f);
  EXPECT_FLOAT_EQ(p.box_room.size().y, 0.2f);
  auto values = to_map(p);
  const auto back = placement_from_map(values, p.box_room);
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(back->centre, p.centre);
  EXPECT_EQ(back->scale, p.scale);
  for (const double bad : {0.0, -1.0, kNan, kInfinity}) {
    values["room.scale"] = bad;
    EXPECT_FALSE(placement_from_map(values, p.box_room).ok()) << bad;
  }
  values.erase("room.scale");
  const auto missing = placement_from_map(values, p.box_room);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().text.find("room.scale"), std::string::npos);
}

Result<Scene> read_flags(std::vector<std::string> flags) {
  SceneOptions o;
  options::Parser parser("Julia sets");
  parser.add(scene_table(o));
  parser.parse_or_exit("test", std::move(flags));
  // Flags for another program give the same scene.
  const auto scene = read_scene(o);
  SceneOptions again;
  options::Parser other("Julia sets");
  other.add(scene_table(again));
  other.parse_or_exit("other", to_flags(o));
  const auto same = read_scene(again);
  EXPECT_EQ(scene.ok(), same.ok());
  if (scene && same) {
    EXPECT_EQ(scene->parameters, same->parameters);
  }
  return scene;
}

TEST(JuliaFlags, PresetThenConstantThenSingleParameters) {
  const auto plain = read_flags({});
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->parameters, presets().front().parameters);
  EXPECT_EQ(plain->title, fmt::format("julia ({})", presets().front().name));
  const auto given = read_flags({"--preset", std::string(presets()[1].name), "--c", "-0.1,0.2,-0.3,0.4", "--c.w=-0.5",
                                 "--palette", "ice", "--colour", "trap", "--iterations", "100"});
  ASSERT_TRUE(given.ok()) << given.error().text;
  Parameters wanted = presets()[1].parameters;
  wanted.c = {-0.1, 0.2, -0.3, -0.5};
  wanted.palette = 7;
  wanted.colour = Colour::kTrap;
  wanted.iterations = 100;
  EXPECT_EQ(given->parameters, wanted);
  EXPECT_EQ(read_flags({"--c", "0,0,0,-1"})->title, "julia");
  const auto moving = read_flags({"--animate", "c.y=0.25:0.3:2s"});
  ASSERT_TRUE(moving.ok()) << moving.error().text;
  EXPECT_EQ(moving->parameters.c.y, 0.25) << "parameters are those at 0 s";
  EXPECT_EQ(moving->timeline.tracks.size(), 1u);
}

TEST(JuliaFlags, ErrorsNameParameterValueAndLimit) {
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases{
      {{"--c.x", "nan"}, "c.x is nan, limits are -4..4"},
      {{"--c.x", "inf"}, "c.x is inf"},
      {{"--c.x", "0.5x"}, "c.x is \"0.5x\", not a number"},
      {{"--iterations", "0"}, "iterations is 0, limits are 1..4096"},
      {{"--iterations", "1000000000"}, "iterations is 1000000000"},
      {{"--iterations", "2.5"}, "whole numbers"},
      {{"--c", "1,2,3"}, "not four numbers"},
      {{"--c", "1,2,3,4,5"}, "not four numbers"},
      {{"--c", "1,nan,3,4"}, "c.y is nan"},
      {{"--preset", "nonesuch"}, "nonesuch: no preset"},
      {{"--palette", "mud"}, "palette is \"mud\", not one of ember"},
      {{"--colour", "mood"}, "colour is \"mood\", not one of distance"},
      {{"--slice.offset", "3"}, "the slice is empty"},
      {{"--animate", "c.y=-0.4:0.4"}, "c.y=-0.4:0.4"},
      {{"--animate", "c.q=0:1:1s"}, "c.q: no parameter"},
      {{"--animate", "iterations=8:64:1s"}, "iterations: cannot be animated"},
      {{"--animate", "bound=1:2:1s"}, "bound: cannot be animated"},
      {{"--animate", "c.y=0:5:1s"}, "c.y is 5, limits are -4..4"},
      {{"--animate", "slice.offset=0:3.5:1s"}, "the slice is empty"},
  };
  for (const auto& [flags, part] : cases) {
    const auto scene = read_flags(flags);
    ASSERT_FALSE(scene.ok()) << part;
    EXPECT_NE(scene.error().text.find(part), std::string::npos) << scene.error().text;
  }
}

TEST(JuliaFlags, AnEmptySliceIsBlamedOnWhatMakesItEmpty) {
  const auto blamed = [](const std::function<void(Parameters&)>& change) {
    Scene scene{"julia", {}, {}};  // c = 0: the unit ball
    change(scene.parameters);
    EXPECT_TRUE(validate(scene.parameters).ok());
    const auto placed = place(scene, 1);
    return placed.ok() ? std::string("nothing") : placed.error().text;
  };
  const auto begins = [](const std::string& text, const std::string& with) {
    EXPECT_TRUE(text.starts_with(with)) << text;
    EXPECT_NE(text.find("holds no point of the set"), std::string::npos) << text;
  };
  begins(blamed([](Parameters& p) { p.c = {3, 3, 3, 3}; }), "c is 3,3,3,3: ");
  begins(blamed([](Parameters& p) { p.c = {3, 3, 3, 3}, p.slice_offset = 0.5; }), "c is 3,3,3,3: ");
  begins(blamed([](Parameters& p) { p.c.w = -1, p.slice_offset = 1.55; }), "slice.offset is 1.55: ");
  EXPECT_EQ(blamed([](Parameters& p) { p.slice_offset = 0.5; }), "nothing");
}

TEST(JuliaFlags, AnEmptySliceIsFoundWhereverItIsInTheAnimation) {
  Scene scene{"julia", {}, {}};  // c = 0: the unit ball
  scene.parameters.slice_offset = 0.9;
  ASSERT_TRUE(place(scene, 1).ok());
  scene.parameters.slice_offset = 1.75;
  scene.parameters.c.w = 1.5;  // within the ball of radius(), and yet outside the set
  ASSERT_TRUE(validate(scene.parameters).ok());
  const auto still = place(scene, 1);
  ASSERT_FALSE(still.ok());
  EXPECT_TRUE(still.error().text.starts_with("slice.offset is 1.75: the slice")) << still.error().text;
  scene.parameters.slice_offset = 0;
  scene.parameters.c.w = 0;
  scene.timeline = *parse_timeline("slice.offset=@0s:0@1s:0.99@2s:0.5@3s:0");
  ASSERT_TRUE(validate(scene.parameters, scene.timeline).ok());
  ASSERT_TRUE(place(scene, 1).ok());
  scene.timeline = *parse_timeline("slice.offset=@0s:0@1s:0@2s:1.75;c.w=@0s:0@1s:1.5@2s:1.5");
  ASSERT_TRUE(validate(scene.parameters, scene.timeline).ok());
  const auto later = place(scene, 1);
  ASSERT_FALSE(later.ok());
  EXPECT_NE(later.error().text.find(" s of the animation"), std::string::npos) << later.error().text;
}

}  // namespace
}  // namespace telesplat::julia
