// A sampler's options: limits, which sampler fits which scene, arguments for a child process.
#include <gtest/gtest.h>

#include "services/sampler/sampler_options.h"

namespace telesplat::sampler {
namespace {

TEST(SamplerOptions, AChildIsToldWhatDiffers) {
  SamplerOptions options, defaults;
  EXPECT_TRUE(options::arguments(table(options), table(defaults)).empty());
  options.service.name = "sampler-1";  // the starter passes the name itself
  options.kind = "ray";
  options.threads = 3;
  EXPECT_EQ(options::arguments(table(options), table(defaults)),
            (std::vector<std::string>{"--sampler=ray", "--threads=3"}));
}

TEST(SamplerOptions, ValuesBeyondTheirLimitsAreRefused) {
  SamplerOptions options;
  const options::Table rows = table(options);
  for (const auto& [flag, value] : {std::pair{"--threads", "1025"}, {"--sampler", "gpu"}, {"--sampler-memory", "-1"}})
    EXPECT_FALSE(options::set(*options::find(rows, flag), value).ok()) << flag;
  ASSERT_TRUE(options::set(*options::find(rows, "--sampler-memory"), "512").ok());
  EXPECT_EQ(options.memory_mb, 512);
}

TEST(SamplerOptions, OnlyWhatTravelsAsPointsHasAMeshSampler) {
  SamplerOptions options;
  EXPECT_TRUE(options::refuse_misfits(table(options), {"--sampler"}, scene::Kind::kMesh, "a.ply").ok());
  EXPECT_FALSE(options::refuse_misfits(table(options), {"--sampler"}, scene::Kind::kVolume, "a.nii").ok());
}

}  // namespace
}  // namespace telesplat::sampler
