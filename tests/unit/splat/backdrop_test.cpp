// The backdrop shows the base in pixels that points leave empty, and nowhere else.
#include "common/splat/backdrop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "common/points/mosaic_builder.h"
#include "common/splat/cpu_splatter.h"

namespace telesplat::splat {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
const geometry::Camera kCamera = geometry::make_camera({{0, 0, 1}, {1, 0, 0, 0}}, 60, 320, 240);
const points::ModelConfig kModel{{glm::vec3(-0.5f), glm::vec3(0.5f)}, 2, false};

// A square of points at z that faces +z, from x0 to x1 and -0.3 to 0.3.
points::PointModel square(float z, float x0, float x1, float step, uint32_t colour) {
  points::PointModel model(kModel);
  const points::OctreeGrid grid = points::octree_grid(kModel);
  std::map<points::ClusterKey, std::vector<glm::dvec3>> leaves;
  for (float x = x0; x < x1; x += step)
    for (float y = -0.3f; y < 0.3f; y += step) {
      const glm::dvec3 at = (glm::dvec3(x, y, z) - grid.lo) / grid.leaf_size, leaf = glm::floor(at);
      const auto key = uint32_t(leaf.x) | uint32_t(leaf.y) << 10 | uint32_t(leaf.z) << 20;
      leaves[key].push_back((at - leaf) * 65536.0);
    }
  points::Insertion insertion{{1}, {}};
  for (const auto& [key, places] : leaves) {
    const auto n = uint32_t(places.size());
    points::MosaicBuilder out({1}, {}, {n, n, n});
    for (uint32_t i = 0; i < n; ++i) {
      out.x[i] = uint16_t(places[i].x), out.y[i] = uint16_t(places[i].y), out.z[i] = uint16_t(places[i].z);
      out.normal[i] = image::encode_normal16({0, 0, 1});
      out.colour[i] = colour;
    }
    auto& change = insertion.changes.emplace_back();
    change.key = key;
    change.added.push_back(out.finish(float(grid.leaf_size) / step, glm::vec3(0)));
  }
  model.commit(std::move(insertion));
  return model;
}

// Two triangles that face +z, or -z.
BasePart rectangle(float z, float x0, float x1, float y1, uint32_t colour, float facing = 1) {
  BasePart out;
  for (const glm::vec3& p : {glm::vec3(x0, -0.3f, z), {x1, -0.3f, z}, {x1, y1, z}, {x0, y1, z}}) {
    out.positions.push_back(p);
    out.normals.emplace_back(0, 0, facing);
    out.colours.push_back(colour);
    out.box_room.extend(p);
  }
  out.indices = {0, 1, 2, 0, 2, 3};
  find_planes(out);
  return out;
}
BaseNode node_of(std::vector<BasePart> parts, float error_m = 0) {
  BaseNode out;
  out.error_m = error_m;
  for (BasePart& part : parts) {
    out.box_room.extend(part.box_room);
    out.part_m = std::max(out.part_m, double{glm::length(part.box_room.size())});
    out.parts.push_back({std::make_shared<const BasePart>(std::move(part)), nullptr});
  }
  return out;
}
std::shared_ptr<const BaseMesh> mesh_of(std::vector<BasePart> parts, float error_m = 0) {
  return std::make_shared<const BaseMesh>(BaseMesh{{node_of(std::move(parts), error_m)}, 1, 1});
}

struct Picture {
  std::vector<uint32_t> colour = std::vector<uint32_t>(320 * 240);
  std::vector<float> depth_m = std::vector<float>(320 * 240);
  FrameTarget target() { return {320, 240, colour.data(), depth_m.data()}; }
  // Share of pixels that show something.
  double covered() const {
    return double(std::ranges::count_if(depth_m, [](float d) { return d < kNothing; })) / double(depth_m.size());
  }
};

// Draws a model's points before a base.
Picture drawn(const points::PointModel& model, std::shared_ptr<const BaseMesh> base, RenderOptions options = {},
              const geometry::Clip& clip = {}, const geometry::Camera& camera = kCamera) {
  DrawList list;
  select_view(model, camera, {}, list);
  list.base = std::move(base);
  list.base_clip = clip;
  Picture out;
  image::ShadingParameters unlit;
  unlit.lit = false;
  CpuSplatter(2).render(list, camera, options, image::Shading(unlit, camera), out.target());
  return out;
}
Picture drawn(std::shared_ptr<const BaseMesh> base, const geometry::Camera& camera = kCamera) {
  return drawn(points::PointModel(kModel), std::move(base), {}, {}, camera);
}

class BackdropTest : public testing::TestWithParam<Kernel> {
 protected:
  const RenderOptions options{.kernel = GetParam()};
};

TEST_P(BackdropTest, TheBaseFillsTheEmptyHalf) {
  const auto fine = square(0, -0.3f, 0, 0.002f, 0xff0000);
  const auto base = mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)});
  const Picture with = drawn(fine, base, options), without = drawn(fine, nullptr, options);
  size_t filled = 0;
  for (int y = 70; y < 170; ++y)
    for (int x = 80; x < 240; ++x) {
      const size_t at = size_t(320 * y + x);
      EXPECT_NEAR(with.depth_m[at], 1, 0.01) << x << " " << y;
      if (x < 155) EXPECT_EQ(with.colour[at], without.colour[at]);
      if (x > 165) filled += (with.colour[at] & 0xffffff) == 0x0000ff;
    }
  EXPECT_EQ(filled, 100u * 74u);
}

TEST_P(BackdropTest, PointsBehindTheBaseAreNotSeenThroughIt) {
  const auto fine = square(-0.3f, -0.4f, 0.4f, 0.002f, 0xff0000);
  const BasePart part = rectangle(0.2f, -0.3f, 0.3f, 0.3f, 0x0000ff);
  EXPECT_EQ(drawn(fine, mesh_of({part}), options).colour[320 * 120 + 160] & 0xffffff, 0x0000ffu);
  // They may lie on the surface that it stands for.
  EXPECT_EQ(drawn(fine, mesh_of({part}, 0.6f), options).colour[320 * 120 + 160] & 0xffffff, 0xff0000u);
}

INSTANTIATE_TEST_SUITE_P(Kernels, BackdropTest, testing::ValuesIn(kKernels),
                         [](const auto& of) { return std::string(kernel_name(of.param)); });

TEST(Backdrop, CoversThePixelsOfItsTriangles) {
  const double side = 0.6 * kCamera.focal_x();
  EXPECT_NEAR(drawn(mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)})).covered(), side * side / (320 * 240),
              4 * side / (320 * 240));
}

TEST(Backdrop, SurfacesAreSeenFromBehind) {
  const auto front = mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)});
  const auto back = mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff, -1)});
  EXPECT_EQ(drawn(front).depth_m, drawn(back).depth_m);
}

TEST(Backdrop, TheNearestTriangleShows) {
  const BasePart near = rectangle(0.1f, -0.3f, 0.3f, 0.3f, 0x0000ff), far = rectangle(0, -0.3f, 0.3f, 0.3f, 0xff0000);
  for (const auto& mesh : {mesh_of({near, far}), mesh_of({far, near})}) {
    const Picture picture = drawn(mesh);
    EXPECT_EQ(picture.colour[320 * 120 + 160] & 0xffffff, 0x0000ffu);
    EXPECT_NEAR(picture.depth_m[320 * 120 + 160], 0.9f, 0.001f);
  }
}

TEST(Backdrop, HiddenTrianglesAreNotDrawn) {
  auto base = std::make_shared<BaseMesh>(*mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)}));
  const double whole = drawn(base).covered();
  base->nodes[0].parts[0].hidden = std::make_shared<const BaseNode::Bits>(BaseNode::Bits{2});  // the second triangle
  EXPECT_NEAR(drawn(base).covered(), 0.5 * whole, 0.01);
}

TEST(Backdrop, AFinerNodeShowsWhereTheCoarseOneIsTooCoarse) {
  const float fine = float(fine_enough(kCamera));  // at a depth of 1 m
  for (const float error_m : {0.5f * fine, 2 * fine}) {
    BaseMesh mesh{{node_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)}, error_m)}, 1, 1};
    mesh.nodes[0].first_child = 1, mesh.nodes[0].children = 2;
    mesh.nodes.push_back(node_of({rectangle(0, -0.3f, 0, 0.3f, 0x00ff00)}));
    mesh.nodes.push_back(node_of({rectangle(0, 0, 0.3f, 0.3f, 0xff0000)}));
    const Picture picture = drawn(std::make_shared<const BaseMesh>(mesh));
    const bool coarse = error_m < fine;
    EXPECT_EQ(picture.colour[320 * 120 + 140] & 0xffffff, coarse ? 0x0000ffu : 0x00ff00u);
    EXPECT_EQ(picture.colour[320 * 120 + 180] & 0xffffff, coarse ? 0x0000ffu : 0xff0000u);
  }
}

TEST(Backdrop, TrianglesThatMeetLeaveNoPixelEmpty) {
  // A fan of thin triangles, near by, around a point that is no pixel's centre.
  BasePart fan;
  for (int i = 0; i <= 90; ++i) {
    const float angle = float(i) * float(M_PI) / 45;
    fan.positions.push_back(i == 90 ? glm::vec3(0.013f, 0.007f, 0) : glm::vec3(std::cos(angle), std::sin(angle), 0));
    fan.normals.emplace_back(0, 0, 1);
    fan.colours.push_back(0x0000ff);
    fan.box_room.extend(fan.positions.back());
    if (i < 90) fan.indices.insert(fan.indices.end(), {uint16_t(i), uint16_t((i + 1) % 90), uint16_t(90)});
  }
  find_planes(fan);
  EXPECT_EQ(drawn(mesh_of({fan})).covered(), 1);
}

// A floor from behind the eye to far ahead of it: no triangle lies wholly before the near plane.
BasePart floor_at(float y) {
  BasePart floor;
  for (const glm::vec3& p : {glm::vec3(-50, y, 50), {50, y, 50}, {50, y, -50}, {-50, y, -50}}) {
    floor.positions.push_back(p);
    floor.normals.emplace_back(0, 1, 0);
    floor.colours.push_back(0x0000ff);
    floor.box_room.extend(p);
  }
  floor.indices = {0, 1, 2, 0, 2, 3};
  find_planes(floor);
  return floor;
}

TEST(Backdrop, AFloorUnderTheEyeReachesBehindIt) {
  const Picture picture = drawn(mesh_of({floor_at(-0.2f)}));
  for (int y = 145; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const double depth = 0.2 * kCamera.focal_y() / (y + 0.5 - 120);
      ASSERT_NEAR(picture.depth_m[size_t(320 * y + x)], depth, 0.05 * depth) << x << " " << y;
    }
  EXPECT_EQ(picture.depth_m[320 * 100 + 160], kNothing);
}

TEST(Backdrop, WhatLiesBeforeTheNearPlaneCoversNothing) {
  const Picture picture = drawn(mesh_of({floor_at(-0.001f), rectangle(0, -0.3f, 0.3f, 0.3f, 0xff0000)}));
  EXPECT_NEAR(picture.depth_m[320 * 160 + 160], 1, 0.01);
}

TEST(Backdrop, ClippedTrianglesEndAtThePlane) {
  const auto base = mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)});
  const geometry::Clip clip{{{{1, 0, 0}, 0.1}}};  // x >= 0.1 stays
  const Picture cut = drawn(points::PointModel(kModel), base, {}, clip);
  const int edge = int(160 + 0.1 * kCamera.focal_x());
  EXPECT_EQ(cut.depth_m[size_t(320 * 120 + edge - 3)], kNothing);
  EXPECT_LT(cut.depth_m[size_t(320 * 120 + edge + 3)], kNothing);
  EXPECT_EQ(drawn(points::PointModel(kModel), base, {}, {{{{1, 0, 0}, 0.4}}}).covered(), 0);
}

TEST(Backdrop, WithoutFinishAPictureIsFilledToo) {
  const auto base = mesh_of({rectangle(0, -0.3f, 0.3f, 0.3f, 0x0000ff)});
  const double covered = drawn(base).covered();
  EXPECT_NEAR(drawn(points::PointModel(kModel), base, {.finish = {false, false, false}}).covered(), covered,
              0.02 * covered);
}

}  // namespace
}  // namespace telesplat::splat
