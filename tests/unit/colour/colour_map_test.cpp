#include "common/colour/colour_map.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "common/colour/paraview_json.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::colour {
namespace {

ColourMap found(std::string_view name) {
  const auto map = find_colour_map(name);
  EXPECT_TRUE(map) << map.error().text;
  return map ? *map : ColourMap{"", {{0, 0}}};
}

void expect_near(uint32_t got, uint32_t want, int codes, const std::string& what) {
  for (const int shift : {16, 8, 0})
    EXPECT_NEAR(int(got >> shift & 255), int(want >> shift & 255), codes)
        << fmt::format("{}: #{:06x} is not near #{:06x}", what, got, want);
}

// Values of matplotlib 3.6 (viridis family, turbo), Moreland's table CoolWarmUChar33 and the other maps' formulas.
TEST(ColourMap, BuiltInMapsHaveThePublishedColours) {
  const struct {
    const char* name;
    uint32_t at_0, at_64, at_128, at_200, at_255;  // positions out of 255
  } published[] = {
      {"viridis", 0x440154, 0x3b528b, 0x21918c, 0x70cf57, 0xfde725},
      {"plasma", 0x0d0887, 0x7e03a8, 0xcc4778, 0xfba139, 0xf0f921},
      {"inferno", 0x000004, 0x57106e, 0xbc3754, 0xfb9d07, 0xfcffa4},
      {"magma", 0x000004, 0x51127c, 0xb73779, 0xfd9869, 0xfcfdbf},
      {"cividis", 0x00224e, 0x434e6c, 0x7d7c78, 0xc4b468, 0xfee838},
      {"turbo", 0x30123b, 0x28bceb, 0xa4fc3c, 0xf46617, 0x7a0403},
      {"grey", 0x000000, 0x404040, 0x808080, 0xc8c8c8, 0xffffff},
  };
  for (const auto& p : published) {
    const ColourMap map = found(p.name);
    expect_near(map.at(0), p.at_0, 0, p.name);
    expect_near(map.at(64 / 255.0), p.at_64, 1, p.name);
    expect_near(map.at(128 / 255.0), p.at_128, 1, p.name);
    expect_near(map.at(200 / 255.0), p.at_200, 1, p.name);
    expect_near(map.at(1), p.at_255, 0, p.name);
  }
  const ColourMap cool_warm = found("cool-warm");
  expect_near(cool_warm.at(0), 59 << 16 | 76 << 8 | 192, 1, "cool-warm");
  expect_near(cool_warm.at(0.25), 141 << 16 | 176 << 8 | 254, 1, "cool-warm");
  expect_near(cool_warm.at(0.5), 221 << 16 | 221 << 8 | 221, 1, "cool-warm");
  expect_near(cool_warm.at(0.75), 244 << 16 | 154 << 8 | 123, 1, "cool-warm");
  expect_near(cool_warm.at(1), 180 << 16 | 4 << 8 | 38, 1, "cool-warm");
  EXPECT_EQ(found("black-body").at(0.4), 0xe60000u);
  EXPECT_EQ(found("rainbow").at(0.375), 0x00ffffu);
  EXPECT_EQ(found("rainbow").at(0.875), 0xff0000u);
}

TEST(ColourMap, EveryNameIsFoundAndValidAndTravelsAsItsName) {
  EXPECT_EQ(colour_map_names().size(), 10u);
  EXPECT_EQ(colour_map_names().front(), "viridis");
  for (const auto name : colour_map_names()) {
    const ColourMap map = found(name);
    EXPECT_EQ(map.name, name);
    EXPECT_TRUE(validate(map)) << name;
    EXPECT_EQ(to_text(map), name);
    const ColourMap back = found(std::string(name) + "_r");
    EXPECT_TRUE(validate(back)) << name;
    EXPECT_EQ(to_text(back), std::string(name) + "_r");
    for (const double x : {0.0, 0.25, 1.0}) EXPECT_EQ(back.at(1 - x), map.at(x)) << name;
  }
  EXPECT_EQ(found("Cool_Warm").name, "cool-warm");
  EXPECT_EQ(found("jet").name, "rainbow");
  EXPECT_EQ(found("gray").name, "grey");
}

TEST(ColourMap, AWrongNameSuggestsTheNearest) {
  const auto text = [](std::string_view name) {
    const auto map = find_colour_map(name);
    return map ? std::string() : map.error().text;
  };
  EXPECT_NE(text("virdis").find("did you mean viridis?"), std::string::npos) << text("virdis");
  EXPECT_NE(text("coolwrm").find("did you mean cool-warm?"), std::string::npos) << text("coolwrm");
  EXPECT_EQ(text("xyzzy").find("did you mean"), std::string::npos) << text("xyzzy");
  EXPECT_NE(text("xyzzy").find("inferno"), std::string::npos) << "tells those there are";
  EXPECT_FALSE(text("").empty());
  EXPECT_LT(text(std::string(100000, 'x')).size(), 500u);
}

TEST(ColourMap, PlacesOutsideTakeTheEndsAndWhatIsNoNumberItsOwnColour) {
  const ColourMap map{"m", {{0.25, 0x102030}, {0.5, 0x304050}, {0.5, 0xff0000}, {1, 0x00ff00}}, 0x123456};
  EXPECT_EQ(map.at(-5), 0x102030u);
  EXPECT_EQ(map.at(std::numeric_limits<double>::infinity()), 0x00ff00u);
  EXPECT_EQ(map.at(std::nan("")), 0x123456u);
  EXPECT_EQ(map.at(0.375), 0x203040u);
  EXPECT_EQ(map.at(0.5), 0xff0000u) << "at a jump the last one holds";
}

TEST(ColourMap, TextsComeBackAsTheSameMap) {
  const ColourMap map{"my = map", {{0, 0x000001}, {1 / 3.0, 0xabcdef}, {1 / 3.0, 0}, {1, 0xffffff}}, 0x808080};
  const auto again = from_text(to_text(map));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(*again, map);
  const ColourMap not_viridis{"viridis", {{0, 0}, {1, 0xffffff}}};
  EXPECT_EQ(*from_text(to_text(not_viridis)), not_viridis);
  for (const char* bad : {"", "nothing", "m=", "m=0", "m=0:", "m=0:#12345", "m=0:#gggggg", "m=0:#000000,",
                          "m=x:#000000", "m=0.5:#000000,0.4:#000000", "m=-1:#000000", "m=2:#000000", "m=nan:#000000",
                          "m=inf:#000000", "m=0:#000000/", "m=0:#000000/#00", "m=0:#000000/#000000x", "a\nb=0:#000000"})
    EXPECT_FALSE(from_text(bad)) << bad;
  EXPECT_FALSE(from_text(std::string(5000, 'a')));
  std::string many = "m=0:#000000";
  for (int n = 0; n < 220; ++n) many += ",1:#000000";
  EXPECT_FALSE(from_text(many));
}

TEST(ColourMapJson, ValuesAreBroughtToTheUnitRange) {
  const auto map = parse_colour_map(
      R"([{"Name": "mine", "ColorSpace": "RGB", "NanColor": [1, 0, 0], "RGBPoints": [-50, 0, 0, 0, 0, 0, 1, 0, 150, 1, 1, 1]}])",
      "m.json");
  ASSERT_TRUE(map) << map.error().text;
  EXPECT_EQ(map->name, "mine");
  EXPECT_EQ(map->stops, (std::vector<ColourMap::Stop>{{0, 0}, {0.25, 0x00ff00}, {1, 0xffffff}}));
  EXPECT_EQ(map->missing, 0xff0000u);
  const auto one = parse_colour_map(R"({"RGBPoints": [5, 1, 0, 0]})", "m.json");
  ASSERT_TRUE(one);
  EXPECT_EQ(one->at(0.7), 0xff0000u);
}

TEST(ColourMapJson, ColourSpacesBendTheWayBetweenPoints) {
  const auto middle = [](const std::string& space, const std::string& points) {
    const auto map = parse_colour_map(R"({"ColorSpace": ")" + space + R"(", "RGBPoints": [)" + points + "]}", "m.json");
    EXPECT_TRUE(map) << map.error().text;
    return map ? map->at(0.5) : 0;
  };
  const std::string black_white = "0, 0, 0, 0, 1, 1, 1, 1", red_green = "0, 1, 0, 0, 1, 0, 1, 0";
  EXPECT_EQ(middle("RGB", black_white), 0x808080u);
  expect_near(middle("Lab", black_white), 0x777777, 1, "L* of 50");
  EXPECT_EQ(middle("HSV", red_green), 0xffff00u);
  EXPECT_EQ(middle("HSV", "0, 1, 0, 0, 1, 1, 0, 1"), 0xff0080u) << "the short way round";
  EXPECT_EQ(middle("HSVNoWrap", "0, 1, 0, 0, 1, 1, 0, 1"), 0x00ff80u) << "the long way round";
  EXPECT_EQ(middle("Step", red_green), 0xff0000u);
  expect_near(middle("Diverging", "0, 0.231373, 0.298039, 0.752941, 1, 0.705882, 0.0156863, 0.14902"), 0xdddddd, 2,
              "Diverging goes through grey");
}

TEST(ColourMapJson, TheNamedOneOfSeveralIsTaken) {
  const std::string two = R"([{"Name": "first", "RGBPoints": [0, 0, 0, 0, 1, 0, 0, 1]},
                              {"Name": "second", "RGBPoints": [0, 0, 0, 0, 1, 1, 0, 0]}])";
  const auto path = std::filesystem::path(tests::own_folder()) / fmt::format("maps-{}.json", getpid());
  std::ofstream(path) << two;
  EXPECT_EQ(resolve_colour_map(path.string())->at(1), 0x0000ffu);
  EXPECT_EQ(resolve_colour_map(path.string() + ":second")->at(1), 0xff0000u);
  const auto wrong = resolve_colour_map(path.string() + ":secnd");
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().text.find("did you mean \"second\"?"), std::string::npos) << wrong.error().text;
  EXPECT_NE(wrong.error().text.find(path.string()), std::string::npos) << wrong.error().text;
  EXPECT_FALSE(resolve_colour_map(path.string() + "x"));
  std::filesystem::remove(path);
  EXPECT_FALSE(resolve_colour_map(path.string())) << "is gone";
}

TEST(ColourMapJson, ManyPointsBecomeFewThatLieClose) {
  std::string points;
  for (int n = 0; n < 5000; ++n)
    points += fmt::format("{}{}, {}, {}, {}", n ? ", " : "", n, 0.5 + 0.5 * std::sin(n / 300.0), n / 4999.0, 0.25);
  const auto map = parse_colour_map("{\"RGBPoints\": [" + points + "]}", "m.json");
  ASSERT_TRUE(map) << map.error().text;
  EXPECT_LE(map->stops.size(), kMaxStops);
  EXPECT_LE(to_text(*map).size(), kMaxMapText);
  for (int n = 0; n < 5000; n += 7)
    EXPECT_NEAR(int(map->at(n / 4999.0) >> 16), 255 * (0.5 + 0.5 * std::sin(n / 300.0)), 2.5) << n;
}

TEST(ColourMapJson, RefusesWhatIsNoColourMapWithOneLineThatNamesTheFile) {
  std::string nested;
  for (int n = 0; n < 10000; ++n) nested += "[";
  for (const std::string& content : {
           std::string(),
           std::string("{"),
           std::string("[]"),
           std::string("42"),
           std::string("\xff\xfe\0\0", 4),
           nested,
           std::string(R"({"Name": "x"})"),
           std::string(R"({"RGBPoints": []})"),
           std::string(R"({"RGBPoints": [1, 2, 3]})"),
           std::string(R"({"RGBPoints": [1, 0, 0, "red"]})"),
           std::string(R"({"RGBPoints": [1, 0, 0, 2]})"),
           std::string(R"({"RGBPoints": [1, 0, 0, -0.1]})"),
           std::string(R"({"RGBPoints": [1, 0, 0, 0, 0, 1, 1, 1]})"),
           std::string(R"({"RGBPoints": [1e300, 0, 0, 0]})"),
           std::string(R"({"RGBPoints": [1e999, 0, 0, 0]})"),
           std::string(R"({"RGBPoints": [0, 0, 0, 0], "ColorSpace": "Munsell"})"),
           std::string(R"({"RGBPoints": [0, 0, 0, 0], "ColorSpace": ["\ud800"]})"),
           std::string(R"({"IndexedColors": [1, 0, 0], "RGBPoints": [1, 0, 0, 0]})"),
       }) {
    const auto map = parse_colour_map(content, "map.json");
    ASSERT_FALSE(map) << content.substr(0, 60);
    EXPECT_EQ(map.error().text.find("map.json: "), 0u) << map.error().text;
    EXPECT_EQ(map.error().text.find('\n'), std::string::npos) << map.error().text;
  }
  const auto odd = parse_colour_map(R"({"Name": "a\nb\u0007", "RGBPoints": [0, 0, 0, 0]})", "map.json");
  ASSERT_TRUE(odd) << odd.error().text;
  EXPECT_EQ(odd->name, "a?b?");
}

}  // namespace
}  // namespace telesplat::colour
