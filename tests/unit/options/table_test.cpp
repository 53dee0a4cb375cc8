#include "common/options/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

namespace telesplat::options {
namespace {

struct Settings {
  bool cache = true, exr = false, lit = true;
  int threads = 4;
  uint64_t frames = 0;
  double scale = 1.5;
  std::string up = "auto", texture;
  std::optional<double> iso;
  std::optional<int> memory_mb;
  std::vector<std::string> files;
  int hidden = 0;
};

Table table(Settings& s) {
  const scene::Kinds volumes{scene::Kind::kVolume};
  return {
      {.flag = "!--no-cache", .value = &s.cache, .help = "keep no store"},
      {.flag = "--exr", .value = &s.exr, .help = "record EXR", .reach = Reach::kRecorded},
      {.flag = "--lighting",
       .value = &s.lit,
       .help = "shade",
       .fits = volumes,
       .reach = Reach::kRecorded,
       .on_off = true},
      {.flag = "--threads,--cores", .value = &s.threads, .help = "threads", .limits = Range{0, 1024}},
      {.flag = "--frames", .value = &s.frames, .help = "frames"},
      {.flag = "--z-scale", .value = &s.scale, .help = "factor", .limits = Range{-10, 10}, .reach = Reach::kRecorded},
      {.flag = "--up",
       .value = &s.up,
       .help = "axis",
       .limits = Names{"auto", "x", "-z"},
       .fits = scene::Kinds::of(scene::Pipeline::kPoints)},
      {.flag = "--texture", .value = &s.texture, .help = "image", .reach = Reach::kRecorded, .is_file = true},
      {.flag = "--iso", .value = &s.iso, .help = "value", .reach = Reach::kRecorded},
      {.flag = "--memory", .value = &s.memory_mb, .help = "MB"},
      {.flag = "files", .value = &s.files, .help = "files"},
      {.flag = "--hidden", .value = &s.hidden, .help = "not told", .reach = Reach::kHere},
  };
}

std::vector<std::string> difference(Settings& s) {
  Settings usual;
  return arguments(table(s), table(usual));
}

TEST(OptionTable, ChildrenAreToldOnlyWhatDiffers) {
  Settings s;
  EXPECT_EQ(difference(s), std::vector<std::string>{});
  s.cache = false, s.exr = true, s.lit = false, s.threads = 2, s.frames = 1ull << 40, s.scale = -0.1, s.up = "-z";
  s.iso = 0.0, s.memory_mb = 16, s.files = {"a b", "c"}, s.hidden = 9;
  EXPECT_EQ(difference(s),
            (std::vector<std::string>{"--no-cache", "--exr", "--lighting=off", "--threads=2", "--frames=1099511627776",
                                      "--z-scale=-0.1", "--up=-z", "--iso=0", "--memory=16", "a b,c"}));
}

TEST(OptionTable, NumbersSurviveTheWayThroughText) {
  Settings from, to;
  from.scale = 0.1 + 0.2, from.iso = 1.0 / 3;
  for (const Row& row : table(from)) {
    const Table target = table(to);
    const Row* same = find(target, name_of(row));
    ASSERT_TRUE(same);
    if (name_of(row) == "--z-scale" || name_of(row) == "--iso") {
      EXPECT_TRUE(set(*same, text_of(row)));
    }
  }
  EXPECT_EQ(to.scale, from.scale);
  EXPECT_EQ(to.iso, from.iso);
}

TEST(OptionTable, RefusalsNameFlagValueAndLimit) {
  Settings s;
  const Table t = table(s);
  const auto why = [&](const char* flag, const char* text) {
    const Status status = set(*find(t, flag), text);
    return status ? std::string() : status.error().text;
  };
  EXPECT_EQ(why("--threads", "-1"), "--threads -1: is not between 0 and 1024");
  EXPECT_EQ(why("--threads", "1e3"), "--threads 1e3: is not a whole number");
  EXPECT_EQ(why("--threads", "x"), "--threads x: is not a whole number");
  EXPECT_EQ(why("--frames", "-1"), "--frames -1: is not a whole number of 0 or more");
  EXPECT_EQ(why("--z-scale", "nan"), "--z-scale nan: is not between -10 and 10");
  EXPECT_EQ(why("--z-scale", "inf"), "--z-scale inf: is not between -10 and 10");
  EXPECT_EQ(why("--z-scale", ""), "--z-scale \"\": is not a number");
  EXPECT_EQ(why("--z-scale", "1x"), "--z-scale 1x: is not a number");
  EXPECT_EQ(why("--up", "y"), "--up y: is not one of auto, x, -z");
  EXPECT_EQ(why("--up", "autu"), "--up autu: is not one of auto, x, -z; did you mean auto?");
  EXPECT_EQ(why("--frames", "99999999999999999999"),
            "--frames 99999999999999999999: is too large or too small a number");
  EXPECT_EQ(why("--iso", "nan"), "--iso nan: is not a finite number");
  EXPECT_EQ(why("--iso", "-inf"), "--iso -inf: is not a finite number");
  EXPECT_EQ(why("--lighting", "yes"), "--lighting yes: is neither on nor off");
  EXPECT_EQ(s.threads, 4);
  EXPECT_EQ(s.scale, 1.5);
}

TEST(OptionTable, ACheckLeavesTheValueAsItIs) {
  Settings s;
  const Table t = table(s);
  EXPECT_TRUE(check(*find(t, "--threads"), "7"));
  EXPECT_TRUE(check(*find(t, "--iso"), "7"));
  EXPECT_EQ(check(*find(t, "--threads"), "-7").error().text, "--threads -7: is not between 0 and 1024");
  EXPECT_EQ(s.threads, 4);
  EXPECT_FALSE(s.iso);
}

TEST(OptionTable, NumbersAreWrittenAsPeopleDo) {
  EXPECT_EQ(number_text(1e6), "1000000");
  EXPECT_EQ(number_text(1e-5), "0.00001");
  EXPECT_EQ(number_text(-0.5), "-0.5");
  EXPECT_EQ(number_text(1e12), "1000000000000");
}

TEST(OptionTable, ValuesAreTakenAsWritten) {
  Settings s;
  const Table t = table(s);
  EXPECT_TRUE(set(*find(t, "--cores"), "7"));
  EXPECT_TRUE(set(*find(t, "--no-cache"), "true"));
  EXPECT_TRUE(set(*find(t, "--lighting"), "off"));
  EXPECT_TRUE(set(*find(t, "--z-scale"), "+2"));
  EXPECT_EQ(s.threads, 7);
  EXPECT_FALSE(s.cache);
  EXPECT_FALSE(s.lit);
  EXPECT_EQ(s.scale, 2);
  EXPECT_EQ(find(t, "--nothing"), nullptr);
}

TEST(OptionTable, KeysAreFlagsWithUnderscores) {
  Settings s;
  const Table t = table(s);
  EXPECT_EQ(key_of(*find(t, "--z-scale")), "z_scale");
  EXPECT_EQ(key_of(*find(t, "--no-cache")), "no_cache");
  EXPECT_EQ(key_of(*find(t, "--threads")), "threads");
}

TEST(OptionTable, TheRecordHoldsWhatDiffers) {
  Settings s, usual;
  s.exr = true, s.lit = false, s.scale = 3, s.texture = "no \"such\" file\n", s.iso = 40, s.threads = 1;
  EXPECT_EQ(recorded(table(s), table(usual)),
            "exr = true\nlighting = \"off\"\nz_scale = 3\ntexture = \"no \\\"such\\\" file \"\niso = 40\n");
}

TEST(OptionTable, WhatDoesNotFitTheSceneIsRefused) {
  Settings s;
  const Table t = table(s);
  EXPECT_TRUE(refuse_misfits(t, {"--threads", "--up"}, scene::Kind::kMesh, "a.ply"));
  const Status tf = refuse_misfits(t, {"--threads", "--lighting"}, scene::Kind::kMesh, "a.ply");
  ASSERT_FALSE(tf);
  EXPECT_EQ(tf.error().text, "--lighting: a.ply is a mesh; only volumes have --lighting");
  const Status up = refuse_misfits(t, {"--up"}, scene::Kind::kVolume, "a.nii");
  ASSERT_FALSE(up);
  EXPECT_EQ(up.error().text, "--up: a.nii is a volume, which is not drawn from points");
}

TEST(OptionTable, TablesAreJoinedAndCut) {
  Settings a, b;
  EXPECT_EQ(joined(table(a), table(b)).size(), 24u);
  const Table cut = without(table(a), {"--threads", "--no-cache"});
  EXPECT_EQ(cut.size(), 10u);
  EXPECT_EQ(find(cut, "--cores"), nullptr);
}

}  // namespace
}  // namespace telesplat::options
