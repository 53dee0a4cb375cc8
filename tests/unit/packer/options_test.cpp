// Options of a packer: limits, flags that fit a scene, arguments for another process.
#include <gtest/gtest.h>

#include "services/packer/packer_options.h"

namespace telesplat::packer {
namespace {

TEST(PackerOptions, AChildIsToldWhatDiffers) {
  PackerOptions options, defaults;
  EXPECT_EQ(options.service.name, net::unique_name("packer")) << "two of one name would take turns";
  EXPECT_TRUE(options::arguments(table(options), table(defaults)).empty());
  options.record_depth = "run/depth";
  options.log_limit_mb = 64;
  EXPECT_EQ(options::arguments(table(options), table(defaults)),
            (std::vector<std::string>{"--record-depth=run/depth", "--log-limit-mb=64"}));
}

TEST(PackerPorts, AreNeighbours) {
  EXPECT_EQ(*bind_of("tcp://*:7701", 0), "tcp://*:7701");
  EXPECT_EQ(*bind_of("tcp://*:7701", 2), "tcp://*:7703");
  EXPECT_EQ(*bind_of("tcp://[::1]:65533", 2), "tcp://[::1]:65535");
  EXPECT_EQ(*bind_of("tcp://127.0.0.1:*", 2), "tcp://127.0.0.1:*");
  EXPECT_EQ(*bind_of("tcp://127.0.0.1:0", 2), "tcp://127.0.0.1:0");
  EXPECT_EQ(*bind_of("ipc:///run/telesplat", 2), "ipc:///run/telesplat");
  const auto beyond = bind_of("tcp://*:65534", 2);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().text, "tcp://*:65534: its 3 ports end at 65535");
}

TEST(PackerOptions, ValuesBeyondTheirLimitsAreRefused) {
  PackerOptions options;
  const options::Table rows = table(options);
  for (const auto& [flag, value] :
       {std::pair{"--threads", "1025"}, {"--answer-window-mb", "0"}, {"--log-limit-mb", "0.5"}})
    EXPECT_FALSE(options::set(*options::find(rows, flag), value).ok()) << flag;
  EXPECT_FALSE(options::refuse_misfits(rows, {"--record-depth"}, scene::Kind::kVolume, "a.nii").ok());
}

}  // namespace
}  // namespace telesplat::packer
