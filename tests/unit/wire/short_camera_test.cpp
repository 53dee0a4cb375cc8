// Short cameras: round trips are exact, and all other bytes are refused.
#include "common/wire/short_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/wire/serial.h"
#include "tests/support/wire_samples.h"

namespace telesplat::wire {
namespace {

using namespace telesplat::test;

geometry::Camera read(const std::string& bytes) {
  const auto camera = read_short_form(bytes_of(bytes));
  EXPECT_TRUE(camera) << camera.error().text;
  return camera ? *camera : geometry::Camera{};
}

::testing::AssertionResult refused(const std::string& bytes, const std::string& named) {
  const auto camera = read_short_form(bytes_of(bytes));
  if (camera) return ::testing::AssertionFailure() << "was accepted";
  if (camera.error().text.find(named) != std::string::npos) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "the text does not name " << named << ": " << camera.error().text;
}

struct RandomCameras {
  std::mt19937 random{5};
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  geometry::Camera next() {
    geometry::Camera c;
    c.pose.position_room = {uniform(-3, 3), uniform(-3, 3), uniform(-3, 3)};
    c.pose.orientation =
        glm::normalize(glm::dquat(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1) + 1e-3));
    const bool even = uniform(0, 1) < 0.5;
    c.right = uniform(0.1, 2), c.left = even ? -c.right : uniform(-2, -0.1);
    c.top = uniform(0.1, 2), c.bottom = even ? -c.top : uniform(-2, -0.1);
    if (uniform(0, 1) < 0.5) c.near_m = uniform(1e-3, 1);
    c.width = 1 + int(uniform(0, 16383)), c.height = 1 + int(uniform(0, 16383));
    return c;
  }
};

double turn_between(const glm::dquat& a, const glm::dquat& b) {
  const glm::dquat d = glm::conjugate(a) * b;
  return 2 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

TEST(ShortCamera, IsReadAsWhatWasWrittenAndLiesBesideWhatWasWanted) {
  RandomCameras cameras;
  for (int i = 0; i < 2000; ++i) {
    const geometry::Camera wanted = cameras.next(), c = shortened(wanted);
    const auto bytes = short_form(c);
    ASSERT_TRUE(bytes) << i;
    EXPECT_EQ(read(*bytes), c) << i;
    EXPECT_EQ(shortened(c), c) << "twice is as good as once";
    EXPECT_LT(glm::length(c.pose.position_room - wanted.pose.position_room), 1.7e-6);
    EXPECT_LT(turn_between(c.pose.orientation, glm::normalize(wanted.pose.orientation)), 3e-6);
    EXPECT_NEAR(glm::length(c.pose.orientation), 1, 1e-12);
    for (const auto side :
         {&geometry::Camera::left, &geometry::Camera::right, &geometry::Camera::bottom, &geometry::Camera::top})
      EXPECT_NEAR(c.*side, wanted.*side, 1e-6);
    EXPECT_FLOAT_EQ(float(c.near_m), float(wanted.near_m));
    EXPECT_EQ(c.width, wanted.width);
    EXPECT_EQ(c.height, wanted.height);
  }
}

TEST(ShortCamera, OfAUsualViewTakes29Bytes) {
  geometry::Camera c = geometry::make_camera({{1.228, 0.401, -0.36}, {0.783, -0.141, 0.602, 0.072}}, 91, 1312, 816);
  EXPECT_FALSE(short_form(c)) << "any numbers";
  const auto bytes = short_form(shortened(c));
  ASSERT_TRUE(bytes);
  EXPECT_EQ(bytes->size(), 29u);
}

// Two components are equal in size, or one is 1: each component may be the one left out.
TEST(ShortCamera, OfQuarterTurnsIsShortened) {
  const double half = std::sqrt(0.5);
  for (const glm::dquat q : {glm::dquat(half, 0, half, 0), glm::dquat(half, half, 0, 0), glm::dquat(0, half, 0, -half),
                             glm::dquat(1, 0, 0, 0), glm::dquat(0, 0, -1, 0), glm::dquat(0.5, 0.5, 0.5, 0.5),
                             glm::dquat(-0.5, 0.5, -0.5, 0.5)}) {
    geometry::Camera c;
    c.pose.orientation = q;
    const geometry::Camera s = shortened(c);
    ASSERT_TRUE(short_form(s));
    EXPECT_EQ(read(*short_form(s)), s);
    EXPECT_EQ(shortened(s), s);
    EXPECT_LT(turn_between(s.pose.orientation, q), 3e-6);
  }
}

TEST(ShortCamera, OfWhatIsTooFarOrTooNarrowStaysAsItIs) {
  const auto stays = [](auto change) {
    geometry::Camera c;
    change(c);
    const geometry::Camera s = shortened(c);
    return s == c && !short_form(s);
  };
  EXPECT_TRUE(stays([](geometry::Camera& c) { c.pose.position_room.x = 5000.1; }));
  EXPECT_TRUE(stays([](geometry::Camera& c) { c.left = -7e-7, c.right = 7e-7; })) << "less than a step wide";
  geometry::Camera nowhere;
  nowhere.pose.position_room.x = NAN;
  EXPECT_FALSE(short_form(shortened(nowhere)));
}

TEST(ShortCamera, IsRefusedWhereBytesAreNone) {
  RandomCameras cameras;
  for (int i = 0; i < 50; ++i) {
    const std::string bytes = *short_form(shortened(cameras.next()));
    for (size_t n = 0; n < bytes.size(); ++n) EXPECT_TRUE(refused(bytes.substr(0, n), "camera")) << n;
    EXPECT_TRUE(refused(bytes + '\0', "1 bytes after"));
  }
  // Flags, position, orientation, right, top, width, height.
  const std::string zero(1, '\0'), three(3, '\0'), one("\x80\x80\x40"), ends = one + one + "\x10\x10";
  const std::string turn_of_one("\x80\x80\x80\x01", 4);
  EXPECT_TRUE(read_short_form(bytes_of("\x1c" + three + three + ends)));
  EXPECT_TRUE(read_short_form(bytes_of("\x1c" + three + turn_of_one + zero + zero + ends)));
  EXPECT_TRUE(refused("\x3c" + three + three + ends, "flags 60"));
  EXPECT_TRUE(refused("\x1c" + three + turn_of_one + turn_of_one + zero + ends, "squares"));
  EXPECT_TRUE(refused("\x1c" + three + std::string("\x80\x80\x80\x02", 4) + zero + zero + ends, "component"));
  EXPECT_TRUE(refused("\x1c" + three + three + zero + one + "\x10\x10", "frustum"));
  EXPECT_TRUE(refused("\x1c" + three + three + one + one + zero + "\x10", "size 0x16"));
  EXPECT_TRUE(refused("\x1c" + three + three + one + one + "\x81\x80\x01\x10", "size 16385x16"));
  EXPECT_TRUE(refused("\x1c" + std::string(5, '\xff') + zero + zero + three + ends, "short camera"));
  EXPECT_TRUE(refused("\x0c" + three + three + one + one + std::string("\0\0\xc0\x7f", 4) + "\x10\x10", "finite"));
}

TEST(ShortCamera, StandsInBriefMessagesAlone) {
  const geometry::Camera c = shortened(RandomCameras{}.next());
  Patch patch = sample_message<Patch>();
  const size_t usual = encode(patch).size();
  patch.camera = c, patch.rect = patch.missed.rect = {0, 0, 1, 1};
  const std::string body = encode(patch);
  EXPECT_LT(body.size() + 30, usual);
  const auto back = decode<Patch>(bytes_of(body));
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(back->camera, c);
  // In other messages a camera has all its fourteen numbers.
  ViewRequest request = sample_message<ViewRequest>();
  request.camera = c;
  const auto asked = decode<ViewRequest>(bytes_of(encode(request)));
  ASSERT_TRUE(asked) << asked.error().text;
  EXPECT_EQ(asked->camera, c);
  EXPECT_FALSE(decode<ViewRequest>(bytes_of(
      with_value(encode(request), "camera", "\xc4" + std::string(1, char(short_form(c)->size())) + *short_form(c)))));
}

}  // namespace
}  // namespace telesplat::wire
