// Transfer functions: their text, ParaView's files, presets, and colours of levels.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "common/volume/transfer/function.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::volume {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
const ValueRange kBytes{0, 255, 20, 200, false}, kCt{-1024, 3071, -900, 1200, true};

TransferFunction parse_or_fail(std::string_view text, const ValueRange& range = kBytes) {
  auto parsed = parse_transfer(text, range);
  EXPECT_TRUE(parsed) << parsed.error().text;
  return parsed ? *parsed : TransferFunction{{{}}};
}

TEST(VolumeTransfer, IsLinearBetweenPointsAndJumpsWhereTwoShareAValue) {
  const auto f = parse_or_fail("10:#000000:0, 20:#ff0000:0.5, 20:#0000ff:1, 40:#0000ff:0");
  EXPECT_EQ(f.at(-5).opacity, 0);
  EXPECT_FLOAT_EQ(f.at(15).opacity, 0.25f);
  EXPECT_FLOAT_EQ(f.at(15).r, 0.5f);
  EXPECT_NEAR(f.at(20 - 1e-9).opacity, 0.5, 1e-6);
  EXPECT_EQ(f.at(20).opacity, 1);
  EXPECT_EQ(f.at(20).b, 1);
  EXPECT_FLOAT_EQ(f.at(30).opacity, 0.5f);
  EXPECT_EQ(f.at(1e9).opacity, 0);
  EXPECT_EQ(f.at(kNan).opacity, 0);
  EXPECT_EQ(f.at(30).value, 30);
}

TEST(VolumeTransfer, PercentagesAreOfTheRange) {
  const auto f = parse_or_fail(" 0% :#102030: 0 ,50%:1/0.5/0:0.25,\n100%:#ffffff:1", kCt);
  ASSERT_EQ(f.points.size(), 3u);
  EXPECT_EQ(f.points[0].value, -1024);
  EXPECT_EQ(f.points[1].value, -1024 + 4095 * 0.5);
  EXPECT_EQ(f.points[2].value, 3071);
  EXPECT_EQ(f.points[1].g, 0.5f);
  EXPECT_EQ(f.points[0].r, 16 / 255.0f);
}

TEST(VolumeTransfer, TextKeepsEveryBit) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int round = 0; round < 300; ++round) {
    TransferFunction f;
    double value = std::ldexp(unit(random) - 0.5, int(random() % 60) - 30);
    for (size_t n = 1 + random() % 40; n-- > 0; value += random() % 4 ? std::abs(value) * unit(random) : 0) {
      const bool bytes = random() % 2;
      const auto channel = [&] { return bytes ? float(random() % 256) / 255.0f : unit(random); };
      f.points.push_back({value, channel(), channel(), channel(), unit(random)});
    }
    const std::string text = to_text(f);
    const auto again = parse_transfer(text, kBytes);
    ASSERT_TRUE(again) << again.error().text;
    ASSERT_EQ(*again, f) << text;
    ASSERT_EQ(to_text(*again), text);
  }
  EXPECT_EQ(to_text(parse_or_fail("80:#ff8800:0.1")), "80:#ff8800:0.1");
}

TEST(VolumeTransfer, RefusalsNameWhatIsWrong) {
  const std::pair<std::string, std::string> cases[] = {
      {"", "empty"},
      {"10:#ffffff", "10:#ffffff"},
      {"10:#ffffff:1:2", "value:colour:opacity"},
      {"ten:#ffffff:1", "\"ten\""},
      {"nan:#ffffff:1", "\"nan\""},
      {"1e31:#ffffff:1", "1e+31"},
      {"1:#fffff:1", "\"#fffff\""},
      {"1:#fffffg:1", "\"#fffffg\""},
      {"1:0.5/0.5:1", "\"0.5/0.5\""},
      {"1:0.5/0.5/2:1", "0.5/0.5/2"},
      {"1:#ffffff:1.5", "1.5"},
      {"1:#ffffff:-0.1", "-0.1"},
      {"1:#ffffff:", "opacity"},
      {"5:#ffffff:1, 4:#ffffff:1", "ascend"},
      {"1:#ffffff:1,,2:#ffffff:1", "value:colour:opacity"},
      {std::string(kMaxTransferText + 1, '1'), fmt::format("{}", kMaxTransferText)},
  };
  for (const auto& [text, names] : cases) {
    const auto parsed = parse_transfer(text, kBytes);
    ASSERT_FALSE(parsed) << text;
    EXPECT_NE(parsed.error().text.find(names), std::string::npos) << text << ": " << parsed.error().text;
  }
  EXPECT_FALSE(validate(TransferFunction{}));
  EXPECT_FALSE(validate(TransferFunction{{{kInfinity}}}));
  EXPECT_FALSE(validate(TransferFunction{{{0, 1, 1, 1, float(kNan)}}}));
  EXPECT_FALSE(validate(TransferFunction{std::vector<TransferFunction::Point>(kMaxTransferPoints + 1)}));
}

TEST(VolumeTransfer, PresetsAreValidFitTheDataAndTravel) {
  ASSERT_GE(transfer_presets().size(), 5u);
  for (const std::string_view name : {"bone", "skin", "ct-angio", "mr", "fire"})
    EXPECT_TRUE(transfer_preset(name, kCt)) << name;
  for (const auto& preset : transfer_presets())
    for (const ValueRange& range : {kBytes, kCt, ValueRange{5, 5, 5, 5}, ValueRange{-1e30, 1e30, -1e30, 1e30}}) {
      const auto f = transfer_preset(preset.name, range);
      ASSERT_TRUE(f) << preset.name;
      const Status valid = validate(*f);
      EXPECT_TRUE(valid) << preset.name << ": " << (valid ? "" : valid.error().text);
      EXPECT_EQ(*parse_transfer(to_text(*f), range), *f) << preset.name;
      EXPECT_LT(to_text(*f).size(), kMaxTransferText);
      EXPECT_FALSE(preset.text.empty());
      // Values below the data's typical range are background.
      EXPECT_TRUE(!(range == kBytes) || f->at(range.typical_lo).opacity == 0) << preset.name;
    }
  // Air, flesh and bone of a CT.
  EXPECT_EQ(transfer_preset("bone", kCt)->at(40).opacity, 0);
  EXPECT_GT(transfer_preset("bone", kCt)->at(900).opacity, 0.5);
  EXPECT_EQ(transfer_preset("skin", kCt)->at(-900).opacity, 0);
  EXPECT_GT(transfer_preset("skin", kCt)->at(40).opacity, 0);
  for (const auto& range : {kBytes, kCt}) EXPECT_TRUE(transfer_preset(fitting_preset(range), range));
  const auto none = transfer_preset("bones", kBytes);
  ASSERT_FALSE(none);
  for (const auto& preset : transfer_presets())
    EXPECT_NE(none.error().text.find(preset.name), std::string::npos) << none.error().text;
}

TEST(VolumeTransfer, ResolvesNamesPointsAndFiles) {
  EXPECT_EQ(*resolve_transfer("fire", kBytes), *transfer_preset("fire", kBytes));
  EXPECT_EQ(*resolve_transfer("0:#ffffff:1", kBytes), parse_or_fail("0:#ffffff:1"));
  const auto path = std::filesystem::path(tests::own_folder()) / fmt::format("transfer-{}.json", getpid());
  std::ofstream(path) << R"({"RGBPoints": [0, 0, 0, 0, 255, 1, 1, 1]})";
  const auto f = resolve_transfer(path.string(), kBytes);
  std::filesystem::remove(path);
  ASSERT_TRUE(f) << f.error().text;
  EXPECT_EQ(f->points.size(), 2u);
  const auto missing = resolve_transfer("/nowhere/map.json", kBytes);
  ASSERT_FALSE(missing);
  EXPECT_NE(missing.error().text.find("/nowhere/map.json"), std::string::npos);
}

TEST(VolumeParaview, ReadsColoursAndOpacitiesTogether) {
  const auto f = parse_paraview_json(
      R"([{"Name": "m", "ColorSpace": "RGB", "RGBPoints": [10, 0, 0, 0, 110, 1, 0, 0],
           "Points": [0, 0, 0.5, 0, 60, 0.4, 0.5, 0, 110, 0.8, 0.5, 0]}, {"Name": "other"}])",
      "m.json", kBytes);
  ASSERT_TRUE(f) << f.error().text;
  EXPECT_NEAR(f->at(60).r, 0.5, 1 / 255.0);
  EXPECT_NEAR(f->at(60).opacity, 0.4, 1e-5);
  EXPECT_NEAR(f->at(30).opacity, 0.2, 1e-4);
  EXPECT_NEAR(f->at(5).r, 0, 1e-6);
}

TEST(VolumeParaview, StretchesNormalisedMapsAndMakesOpacityWhereThereIsNone) {
  const auto f = parse_paraview_json(R"({"RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0]})", "m.json", kCt);
  ASSERT_TRUE(f) << f.error().text;
  EXPECT_EQ(f->points.front().value, -1024);
  EXPECT_EQ(f->points.back().value, 3071);
  EXPECT_EQ(f->points.front().opacity, 0);
  EXPECT_EQ(f->points.back().opacity, 1);
  const auto old = parse_paraview_json(R"({"RGBPoints": [-1, 0, 0, 1, 1, 1, 0, 0]})", "m.json", kBytes);
  EXPECT_EQ(old->points.front().value, 0);
  const auto unit =
      parse_paraview_json(R"({"RGBPoints": [0, 0, 0, 1, 1, 1, 0, 0]})", "m.json", ValueRange{0, 1.5, 0, 1});
  EXPECT_EQ(unit->points.back().value, 1) << "such values the data have";
}

TEST(VolumeParaview, HonoursMidpointsAndSharpness) {
  const auto read = [](const std::string& points) {
    const auto f =
        parse_paraview_json(R"({"RGBPoints": [0, 1, 1, 1, 100, 1, 1, 1], "Points": )" + points + "}", "m.json", kBytes);
    EXPECT_TRUE(f);
    return *f;
  };
  const auto bent = read("[0, 0, 0.25, 0, 100, 1, 0.5, 0]");
  EXPECT_NEAR(bent.at(25).opacity, 0.5, 1e-4);
  EXPECT_NEAR(bent.at(12.5).opacity, 0.25, 1e-4);
  const auto step = read("[0, 0, 0.25, 1, 100, 1, 0.5, 0]");
  EXPECT_EQ(step.at(24).opacity, 0);
  EXPECT_EQ(step.at(26).opacity, 1);
  const auto smooth = read("[0, 0, 0.5, 0.5, 100, 1, 0.5, 0]");
  EXPECT_NEAR(smooth.at(50).opacity, 0.5, 1e-4);
  EXPECT_LT(smooth.at(25).opacity, 0.1);
  for (double v = 1; v <= 100; ++v) EXPECT_GE(smooth.at(v).opacity, smooth.at(v - 1).opacity) << v;
}

TEST(VolumeParaview, ShortensLongMapsLittle) {
  std::string points;
  const auto shape = [](double t) { return 0.5 + 0.5 * std::sin(6 * t); };
  for (int n = 0; n < 1024; ++n)
    points += fmt::format("{}{}, {}, {}, {}", n ? ", " : "", n / 7.0, shape(n / 1023.0), n / 1023.0, 1 - n / 1023.0);
  const auto f = parse_paraview_json("{\"RGBPoints\": [" + points + "]}", "m.json", kBytes);
  ASSERT_TRUE(f) << f.error().text;
  EXPECT_LE(to_text(*f).size(), kMaxTransferText);
  EXPECT_GT(f->points.size(), 20u);
  for (int n = 0; n < 1024; ++n) EXPECT_NEAR(f->at(n / 7.0).r, shape(n / 1023.0), 0.01) << n;
}

TEST(VolumeParaview, RefusesWhatIsNoColourMap) {
  std::string nested = "[";
  for (int n = 0; n < 10000; ++n) nested += "[";
  for (const std::string& content :
       {std::string(), std::string("{"), std::string("[]"), std::string("42"), nested, std::string(R"({"Name": "x"})"),
        std::string(R"({"RGBPoints": 5})"), std::string(R"({"RGBPoints": []})"),
        std::string(R"({"RGBPoints": [1, 2, 3]})"), std::string(R"({"RGBPoints": [1, 0, 0, "red"]})"),
        std::string(R"({"RGBPoints": [1, 0, 0, 2]})"), std::string(R"({"RGBPoints": [1, 0, 0, 0, 0, 1, 1, 1]})"),
        std::string(R"({"RGBPoints": [1e300, 0, 0, 0]})"),
        std::string(R"({"RGBPoints": [1, 0, 0, 0], "Points": [0, 2, 0.5, 0]})"),
        std::string(R"({"IndexedColors": [1, 0, 0], "RGBPoints": [1, 0, 0, 0]})")}) {
    const auto f = parse_paraview_json(content, "map.json", kBytes);
    ASSERT_FALSE(f) << content.substr(0, 60);
    EXPECT_NE(f.error().text.find("map.json"), std::string::npos) << f.error().text;
  }
}

TEST(VolumeTransfer, LevelsGetExtinctionsOfAUnitsOpacity) {
  const Levels levels{-10, 0.5, 100};
  const auto f = parse_or_fail("0:#000000:0, 20:#ff0000:1");
  const auto colours = level_colours(f, levels);
  ASSERT_EQ(colours.size(), 100u);
  for (int l = 0; l < 100; ++l) {
    const float opacity = f.at(levels.value(l)).opacity;
    if (opacity < kLeastOpacity)
      EXPECT_EQ(colours[size_t(l)].extinction, 0) << l;
    else
      EXPECT_NEAR(1 - std::exp(-colours[size_t(l)].extinction), std::min(opacity, kMaxOpacity), 1e-6) << l;
  }
  EXPECT_EQ(level_colours(parse_or_fail("0:#ffffff:1"), levels)[5].extinction, -std::log1p(-kMaxOpacity));
}

}  // namespace
}  // namespace telesplat::volume
