// The master's flags, and its socket's limits of messages.
#include "services/master/master_options.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "services/master/guarded.h"

namespace telesplat::master {
namespace {

Status give(MasterServiceOptions& o, const std::string& flag, const std::string& text) {
  const auto t = table(o);
  const options::Row* row = options::find(t, flag);
  return row ? options::set(*row, text) : Status(Error{"no such flag"});
}

TEST(MasterFlags, ChangeNothingUnlessTheyAreGiven) {
  MasterServiceOptions o;
  table(o);
  EXPECT_EQ(o.master.settings, wire::SessionSettings{});
  EXPECT_EQ(o.master.progressive, Progressive::kAuto);
}

TEST(MasterFlags, ErrorsAreFractionsNumbersAutoOrOff) {
  MasterServiceOptions o;
  const auto text = [&](const std::string& flag) {
    const auto t = table(o);
    return options::text_of(*options::find(t, flag));
  };
  EXPECT_EQ(text("--depth-error"), "auto");
  EXPECT_TRUE(give(o, "--depth-error", "1/32"));
  EXPECT_EQ(o.master.settings.errors.depth, 1.0 / 32);
  EXPECT_EQ(text("--depth-error"), "0.03125") << "as children are told it";
  EXPECT_TRUE(give(o, "--depth-error", "off"));
  EXPECT_EQ(o.master.settings.errors.depth, 0);
  EXPECT_TRUE(give(o, "--depth-error", "auto"));
  EXPECT_EQ(o.master.settings.errors.depth, -1);
  EXPECT_TRUE(give(o, "--normal-error", "3"));
  EXPECT_TRUE(give(o, "--colour-error", "15"));
  for (const char* bad : {"-1", "1/0", "1/", "/32", "1/-32", "1.5", "nan", "inf", "1 /32", "", "on"})
    EXPECT_FALSE(give(o, "--depth-error", bad)) << bad;
  for (const char* bad : {"4", "0.5", "1/2", "-1", "nan"}) EXPECT_FALSE(give(o, "--normal-error", bad)) << bad;
  EXPECT_FALSE(give(o, "--colour-error", "16"));
}

TEST(MasterFlags, AreRead) {
  MasterServiceOptions o;
  EXPECT_TRUE(give(o, "--layers", "4"));
  EXPECT_EQ(o.master.settings.layers, 4u);
  EXPECT_TRUE(give(o, "--packing.redundancy", "keep"));
  EXPECT_TRUE(o.master.settings.keep_redundant);
  EXPECT_TRUE(give(o, "--packing.redundancy", "eliminate"));
  EXPECT_FALSE(o.master.settings.keep_redundant);
  EXPECT_TRUE(give(o, "--progressive", "off"));
  EXPECT_EQ(o.master.progressive, Progressive::kOff);
  EXPECT_TRUE(give(o, "--packing.max_points", "1e6"));
  EXPECT_EQ(o.master.settings.max_points, 1'000'000u);
  EXPECT_TRUE(give(o, "--steering", "off"));
  EXPECT_FALSE(o.master.settings.steering);
  EXPECT_TRUE(give(o, "--view-cell", "0"));
  EXPECT_TRUE(give(o, "--validation", "64"));
  EXPECT_TRUE(give(o, "--still-rays", "1"));
  EXPECT_EQ(o.master.settings.view_cell_m, 0);
  EXPECT_EQ(o.master.settings.validation, 64u);
  EXPECT_EQ(o.master.settings.still_rays, 1u);
  EXPECT_FALSE(o.master.settings.pictures);
  EXPECT_TRUE(give(o, "--images", "head"));
  EXPECT_TRUE(give(o, "--image-background", "#102030"));
  EXPECT_TRUE(o.master.settings.pictures);
  EXPECT_EQ(o.master.settings.picture_shading, 1u);
  EXPECT_EQ(o.master.settings.picture_background, 0x102030u);
  EXPECT_FALSE(give(o, "--image-background", "transparent"));
  EXPECT_TRUE(give(o, "--tile-size", "64"));
  EXPECT_EQ(o.master.schedule.tile_size, 64);
  EXPECT_TRUE(give(o, "--octree-depth", "6"));
  EXPECT_EQ(o.master.octree_depth, 6u);
}

TEST(MasterFlags, HaveLimits) {
  MasterServiceOptions o;
  for (const auto& [flag, text] : std::vector<std::pair<std::string, std::string>>{{"--tile-size", "15"},
                                                                                   {"--progressive", "maybe"},
                                                                                   {"--octree-depth", "11"},
                                                                                   {"--layers", "0"},
                                                                                   {"--packing.max_points", "-1"},
                                                                                   {"--packing.max_points", "nan"},
                                                                                   {"--packing.max_points", "many"},
                                                                                   {"--steering", "1"},
                                                                                   {"--view-cell", "-0.1"},
                                                                                   {"--view-cell", "11"},
                                                                                   {"--validation", "4097"},
                                                                                   {"--still-rays", "0"},
                                                                                   {"--still-rays", "1e9"},
                                                                                   {"--packing.redundancy", "2"}}) {
    const Status s = give(o, flag, text);
    ASSERT_FALSE(s) << flag << " " << text;
    EXPECT_NE(s.error().text.find(flag), std::string::npos) << s.error().text;
  }
  EXPECT_EQ(o.master.settings, wire::SessionSettings{});
}

TEST(MasterFlags, OnlyWhatWasGivenIsHandedOn) {
  MasterServiceOptions o, usual;
  EXPECT_TRUE(options::arguments(session_table(o), session_table(usual)).empty());
  ASSERT_TRUE(give(o, "--packing.max_points", "3e6"));
  ASSERT_TRUE(give(o, "--packing.redundancy", "keep"));
  ASSERT_TRUE(give(o, "--layers", "4"));
  EXPECT_EQ(options::arguments(session_table(o), session_table(usual)),
            (std::vector<std::string>{"--layers=4", "--packing.max_points=3000000", "--packing.redundancy=keep"}));
}

TEST(MasterSocket, AMessageWhoseHandlingThrowsIsCountedAndTheNextIsHandled) {
  net::Context context;
  net::Socket control(context, net::Kind::kRouter, "master");
  net::Message message;
  message.peer = "someone";
  message.type = "control";
  int handled = 0;
  for (int i = 0; i < 3; ++i)
    guarded(control, message, [&] {
      if (i == 1) throw std::runtime_error("what it was");
      ++handled;
    });
  EXPECT_EQ(handled, 2);
  EXPECT_EQ(control.rejected(), 1u);
}

}  // namespace
}  // namespace telesplat::master
