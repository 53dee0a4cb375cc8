// The base hides surfels that rays have passed, and keeps those on surfaces and behind them.
#include "services/packer/points/base/base.h"

#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <set>

#include "common/codec/surfel_codec.h"
#include "common/image/normal.h"

namespace telesplat::packer {
namespace {

constexpr float kSpacing = 0.02f;
const points::ModelConfig kModel{{glm::vec3(-0.5f), glm::vec3(0.5f)}, 5};

// A square of surfels at depth z that faces +z, from -half to half.
std::vector<glm::vec3> square(float z, float half) {
  std::vector<glm::vec3> out;
  for (float x = -half; x <= half; x += kSpacing)
    for (float y = -half; y <= half; y += kSpacing) out.emplace_back(x, y, z);
  return out;
}

std::vector<std::byte> set_of(const std::vector<glm::vec3>& surfels) {
  std::vector<float> positions;
  for (const glm::vec3& p : surfels) positions.insert(positions.end(), {p.x, p.y, p.z});
  return geometry::build_surfels(positions, std::vector(surfels.size(), image::encode_normal32({0, 0, 1})),
                                 std::vector(surfels.size(), 0x204060u), kSpacing, false);
}
Base base_of(const std::vector<glm::vec3>& surfels) {
  const auto bytes = set_of(surfels);
  return Base(*geometry::SurfelView::validate(bytes), kModel, nullptr);
}

// All surfels of a base with their numbers, as its parts tell them.
std::vector<std::pair<uint32_t, glm::vec3>> told(const Base& base) {
  std::vector<std::pair<uint32_t, glm::vec3>> out;
  for (size_t n = 1; n < base.parts(); ++n) {
    const auto part = base.part(n);
    const auto* bytes = reinterpret_cast<const uint8_t*>(part.surfel_data.data());
    const auto leaves = codec::decode_surfels({bytes, part.surfel_data.size()});
    EXPECT_TRUE(leaves.ok());
    const points::ModelConfig config{part.box_room, int(part.depth), false};
    for (const auto& leaf : *leaves) {
      const geometry::Box box = points::leaf_box(config, leaf.key);
      for (size_t i = 0; i < leaf.surfels.size(); ++i) {
        const auto& s = leaf.surfels[i];
        out.emplace_back(leaf.first + i, box.lo + (glm::vec3(s.x, s.y, s.z) + 0.5f) / 256.0f * box.size());
      }
    }
  }
  return out;
}

std::set<uint32_t> numbers(const std::vector<uint32_t>& words) {
  std::set<uint32_t> out;
  for (size_t i = 0; i < words.size(); i += 3)
    for (uint64_t bits = words[i + 1] | uint64_t{words[i + 2]} << 32; bits != 0; bits &= bits - 1)
      out.insert(64 * words[i] + uint32_t(std::countr_zero(bits)));
  return out;
}

// A view from z = 1 along -z, in which each pixel's ray ends at this depth; 0: it meets nothing.
SampledTile seen(const std::function<double(double x, double y)>& depth_m) {
  SampledTile tile;
  tile.camera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 60, 256, 256);
  tile.rect = {0, 0, 256, 256};
  tile.image = image::DepthImage(256, 256);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      const glm::dvec3 p = tile.camera.unproject(x + 0.5, y + 0.5, 1);
      if (const double d = depth_m(p.x, p.y); d > 0)
        tile.image.depth[size_t(256 * y + x)] = image::encode_depth(d, tile.camera.near_m);
    }
  return tile;
}

TEST(Base, PartsHaveEverySurfelInItsPlace) {
  const auto surfels = square(0, 0.4f);
  const Base base = base_of(surfels);
  EXPECT_EQ(base.surfels(), surfels.size());
  std::set<uint32_t> seen_numbers;
  for (const auto& [number, at] : told(base)) {
    EXPECT_TRUE(seen_numbers.insert(number).second);
    EXPECT_LT(std::abs(at.z), 0.001f);
  }
  EXPECT_EQ(seen_numbers.size(), surfels.size());
  EXPECT_EQ(*seen_numbers.rbegin(), surfels.size() - 1);
}

TEST(Base, PartZeroHasOneSurfelInSixteen) {
  const Base base = base_of(square(0, 0.4f));
  const auto part = base.part(0);
  const auto* bytes = reinterpret_cast<const uint8_t*>(part.surfel_data.data());
  size_t count = 0;
  const auto leaves = codec::decode_surfels({bytes, part.surfel_data.size()});
  ASSERT_TRUE(leaves.ok());
  for (const auto& leaf : *leaves) count += leaf.surfels.size();
  EXPECT_EQ(count, (base.surfels() + 15) / 16);
}

TEST(Base, RaysThatMeetNothingHideSurfels) {
  Base base = base_of(square(0, 0.3f));
  base.hide(seen([](double, double) { return 0.0; }), nullptr);
  EXPECT_EQ(numbers(base.hidden()).size(), base.surfels());
}

TEST(Base, RaysThatEndOnASurfaceHideNoSurfelInside) {
  Base base = base_of(square(0, 0.3f));
  base.hide(seen([](double, double) { return 1.0; }), nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, SurfelsBehindASurfaceStay) {
  Base base = base_of(square(-0.2f, 0.3f));
  base.hide(seen([](double, double) { return 1.0; }), nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, SurfelsAtTheEdgeOfASurfaceAreHidden) {
  Base base = base_of(square(0, 0.3f));
  // The surface ends at x = 0.1; x at depth 1 is x there.
  base.hide(seen([](double x, double) { return x < 0.1 ? 1.0 : 0.0; }), nullptr);
  const auto hidden = numbers(base.hidden());
  for (const auto& [number, at] : told(base)) {
    if (at.x > 0.1f - 0.5f * kSpacing) {
      EXPECT_TRUE(hidden.contains(number)) << at.x;
    }
    if (at.x < 0.1f - 1.5f * kSpacing) {
      EXPECT_FALSE(hidden.contains(number)) << at.x;
    }
  }
}

TEST(Base, RaysThatWereNotCastTellNothing) {
  Base base = base_of(square(0, 0.3f));
  image::PixelMask cast;
  cast.reset(256, 256);
  base.hide(seen([](double, double) { return 0.0; }), &cast);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, RaysCoarserThanTheSurfelsTellNothing) {
  Base base = base_of(square(0, 0.3f));
  SampledTile far = seen([](double, double) { return 0.0; });
  far.camera = geometry::make_camera({{0, 0, 9}, {1, 0, 0, 0}}, 60, 256, 256);
  base.hide(far, nullptr);
  EXPECT_TRUE(base.hidden().empty());
}

TEST(Base, ShowsTheSurfelsOfABoxAgain) {
  Base base = base_of(square(0, 0.3f));
  base.hide(seen([](double, double) { return 0.0; }), nullptr);
  (void)base.take_changes();
  const geometry::Box box{glm::vec3(0, -1, -1), glm::vec3(1, 1, 1)};
  base.show(box);
  const auto hidden = numbers(base.hidden());
  for (const auto& [number, at] : told(base))
    if (std::abs(at.x) > 0.001f) {
      EXPECT_EQ(hidden.contains(number), at.x < 0) << at.x;
    }
  EXPECT_FALSE(base.take_changes().empty());
  EXPECT_TRUE(base.take_changes().empty());
}

}  // namespace
}  // namespace telesplat::packer
