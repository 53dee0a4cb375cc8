#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/geometry/trajectory.h"
#include "tests/support/files/own_folder.h"

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
  EXPECT_FALSE(Trajectory::read_csv("/").ok());
  const auto misspelt = Trajectory::read_csv("orbitt");
  ASSERT_FALSE(misspelt.ok());
  EXPECT_EQ(misspelt.error().text,
            "orbitt: no such file (orbit and still are built in; else a CSV file with the columns t_s, px, py, pz, qw, "
            "qx, qy, qz)");
  const auto header = read("t_s,px,py,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n");
  ASSERT_FALSE(header.ok());
  EXPECT_NE(header.error().text.find(":1: no column pz in the header \"t_s,px,py,z,qw,qx,qy,qz\""), std::string::npos)
      << header.error().text;
  EXPECT_NE(read(std::string(70000, 'x')).error().text.find("cannot be read"), std::string::npos);
  EXPECT_NE(read(kHeader + std::string(70000, '1')).error().text.find(":2: longer than"), std::string::npos);
  EXPECT_NE(read(std::string(kHeader) + "0,1e7,0,0,1,0,0,0\n").error().text.find("1e6 m"), std::string::npos);
}

TEST(Trajectory, AnEndlessLineIsRefusedWithoutBeingRead) {
  const std::string path = tests::own_folder() + "telesplat-endless.csv";
  std::ofstream(path) << "t_s,px,py,pz,qw,qx,qy,qz\n0";
  std::filesystem::resize_file(path, uint64_t{1} << 31);  // a hole
  const auto read = Trajectory::read_csv(path);
  std::filesystem::remove(path);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().text.find("longer than"), std::string::npos) << read.error().text;
}

TEST(Trajectory, FindsItsColumnsInAFramesTable) {
  // Rows of two viewers alternate, columns have another order, and there are more of them.
  const auto t = read(
      "viewer,frame,px,py,pz,begin_s,qx,qy,qz,qw,t_s,detail\n"
      "viewer-10,0,9,9,9,0,0,0,0,1,0.5,1\n"
      "viewer-2,0,1,2,3,0,0,0,0,1,0.25,1\n"
      "viewer-10,1,9,9,9,0,0,0,0,1,0.7,1\n"
      "viewer-2,1,2,3,4,0,0,0,0,1,1.25,1\n");
  ASSERT_TRUE(t.ok()) << t.error().text;
  EXPECT_DOUBLE_EQ(t->duration_s(), 1);
  EXPECT_EQ(t->at(0).position_room, glm::dvec3(1, 2, 3));
  EXPECT_NEAR(glm::distance(t->at(0.5).position_room, glm::dvec3(1.5, 2.5, 3.5)), 0, 1e-12);
}

TEST(Trajectory, SkipsAByteOrderMarkBlanksAndQuotes) {
  const auto t = read("\xef\xbb\xbft_s, px, py ,pz,\"qw\",qx,qy,qz\r\n0, 1 , 2, 3, 1, 0, 0, 0\r\n\r\n");
  ASSERT_TRUE(t.ok()) << t.error().text;
  EXPECT_EQ(t->at(0).position_room, glm::dvec3(1, 2, 3));
}

TEST(Trajectory, RepeatsIfAsked) {
  auto t = read(std::string(kHeader) + "0,0,0,0,1,0,0,0\n2,2,0,0,1,0,0,0\n");
  ASSERT_TRUE(t.ok());
  EXPECT_NEAR(t->at(5).position_room.x, 2, 1e-12);
  t->repeat();
  EXPECT_NEAR(t->at(1.5).position_room.x, 1.5, 1e-12);
  EXPECT_NEAR(t->at(5).position_room.x, 1, 1e-12);
}

TEST(Trajectory, WritesWhatItReads) {
  const auto path = std::filesystem::temp_directory_path() / "telesplat-trajectory-written.csv";
  const Pose a = look_at({0.1, 2, 3}, {0, 0, 0}), b = look_at({-3, 0.5, 1}, {0.2, 0, 0});
  ASSERT_TRUE(write_trajectory(path.string(), {{0, a}, {0.5, b}}).ok());
  const auto t = Trajectory::read_csv(path.string());
  ASSERT_TRUE(t.ok()) << t.error().text;
  EXPECT_NEAR(glm::distance(t->at(0.5).position_room, b.position_room), 0, 1e-7);
  EXPECT_NEAR(std::abs(glm::dot(t->at(0).orientation, a.orientation)), 1, 1e-9);
  std::filesystem::remove(path);
  EXPECT_FALSE(write_trajectory("/nonexistent/x.csv", {{0, a}}).ok());
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
