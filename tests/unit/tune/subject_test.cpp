// What `telesplat tune` takes a scene and its flags for, before anything runs.
#include "tools/telesplat/tune/subject.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tools/telesplat/tune/model.h"

namespace telesplat::launcher {
namespace {

// Costs that a model can be asked about.
TuneCosts costs_of(const TuneSubject& subject) {
  TuneCosts out = subject.base;
  out.sample_s = 1e-6, out.frame_s = 0.01, out.connect_s = 1e-4;
  return out;
}

TEST(TuneSubject, AnUpdateRateThatNobodyGaveIsThatOfARun) {
  for (const std::vector<std::string>& flags : {std::vector<std::string>{}, std::vector<std::string>{"--update-rate=0"},
                                                std::vector<std::string>{"--coupling=sync"}}) {
    const std::string with = flags.empty() ? "no flags" : flags[0];
    const auto subject = look_at({.scene = "julia", .flags = flags});
    ASSERT_TRUE(subject) << with << ": " << subject.error().text;
    EXPECT_EQ(subject->defaults.update_rate_hz, 20) << with;
    const auto& rates = subject->grid.update_rate_hz;
    ASSERT_FALSE(rates.empty()) << with;
    EXPECT_GT(*std::min_element(rates.begin(), rates.end()), 0) << with;
    for (const TuneSettings& settings : settings_of(subject->grid, subject->defaults))
      EXPECT_GT(predict(costs_of(*subject), settings).updates_per_s, 0) << with << ", " << words(*subject, settings);
    EXPECT_EQ(words(*subject, subject->defaults), "defaults");
  }
}

TEST(TuneSubject, AnUpdateRateThatIsGivenStays) {
  const auto subject = look_at({.scene = "julia", .flags = {"--update-rate=7"}});
  ASSERT_TRUE(subject) << subject.error().text;
  EXPECT_EQ(subject->defaults.update_rate_hz, 7);
  EXPECT_EQ(subject->grid.update_rate_hz, std::vector<double>{7});
}

}  // namespace
}  // namespace telesplat::launcher
