#include "common/geometry/clip.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <random>

namespace telesplat::geometry {
namespace {

Clip random_clip(std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  Clip out;
  for (unsigned n = 1 + random() % Clip::kMostPlanes; n > 0; --n) {
    glm::dvec3 normal(any(random), any(random), any(random));
    if (random() % 3 == 0) normal = {0, normal.y < 0 ? -1.0 : 1.0, 0};
    out.planes.push_back({glm::normalize(normal), 0.4 * any(random)});
  }
  return out;
}

glm::dvec3 random_point(std::mt19937& random, double size) {
  std::uniform_real_distribution<double> any(-size, size);
  return {any(random), any(random), any(random)};
}

TEST(Clip, KeepsWhatLiesOnTheSideOfItsNormal) {
  const Clip clip{{{{0, 1, 0}, 0.25}}};
  EXPECT_TRUE(clip.keeps({3, 0.25, -1}));
  EXPECT_TRUE(clip.keeps({0, 0.3, 0}));
  EXPECT_FALSE(clip.keeps({0, 0.2, 0}));
  EXPECT_TRUE(clip.keeps({0, 0.2, 0}, 0.06));
  EXPECT_TRUE(Clip{}.keeps({1e9, -1e9, 0}));
}

// The kept points of a line are exactly those of its stretch.
TEST(Clip, TheStretchOfALineIsWhatIsKeptOfIt) {
  std::mt19937 random(7);
  int kept = 0, cut = 0;
  for (int i = 0; i < 2000; ++i) {
    const Clip clip = random_clip(random);
    const glm::dvec3 origin = random_point(random, 1);
    glm::dvec3 direction = random_point(random, 1);
    if (i % 5 == 0) direction.y = 0;  // parallel to some of the planes
    const Clip::Stretch stretch = clip.stretch(origin, direction);
    for (double t = -3; t <= 3; t += 0.07) {
      const glm::dvec3 p = origin + t * direction;
      if (std::abs(t - stretch.begin) < 1e-6 || std::abs(t - stretch.end) < 1e-6) continue;
      ASSERT_EQ(clip.keeps(p), t > stretch.begin && t < stretch.end) << "t " << t;
      ++(clip.keeps(p) ? kept : cut);
    }
  }
  EXPECT_GT(kept, 1000);
  EXPECT_GT(cut, 1000);
}

// kAll and kNone are promises about every point; kSome is not.
TEST(Clip, WhatIsSaidOfABoxHoldsForItsPoints) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  int seen[3] = {};
  for (int i = 0; i < 2000; ++i) {
    const Clip clip = random_clip(random);
    Box box;
    const glm::vec3 lo(random_point(random, 0.8));
    box.extend(lo), box.extend(lo + glm::vec3(unit(random), unit(random), unit(random)) * 0.3f);
    const auto part = clip.part_of(box);
    ++seen[int(part)];
    for (int n = 0; n < 20; ++n) {
      const glm::dvec3 p =
          glm::dvec3(lo) + glm::dvec3(unit(random), unit(random), unit(random)) * glm::dvec3(box.size());
      if (part == Clip::Part::kAll) {
        ASSERT_TRUE(clip.keeps(p, 1e-9));
      } else if (part == Clip::Part::kNone) {
        ASSERT_FALSE(clip.keeps(p, -1e-9));
      }
    }
  }
  for (const int n : seen) EXPECT_GT(n, 50);
}

TEST(Clip, TheTextComesBackToTheLastBit) {
  std::mt19937 random(13);
  EXPECT_EQ(to_text(Clip{}), "");
  for (int i = 0; i < 200; ++i) {
    const Clip clip = random_clip(random);
    const auto read = clip_from_text(to_text(clip));
    ASSERT_TRUE(read) << read.error().text;
    EXPECT_EQ(*read, clip);
  }
}

TEST(Clip, BadTextsAreRefused) {
  for (const char* text : {"x", "1 0 0", "1 0 0 0 0", "2 0 0 0", "0 0 0 1", "1 0 0 1e10", "nan 0 0 0", "1 0 0 inf",
                           "1 0 0 0;;", ";", "1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0;1 0 0 0"})
    EXPECT_FALSE(clip_from_text(text)) << text;
}

}  // namespace
}  // namespace telesplat::geometry
