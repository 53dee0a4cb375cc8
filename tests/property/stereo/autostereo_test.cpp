// The map from subpixels to eyes, against rays traced the other way: from an eye, through a slit or a lens, into the
// plate, onto a subpixel.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "client/stereo/autostereo/interleaver.h"

namespace telesplat::stereo {
namespace {

// Lines that interpolation between places may be off.
constexpr double kInterpolated = 0.004;
constexpr double kDegree = 3.14159265358979323846 / 180;

double uniform(std::mt19937& rng, double least, double most) {
  return std::uniform_real_distribution<double>(least, most)(rng);
}

Panel any_panel(std::mt19937& rng) {
  Panel p;
  p.width = 1200, p.height = 800;
  p.pixel_m = uniform(rng, 0.15e-3, 0.35e-3);
  p.subpixels = rng() % 2 ? Subpixels::kRgb : Subpixels::kBgr;
  LineScreen& l = p.lines;
  l.pitch_m = p.pixel_m * uniform(rng, 2, 8);
  l.tilt_deg = uniform(rng, -30, 30);
  l.shift_m = uniform(rng, -1e-3, 1e-3);
  l.gap_m = uniform(rng, 0, 2e-3);
  l.thickness_m = uniform(rng, 0.5e-3, 6e-3);
  l.index = uniform(rng, 1.3, 1.8);
  l.opening = uniform(rng, 0.1, 0.45);
  l.guard = uniform(rng, 0, 0.1);
  return p;
}

Eyes any_eyes(std::mt19937& rng) {
  const glm::dvec3 middle(uniform(rng, -0.3, 0.3), uniform(rng, -0.2, 0.2), uniform(rng, 0.4, 1.5));
  const double turn = uniform(rng, -0.6, 0.6), roll = uniform(rng, -0.3, 0.3);
  const glm::dvec3 half = 0.032 * glm::dvec3(std::cos(turn) * std::cos(roll), std::sin(roll), std::sin(turn));
  return {middle - half, middle + half};
}

// Traces a ray from the eye through a point of the lines' plane, refracted where it enters the plate there and where it
// leaves; returns its place among the pixels. Here the plate comes first: the model has it last, with equal result.
glm::dvec2 arrive(const LineScreen& l, const glm::dvec3& eye, const glm::dvec2& slit) {
  const double lines_z = l.gap_m + l.thickness_m;
  const glm::dvec2 aside = slit - glm::dvec2(eye);
  const double distance = glm::length(aside), in_air = std::atan2(distance, eye.z - lines_z);
  const double in_plate = std::asin(std::sin(in_air) / l.index);
  const double onwards = l.thickness_m * std::tan(in_plate) + l.gap_m * std::tan(in_air);
  return distance > 0 ? slit + aside * (onwards / distance) : slit;
}

// The subpixel in which a place lies.
struct Hit {
  int x = 0, y = 0, subpixel = 0;
  double edge = 0;  // distance of the place from the subpixel's middle, in its widths
};
std::optional<Hit> subpixel_at(const Panel& p, const glm::dvec2& place) {
  const double column = 3 * (place.x / p.pixel_m + 0.5 * p.width), row = 0.5 * p.height - place.y / p.pixel_m;
  const int n = int(std::floor(column)), y = int(std::floor(row));
  if (n < 0 || n >= 3 * p.width || y < 0 || y >= p.height) return std::nullopt;
  return Hit{n / 3, y, n % 3, std::abs(column - n - 0.5)};
}

Shown shown_at(Interleaver& interleaver, const Eyes& eyes, const Hit& h) {
  static std::vector<uint32_t> left, right;
  interleaver.masks(eyes, h.y, left, right);
  const int shift = shifts_of(interleaver.panel().subpixels)[size_t(h.subpixel)];
  const bool l = left[size_t(h.x)] >> shift & 1, r = right[size_t(h.x)] >> shift & 1;
  EXPECT_FALSE(l && r);
  return l ? Shown::kLeft : r ? Shown::kRight : Shown::kNothing;
}

// Returns a point of a random line's slit, `off` lines from its middle.
glm::dvec2 in_slit(std::mt19937& rng, const Panel& p, double off) {
  const double tilt = p.lines.tilt_deg * kDegree, half = 0.45 * p.width_m();
  const double line = std::nearbyint(uniform(rng, -half, half) / p.lines.pitch_m) + off;
  const double across = line * p.lines.pitch_m + p.lines.shift_m, along = uniform(rng, -0.4, 0.4) * p.height_m();
  return across * glm::dvec2(std::cos(tilt), std::sin(tilt)) + along * glm::dvec2(-std::sin(tilt), std::cos(tilt));
}

// Returns the distance from a line's middle to the point where the eye sees a place, in lines: by bisection along the
// lines' normal, with rays from the eye to the place.
double off_line_by_rays(const Panel& p, const glm::dvec3& eye, const glm::dvec2& place) {
  glm::dvec2 guess = place;
  for (int i = 0; i < 60; ++i) guess += place - arrive(p.lines, eye, guess);
  EXPECT_LT(glm::distance(arrive(p.lines, eye, guess), place), 1e-9);
  const double tilt = p.lines.tilt_deg * kDegree;
  const double line = (guess.x * std::cos(tilt) + guess.y * std::sin(tilt) - p.lines.shift_m) / p.lines.pitch_m;
  return std::abs(line - std::nearbyint(line));
}

TEST(Autostereo, NoSubpixelThatOneEyeSeesAloneIsTheOthers) {
  std::mt19937 rng(11);
  int owned = 0, dark = 0, shared = 0;
  for (int round = 0; round < 60; ++round) {
    const Panel p = any_panel(rng);
    const Eyes eyes = any_eyes(rng);
    Interleaver interleaver(p);
    for (int ray = 0; ray < 60; ++ray) {
      const size_t eye = rng() % 2;
      const double off = uniform(rng, -0.5, 0.5) * p.lines.opening;
      const auto hit = subpixel_at(p, arrive(p.lines, eyes[eye], in_slit(rng, p, off)));
      if (!hit) continue;
      // The map uses the subpixel's middle: so does the test.
      const glm::dvec2 middle = place_of(p, hit->x, hit->y, hit->subpixel);
      const double own = off_line_by_rays(p, eyes[eye], middle), other = off_line_by_rays(p, eyes[1 - eye], middle);
      const Shown shown = shown_at(interleaver, eyes, *hit), mine = eye == 0 ? Shown::kLeft : Shown::kRight;
      const double half = 0.5 * p.lines.opening;
      if (own < half && other >= half) {
        if (other - own < kInterpolated) continue;
        EXPECT_TRUE(shown == mine || (shown == Shown::kNothing && other - own < p.lines.guard + kInterpolated))
            << "off by " << own << " and " << other;
        owned += shown == mine;
      } else {
        ++shared;
      }
      dark += shown == Shown::kNothing;
    }
  }
  EXPECT_GT(owned, 1000);
  EXPECT_GT(shared, 50);
  EXPECT_LT(dark, owned);
}

TEST(Autostereo, EveryShownSubpixelBelongsToTheEyeThatIsNearerToALine) {
  std::mt19937 rng(12);
  for (int round = 0; round < 40; ++round) {
    const Panel p = any_panel(rng);
    const Eyes eyes = any_eyes(rng);
    Interleaver interleaver(p);
    for (int i = 0; i < 50; ++i) {
      const Hit h{int(rng() % uint32_t(p.width)), int(rng() % uint32_t(p.height)), int(rng() % 3)};
      const glm::dvec2 middle = place_of(p, h.x, h.y, h.subpixel);
      const double left = off_line_by_rays(p, eyes[0], middle), right = off_line_by_rays(p, eyes[1], middle);
      const double apart = std::abs(left - right);
      if (std::abs(apart - p.lines.guard) < kInterpolated || apart < kInterpolated) continue;  // at an edge
      const Shown expected = apart < p.lines.guard ? Shown::kNothing : left < right ? Shown::kLeft : Shown::kRight;
      EXPECT_EQ(shown_at(interleaver, eyes, h), expected) << left << " and " << right;
    }
  }
}

// Sight through the plate is refracted by Snell's law, and the map's ray is such a line.
TEST(Autostereo, SightIsRefractedAsSnellSays) {
  std::mt19937 rng(13);
  for (int i = 0; i < 2000; ++i) {
    const Panel p = any_panel(rng);
    const Eyes eyes = any_eyes(rng);
    const glm::dvec2 place(uniform(rng, -0.3, 0.3), uniform(rng, -0.2, 0.2));
    const glm::dvec2 slit = through(p.lines, eyes[0], place);
    EXPECT_LT(glm::distance(arrive(p.lines, eyes[0], slit), place), 1e-9);
  }
}

// A sheet of cylindrical lenses, with the pixels in their focal plane. All rays from an eye that meet one lens arrive
// across it where the ray through its middle does; along it they pass as through a plate. So an eye sees in each lens
// one stripe of places, as in the slit of a barrier, and the same map finds it.
TEST(Autostereo, SlantedLensesWorkByTheSameMap) {
  std::mt19937 rng(14);
  int seen = 0, wrong = 0, dark = 0;
  for (int round = 0; round < 120; ++round) {
    Panel p = any_panel(rng);
    p.lines.tilt_deg = uniform(rng, 5, 25) * (rng() % 2 ? 1 : -1);  // slanted
    p.lines.gap_m = 0;
    p.lines.pitch_m = p.pixel_m * uniform(rng, 4, 8);
    const Eyes eyes = any_eyes(rng);
    Interleaver interleaver(p);
    const double tilt = p.lines.tilt_deg * kDegree;
    const glm::dvec2 across(std::cos(tilt), std::sin(tilt));
    for (int ray = 0; ray < 60; ++ray) {
      const size_t eye = rng() % 2;
      // The ray may meet the lens at any place.
      const double off = uniform(rng, -0.5, 0.5);
      const glm::dvec2 entry = in_slit(rng, p, off), middle = entry - across * (off * p.lines.pitch_m);
      const glm::dvec2 plain = arrive(p.lines, eyes[eye], entry), chief = arrive(p.lines, eyes[eye], middle);
      const glm::dvec2 place = plain + across * glm::dot(chief - plain, across);
      const auto hit = subpixel_at(p, place);
      if (!hit) continue;
      const Shown shown = shown_at(interleaver, eyes, *hit);
      const glm::dvec2 at = place_of(p, hit->x, hit->y, hit->subpixel);
      // A place that both eyes see in the middle of a lens cannot be shared out.
      const double other = off_line_by_rays(p, eyes[1 - eye], at);
      const double subpixel = p.pixel_m / 3 / p.lines.pitch_m;  // in lines
      if (other < p.lines.guard + 2 * subpixel) continue;
      ++seen;
      dark += shown == Shown::kNothing;
      wrong += shown == (eye == 0 ? Shown::kRight : Shown::kLeft);
    }
  }
  EXPECT_GT(seen, 900);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(dark, seen / 10);
}

}  // namespace
}  // namespace telesplat::stereo
