#include "common/scene/colouring.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace telesplat::scene {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

colour::ColourMap two_colours() { return {"two", {{0, 0x000000}, {1, 0xffffff}}, 0x123456}; }

std::vector<ArrayInfo> some_arrays() {
  return {{"temperature", "K", false, 1, {{270, 330}}},
          {"velocity", "m/s", false, 3, {{0, 5}, {-3, 3}, {-4, 4}, {0, 1}}},
          {"a.x", "", true, 1, {{0, 1}}},
          {"nothing", "", true, 1, {{}}}};
}

TEST(Arrays, AreChosenByNameAndComponent) {
  const auto arrays = some_arrays();
  const auto whole = choose_array(arrays, "temperature");
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ(whole->index, 0u);
  EXPECT_EQ(whole->component, -1);
  for (const char* text : {"velocity.y", "velocity[1]"}) {
    const auto part = choose_array(arrays, text);
    ASSERT_TRUE(part.ok()) << text;
    EXPECT_EQ(part->index, 1u);
    EXPECT_EQ(part->component, 1);
    EXPECT_EQ(span_of(arrays, *part), (ValueSpan{-4, 4}));
  }
  const auto length = choose_array(arrays, "velocity");
  EXPECT_EQ(span_of(arrays, *length), (ValueSpan{0, 5}));
  const auto dotted = choose_array(arrays, "a.x");  // an array's own name comes before a component
  EXPECT_EQ(dotted->index, 2u);
}

TEST(Arrays, UnknownOnesAreRefusedWithThoseThereAre) {
  const auto arrays = some_arrays();
  for (const char* text : {"pressure", "velocity[3]", "velocity.w", "velocity.", "", "temperature.y", "velocity[-1]",
                           "velocity[99999999999]", "[0]"})
    EXPECT_FALSE(choose_array(arrays, text).ok()) << text;
  EXPECT_NE(choose_array(arrays, "pressure").error().text.find("temperature, velocity"), std::string::npos);
  EXPECT_NE(choose_array({}, "pressure").error().text.find("no arrays"), std::string::npos);
  EXPECT_FALSE(make_colouring(arrays, {"nothing"}, two_colours()).ok());  // no finite value
}

TEST(Arrays, NamesOfAnyBytesBecomeTellable) {
  std::vector<ArrayInfo> arrays{{"p", "", false, 1, {{0, 1}}},
                                {"p", "", true, 1, {{0, 2}}},
                                {"p", "", false, 1, {{0, 3}}},
                                {"\xff\xfe",
                                 "\xb0"
                                 "C",
                                 false,
                                 1,
                                 {{0, 1}}},
                                {"", "", false, 1, {{0, 1}}},
                                {std::string(5000, 'x'), "", false, 1, {{0, 1}}}};
  make_tellable(arrays);
  EXPECT_EQ(arrays[0].name, "p");
  EXPECT_EQ(arrays[1].name, "p (cell)");
  EXPECT_EQ(arrays[2].name, "p (2)");
  EXPECT_EQ(arrays[3].unit,
            "\xef\xbf\xbd"
            "C");
  EXPECT_EQ(arrays[4].name, "array 5");
  EXPECT_LE(arrays[5].name.size(), kMaxArrayName);
  const auto read = arrays_from_text(to_text(arrays));
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(*read, arrays);
}

TEST(Arrays, AListThatIsTooLongLosesItsEnd) {
  std::vector<ArrayInfo> arrays(1000,
                                {std::string(200, 'x'), "", false, 3, {{0.123456789, 1}, {0, 1}, {0, 1}, {0, 1}}});
  make_tellable(arrays);
  EXPECT_LE(arrays.size(), kMaxArrays);
  const std::string text = to_text(arrays);
  EXPECT_LE(text.size(), kMaxArraysText);
  const auto read = arrays_from_text(text);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(*read, arrays);
}

TEST(Arrays, SpansThatAreFoundLaterHaveRoom) {
  std::vector<ArrayInfo> arrays(kMaxArrays, {std::string(150, 'x'), "", false, 1, {ValueSpan{}}});
  make_tellable(arrays);
  for (ArrayInfo& a : arrays) a.spans[0] = {-1.2345678901234567e-300, 1.2345678901234567e+300};
  arrays[0].histogram = "0:9:4,0,7";
  const auto read = arrays_from_text(to_text(arrays));
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(*read, arrays);
}

TEST(Arrays, NamesDoNotSteerATerminal) {
  std::vector<ArrayInfo> arrays{{"\x1b[2Jheat\n", "K\x7f\xc2\x9b\xc3\xa9", false, 1, {{0, 1}}}};
  make_tellable(arrays);
  EXPECT_EQ(arrays[0].name, "?[2Jheat?");
  EXPECT_EQ(arrays[0].unit, "K??\xc3\xa9");
}

TEST(Arrays, HostileListsAreRefused) {
  EXPECT_TRUE(arrays_from_text("").ok());
  for (const std::string text :
       {"{", "{}", "[1]", "[{}]", R"([{"name":"","unit":"","cells":true,"components":1,"spans":[null]}])",
        R"([{"name":"a","unit":"","cells":true,"components":0,"spans":[null]}])",
        R"([{"name":"a","unit":"","cells":true,"components":1,"spans":[]}])",
        R"([{"name":"a","unit":"","cells":true,"components":1,"spans":[[2,1]]}])",
        R"([{"name":"a","unit":"","cells":true,"components":1,"spans":[[0,1]],"histogram":7}])",
        R"([{"name":"a","unit":"","cells":1,"components":1,"spans":[[0,1]]}])"})
    EXPECT_FALSE(arrays_from_text(text).ok()) << text;
  EXPECT_FALSE(arrays_from_text("[" + std::string(100000, ' ') + "]").ok());
  EXPECT_FALSE(arrays_from_text(std::string(50000, '[')).ok());
}

TEST(ColourBy, ReadsArrayAndRange) {
  EXPECT_EQ(*parse_colour_by("none"), ColourBy{});
  EXPECT_EQ(*parse_colour_by("t"), (ColourBy{"t"}));
  EXPECT_EQ(*parse_colour_by("t:-1.5:2e3"), (ColourBy{"t", true, -1.5, 2e3}));
  EXPECT_EQ(*parse_colour_by("a:b"), (ColourBy{"a:b"}));  // names may have colons
  EXPECT_EQ(*parse_colour_by("a:b:c"), (ColourBy{"a:b:c"}));
  EXPECT_EQ(*parse_colour_by("a:b:0:1"), (ColourBy{"a:b", true, 0, 1}));
  EXPECT_EQ(*parse_colour_by(":0:1"), (ColourBy{":0:1"}));
  for (const char* text : {"t:2:1", "t:1:1", "t:nan:1", "t:0:inf", "t:0:1e999", "t:-1e301:0"})
    EXPECT_FALSE(parse_colour_by(text).ok()) << text;
}

TEST(Colouring, TextReadsBackToTheLastBit) {
  const auto arrays = some_arrays();
  auto c = make_colouring(arrays, {"velocity.x", true, -0.1, 1.0 / 3}, *colour::find_colour_map("viridis"));
  ASSERT_TRUE(c.ok()) << c.error().text;
  EXPECT_EQ(c->unit, "m/s");
  for (const auto& map : {c->map, two_colours()}) {
    c->map = map;
    const auto read = colouring_from_text(to_text(*c));
    ASSERT_TRUE(read.ok()) << read.error().text;
    EXPECT_EQ(*read, *c);
  }
}

TEST(Colouring, HostileTextIsRefused) {
  const std::string good = R"({"array":"a","unit":"","lo":0,"hi":1,"origin":0,"map":"viridis"})";
  ASSERT_TRUE(colouring_from_text(good).ok());
  const auto with = [&](std::string_view what, std::string_view by) {
    std::string text = good;
    return text.replace(text.find(what), what.size(), by);
  };
  for (const std::string& text :
       {std::string(), std::string("[]"), with("\"a\"", "\"\""), with("\"a\"", "7"), with("\"lo\":0", "\"lo\":2"),
        with("\"lo\":0", "\"lo\":1e400"), with("\"hi\":1", "\"hi\":null"), with("viridis", "no such map"),
        with("viridis", "x=0:#00"), with("\"a\"", "\"\xff\""), with("\"a\"", "\"" + std::string(5000, 'a') + "\""),
        std::string(100000, '[')})
    EXPECT_FALSE(colouring_from_text(text).ok()) << text.substr(0, 100);
}

TEST(Colouring, StoredScalarsKeepDatesApart) {
  const ValueSpan dates{1.6e9, 1.6e9 + 100};
  const double origin = scalar_origin(dates);
  EXPECT_FLOAT_EQ(stored_scalar(1.6e9 + 50.25, origin), 50.25f);
  EXPECT_EQ(scalar_origin({-5, 5}), 0);
  EXPECT_EQ(scalar_origin({}), 0);
  EXPECT_EQ(scalar_origin({7, 7}), 7);
  EXPECT_TRUE(std::isnan(stored_scalar(kNan, 0)));
  EXPECT_TRUE(std::isnan(stored_scalar(-kInfinity, 0)));
  EXPECT_TRUE(std::isfinite(stored_scalar(1e300, 0)));
}

TEST(Colouring, TheTableHasTheMapsColours) {
  Colouring c{"a", "", 10, 20, 0, two_colours()};
  const ColourTable table = make_table(c);
  ASSERT_EQ(table.colours.size(), size_t{ColourTable::kEntries} + 1);
  EXPECT_EQ(table.at(10), 0x000000u);
  EXPECT_EQ(table.at(-1e30f), 0x000000u);
  EXPECT_EQ(table.at(20), 0xffffffu);
  EXPECT_EQ(table.at(1e30f), 0xffffffu);
  EXPECT_NEAR(table.at(15) & 255, 127.5, 1);
  EXPECT_EQ(table.at(float(kNan)), 0x123456u);
  c.hi = 10;  // a range of one value: the middle of the map
  EXPECT_NEAR(make_table(c).at(10) & 255, 127.5, 1);
  c = {"dates", "", 1.6e9, 1.6e9 + 100, 1.6e9, two_colours()};
  EXPECT_NEAR(make_table(c).at(stored_scalar(1.6e9 + 50, c.origin)) & 255, 127.5, 1);
  c = {"huge", "", -1e300, 1e300, 0, two_colours()};
  EXPECT_NEAR(make_table(c).at(0) & 255, 127.5, 1);
}

}  // namespace
}  // namespace telesplat::scene
