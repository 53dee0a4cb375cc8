// Poses that other programs send.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/wire/head_pose.h"

namespace telesplat::wire {
namespace {

Result<HeadPose> decoded(const std::string& bytes) {
  return decode_head_pose({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()});
}

HeadPose some_pose() { return {12.5, {{0.1, 1.7, -0.3}, glm::normalize(glm::dquat(0.9, 0.1, -0.3, 0.2))}}; }

TEST(HeadPose, ComesBackAsItWas) {
  for (const bool timed : {true, false}) {
    HeadPose head = some_pose();
    if (!timed) head.t_s.reset();
    const auto back = decoded(encode_head_pose(head));
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->t_s, head.t_s);
    EXPECT_EQ(back->pose.position_room, head.pose.position_room);
    EXPECT_NEAR(std::abs(glm::dot(back->pose.orientation, head.pose.orientation)), 1, 1e-12);
  }
}

// Other programs write integers, floats of 32 bits, other fields, and any order.
TEST(HeadPose, TakesWhatOthersWrite) {
  // The literal holds zeros: its length is counted.
  const std::string bytes(
      "\x84\xa1q\x94\x01\x00\x00\xca\x00\x00\x00\x00\xa4name\xa4head\xa1p\x93\x00\xff\xcb\x3f\xf0\x00\x00\x00\x00\x00"
      "\x00"
      "\xa1t\x05",
      39);
  const auto head = decoded(bytes);
  ASSERT_TRUE(head) << head.error().text;
  EXPECT_EQ(head->t_s, 5);
  EXPECT_EQ(head->pose.position_room, glm::dvec3(0, -1, 1));
  EXPECT_EQ(head->pose.orientation.w, 1);
}

TEST(HeadPose, RefusesWhatIsNone) {
  const auto refused = [](HeadPose head) { return decoded(encode_head_pose(head)).ok() ? "" : "refused"; };
  HeadPose head = some_pose();
  head.pose.position_room.y = 1e6;
  EXPECT_STREQ(refused(head), "refused");
  head = some_pose();
  head.pose.position_room.y = std::nan("");
  EXPECT_STREQ(refused(head), "refused");
  head = some_pose();
  head.pose.orientation = glm::dquat(0, 0, 0, 0);
  EXPECT_STREQ(refused(head), "refused");
  head = some_pose();
  head.t_s = INFINITY;
  EXPECT_STREQ(refused(head), "refused");
  EXPECT_FALSE(decoded(""));
  EXPECT_FALSE(decoded("\xc0"));
  EXPECT_FALSE(decoded(encode_head_pose(some_pose()) + "x"));
  EXPECT_FALSE(decoded(std::string(kMaxHeadPoseBytes + 1, '\x81')));
  EXPECT_NE(decoded("\x80").error().text.find("field p is missing"), std::string::npos);
}

TEST(HeadPose, NoBytesDoHarm) {
  const std::string whole = encode_head_pose(some_pose());
  for (size_t n = 0; n < whole.size(); ++n) EXPECT_FALSE(decoded(whole.substr(0, n))) << n;
  std::mt19937 random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = whole;
    for (int n = 0; n < 3; ++n) bytes[random() % bytes.size()] = char(random());
    const auto head = decoded(bytes);
    if (!head) continue;
    EXPECT_TRUE(std::isfinite(head->pose.position_room.x + head->pose.position_room.y + head->pose.position_room.z));
    EXPECT_NEAR(glm::length(head->pose.orientation), 1, 1e-9);
  }
}

}  // namespace
}  // namespace telesplat::wire
