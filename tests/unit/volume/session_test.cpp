// The session of a volume scene as parameters and facts.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/volume/session.h"

namespace telesplat::volume {
namespace {

Session sample_session() {
  Session s;
  s.grid.size = {5, 7, 9};
  s.grid.index_to_room = {{0.1, 0.01, 0, 0}, {0, 0, -0.2, 0}, {0, 1.0 / 3, 0, 0}, {-0.4, 0.3, 1e-9, 1}};
  s.levels = {-1024, 1.25, 3000};
  s.range = {-1024, 2800, -300.5, 1100.25, true};
  s.transfer = *parse_transfer("-100:#102030:0, 33.3:0.1/0.2/0.3:0.7", s.range);
  s.lit = false;
  s.steps = 13, s.step = 4, s.steps_per_s = 12.5;
  s.part = 1, s.parts = 3;
  return s;
}

TEST(VolumeSession, ComesBackAsItWas) {
  for (const Session& s : {sample_session(), [] {
                             Session plain;
                             plain.transfer.points = {{0, 1, 1, 1, 1}};
                             return plain;
                           }()}) {
    auto parameters = to_parameters(s);
    auto facts = to_facts(s);
    parameters["packing.something"] = -5;
    facts["scene"] = "x";
    const auto again = read_session(parameters, facts);
    ASSERT_TRUE(again) << again.error().text;
    EXPECT_EQ(*again, s);
  }
}

TEST(VolumeSession, NamesWhatIsMissing) {
  const Session s = sample_session();
  for (const auto& [name, value] : to_parameters(s)) {
    auto parameters = to_parameters(s);
    parameters.erase(name);
    const auto read = read_session(parameters, to_facts(s));
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().text.find(name), std::string::npos) << read.error().text;
  }
  const auto read = read_session(to_parameters(s), {});
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().text.find("transfer"), std::string::npos) << read.error().text;
}

TEST(VolumeSession, RefusesWhatIsBeyondLimits) {
  const Session s = sample_session();
  const std::pair<const char*, double> cases[] = {
      {"volume.size.x", 0},
      {"volume.size.y", kMaxSide + 1},
      {"volume.size.z", 2.5},
      {"volume.m03", 1e12},
      {"volume.levels.step", 0},
      {"volume.levels.count", kMaxLevels + 1},
      {"volume.levels.count", 0},
      {"volume.levels.lo", 1e31},
      {"volume.range.hi", -2000},
      {"volume.range.typical-lo", -1e4},
      {"volume.range.typical-hi", 1e4},
      {"volume.hounsfield", 0.5},
      {"volume.lit", 2},
      {"volume.steps", kMaxSteps + 1},
      {"volume.step", 13},
      {"volume.step", -1},
      {"volume.steps-per-s", -1},
      {"volume.parts", 10},
      {"volume.part", 3},
  };
  for (const auto& [name, value] : cases) {
    auto parameters = to_parameters(s);
    parameters[name] = value;
    const auto read = read_session(parameters, to_facts(s));
    ASSERT_FALSE(read) << name << " = " << value;
    EXPECT_NE(read.error().text.find(name), std::string::npos) << read.error().text;
  }
  for (const auto& [name, value] : to_parameters(s))
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      auto parameters = to_parameters(s);
      parameters[name] = bad;
      EXPECT_FALSE(read_session(parameters, to_facts(s))) << name << " = " << bad;
    }
  auto flat = to_parameters(s);
  for (const char* name : {"volume.m02", "volume.m12", "volume.m22"}) flat[name] = 0;
  EXPECT_FALSE(read_session(flat, to_facts(s)));
  EXPECT_FALSE(read_session(to_parameters(s), {{"transfer", "bone"}}));
}

}  // namespace
}  // namespace telesplat::volume
