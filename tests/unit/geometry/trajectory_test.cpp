#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/geometry/trajectory.h"

namespace telesplat::geometry {
namespace {

constexpr const char* kHeader = "t_s,px,py,pz,qw,qx,qy,qz\n";

Result<Trajectory> read(const std::string& text) {
  const auto path =
      std::filesystem::temp_directory_path() /
      (std::string("telesplat-trajectory-") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv");
  std::ofstream(path) << text;
  auto result = Trajectory::read_csv(path.string());
  std::filesystem::remove(path);
  return result;
}

TEST(Trajectory, InterpolatesBetweenSamplesAndHoldsBeyondThem) {
  const auto t = read(std::string(kHeader) + "10,0,0,0,1,0,0,0\r\n12,1,2,3,0.7071068,0,0.7071068,0\n");
  ASSERT_TRUE(t.ok()) << t.error().text;
  EXPECT_DOUBLE_EQ(t->duration_s(), 2);
  EXPECT_NEAR(t->at(1).position_room.y, 1, 1e-9);
  EXPECT_NEAR(glm::angle(t->at(1).orientation), 3.14159265 / 4, 1e-5);  // half of 90 degrees
  EXPECT_NEAR(t->at(-5).position_room.x, 0, 1e-12);
  EXPECT_NEAR(t->at(50).position_room.z, 3, 1e-12);
}

TEST(Trajectory, NamesTheLineThatIsWrong) {
  const std::string good = "0,0,0,0,1,0,0,0\n";
  for (const auto& [bad, why] : {std::pair{"1,0,0,0,1,0,0", "seven numbers"},
                                 {"1,0,0,0,1,0,0,0,0", "nine numbers"},
                                 {"1,0,x,0,1,0,0,0", "a word"},
                                 {"1,0,nan,0,1,0,0,0", "not a number"},
                                 {"1,0,0,0,0,0,0,0", "no rotation"},
                                 {"0,0,0,0,1,0,0,0", "time stands still"}}) {
    const auto t = read(kHeader + good + bad + "\n");
    ASSERT_FALSE(t.ok()) << why;
    EXPECT_NE(t.error().text.find(".csv:3:"), std::string::npos) << t.error().text;
  }
}

TEST(Trajectory, RefusesFilesThatAreNone) {
  EXPECT_FALSE(read("").ok());
  EXPECT_FALSE(read("time,x\n0,0\n").ok());
  EXPECT_FALSE(read(kHeader).ok());
  EXPECT_FALSE(Trajectory::read_csv("/nonexistent/trajectory.csv").ok());
  EXPECT_FALSE(Trajectory::read_csv("/").ok());
}

TEST(Trajectory, AnOrbitLooksAtTheOriginAllTheWayRound) {
  const Trajectory orbit = Trajectory::orbit(0.75, 0.35, 20);
  for (double t = 0; t < 60; t += 1.7) {
    const Pose p = orbit.at(t);
    EXPECT_NEAR(std::hypot(p.position_room.x, p.position_room.z), 0.75, 1e-9);
    const glm::dvec3 forward = p.orientation * glm::dvec3(0, 0, -1);
    EXPECT_NEAR(glm::distance(forward, glm::normalize(-p.position_room)), 0, 1e-9);
  }
  EXPECT_NEAR(glm::distance(orbit.at(0).position_room, orbit.at(20).position_room), 0, 1e-9);
}

}  // namespace
}  // namespace telesplat::geometry
