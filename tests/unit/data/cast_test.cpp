// Hits of a ray in the data themselves, for surfaces, fields and opacities with known formulas: place and value lie
// within the stated bounds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <random>

#include "services/data/mesh/cast.h"
#include "services/data/volume/store.h"
#include "tests/support/volume/samples.h"

namespace telesplat::data {
namespace {

constexpr int kSide = 120;  // cells of the hills, on 0..100 in x and y
constexpr double kRoom = 0.8;

double height(double x, double y) { return 8 * std::sin(x / 9) * std::cos(y / 7) + 0.05 * x; }
double heat(double x, double y, double z) { return 300 + 12 * std::sin(x / 15 + y / 11) + 0.4 * z; }

Mesh hills(bool of_cells) {
  Mesh m;
  m.format = "vtp";
  for (int j = 0; j <= kSide; ++j)
    for (int i = 0; i <= kSide; ++i) {
      const double x = 100.0 * i / kSide, y = 100.0 * j / kSide;
      m.positions.emplace_back(x, y, height(x, y));
      if (!of_cells) m.scalars.push_back(float(heat(x, y, height(x, y))));
    }
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const auto a = uint32_t(j * (kSide + 1) + i), b = a + 1, c = a + kSide + 1, d = c + 1;
      m.indices.insert(m.indices.end(), {a, b, d, a, d, c});
    }
  m.scalars_of_faces = of_cells;
  if (of_cells)
    for (size_t t = 0; t < m.indices.size() / 3; ++t) m.scalars.push_back(float(t));
  return m;
}

std::shared_ptr<MeshStore> store_of(bool of_cells) {
  const MeshSource source{1, "", [=](const ReadProgress&) -> Result<Mesh> { return hills(of_cells); }, "heat"};
  StoreOptions options;
  options.up = "z", options.use_cache = false, options.room_size_m = kRoom;
  return *MeshStore::make("hills.vtp", source, options, [](const char*, double) {});
}

// Rays from above and aside, to places of the box.
std::vector<scene::Probe> rays(int count, const geometry::Box& box, double least_height) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 1);
  std::vector<scene::Probe> out;
  const glm::dvec3 lo(box.lo), size = glm::dvec3(box.hi) - lo;
  while (int(out.size()) < count) {
    const glm::dvec3 to = lo + size * glm::dvec3(0.1 + 0.8 * any(random), any(random), 0.1 + 0.8 * any(random));
    const glm::dvec3 from = to + glm::dvec3(any(random) - 0.5, least_height + any(random), any(random) - 0.5) * 2.0;
    out.push_back({EpochId{1}, from, glm::normalize(to - from)});
  }
  return out;
}

TEST(CastMesh, PlacesAndValuesAreWithinTheirBoundsOfTheFormulas) {
  const auto store = store_of(false);
  const auto& info = store->info();
  const auto placement =
      scene::placement_of(glm::dmat3({1, 0, 0}, {0, 0, -1}, {0, 1, 0}), info.box_data, info.box_room);
  const double cell_m = kRoom / kSide;
  int hits = 0;
  std::vector<double> bounds_m;
  for (const auto& ray : rays(300, info.box_room, 0.4)) {
    const auto found = cast(*store, ray, {}, 0, false);
    // The formula's place: the first change of sign along the ray, halved until it is exact.
    const auto above = [&](double t) {
      const glm::dvec3 p = placement.to_data(ray.origin_room + t * ray.direction_room);
      return p.z - height(p.x, p.y);
    };
    double near = 0, far = 0;
    while (far < 4 && above(far) > 0) near = far, far += 1e-3;
    if (far >= 4) continue;
    for (int n = 0; n < 60; ++n) (above((near + far) / 2) > 0 ? near : far) = (near + far) / 2;
    const glm::dvec3 room = ray.origin_room + far * ray.direction_room, data = placement.to_data(room);
    if (data.x < 2 || data.y < 2 || data.x > 98 || data.y > 98) continue;  // the hills end there
    ASSERT_TRUE(found);
    ASSERT_TRUE(found->error_m && found->value && found->value_error);
    const double off_m = glm::distance(found->room, room);
    EXPECT_LE(off_m, *found->error_m);
    EXPECT_LE(off_m, cell_m / 4);
    EXPECT_LE(std::abs(*found->value - heat(data.x, data.y, data.z)), *found->value_error);
    EXPECT_GT(glm::dot(found->normal_room, ray.direction_room), -1.001);
    EXPECT_LT(glm::dot(found->normal_room, ray.direction_room), 0) << "towards the eye";
    bounds_m.push_back(*found->error_m);
    ++hits;
  }
  EXPECT_GT(hits, 200);
  std::sort(bounds_m.begin(), bounds_m.end());
  EXPECT_LT(bounds_m[bounds_m.size() / 2], cell_m / 2);
}

TEST(CastMesh, ACellsValueIsTheCells) {
  const auto store = store_of(true);
  const scene::Probe down{EpochId{1}, {0.013, 2, 0.027}, {0, -1, 0}};
  const auto found = cast(*store, down, {}, 0, true);
  ASSERT_TRUE(found && found->value);
  EXPECT_EQ(*found->value, std::round(*found->value)) << "nothing lies between cells";
  EXPECT_LT(*found->value_error, 0.01);
}

TEST(CastMesh, WhatIsCutAwayIsNotMet) {
  const auto store = store_of(false);
  const scene::Probe down{EpochId{1}, {0.1, 2, 0}, {0, -1, 0}};
  ASSERT_TRUE(cast(*store, down, {}, 0, false));
  const geometry::Clip left{{{{-1, 0, 0}, 0}}};  // keeps x <= 0
  EXPECT_FALSE(cast(*store, down, left, 0, false));
  EXPECT_FALSE(cast(*store, {EpochId{1}, {0.1, 2, 0}, {0, 1, 0}}, {}, 0, false)) << "it looks away";
}

// A blob whose values are a formula of the room.
constexpr int kVoxels = 64;
double blob(const glm::dvec3& index) {
  const glm::dvec3 from = (index - glm::dvec3(31, 33, 30)) / glm::dvec3(14, 17, 12);
  return 1000 * std::exp(-glm::dot(from, from));
}

std::unique_ptr<VolumeStore> blob_store() {
  const StepReader read = [](size_t, const ReadProgress&) -> Result<Volume> {
    Volume v = make_volume<float>({kVoxels, kVoxels, kVoxels}, VoxelType::kF32, [](int i, int j, int k) {
      return float(blob({i, j, k}));
    });
    return v;
  };
  return *VolumeStore::make(read, 1, "blob", {}, {}, [](const char*, double) {});
}

TEST(CastVolume, PlacesAndValuesAreWithinTheirBoundsOfTheFormulas) {
  const auto store = blob_store();
  const volume::Session& session = store->session();
  const glm::dmat4 to_index = session.grid.room_to_index();
  const double voxel_m = session.grid.unit_m();
  int hits = 0;
  for (const char* text : {"0:#000000:0, 1000:#ffffff:0.6", "300:#ffffff:0, 300:#ffffff:0.9, 1000:#ffffff:1",
                           "200:#ffffff:0, 400:#ffffff:0.1, 600:#ffffff:0, 800:#ffffff:0.5"}) {
    const auto transfer = *volume::parse_transfer(text, {});
    for (auto ray : rays(80, session.grid.box_room(), 0.1)) {
      for (const double opacity : {0.25, 0.6}) {
        ray.opacity = opacity;
        const auto found = store->cast(0, transfer, {}, ray);
        // By the formula, in steps of a 200th of a voxel.
        double depth = 0, at = 0;
        const double enough = -std::log1p(-opacity), step = voxel_m / 200;
        double last = 0;
        for (; at < 4 && depth < enough; at += step) {
          const glm::dvec3 index(to_index * glm::dvec4(ray.origin_room + at * ray.direction_room, 1));
          bool inside = true;
          for (int a = 0; a < 3; ++a) inside &= index[a] >= -0.5 && index[a] <= kVoxels - 0.5;
          last = inside ? double{volume::extinction(transfer.at(blob(index)).opacity)} * step / voxel_m : 0;
          depth += last;
        }
        if (depth < enough || !found) continue;
        at -= step * (depth - enough) / last;
        const glm::dvec3 room = ray.origin_room + at * ray.direction_room;
        ++hits;
        ASSERT_TRUE(found->value && found->value_error);
        EXPECT_LE(glm::distance(found->room, room), voxel_m / 2) << text;
        if (!found->error_m) continue;
        EXPECT_LE(glm::distance(found->room, room), *found->error_m + step) << text;
        EXPECT_LE(std::abs(*found->value - blob(glm::dvec3(to_index * glm::dvec4(room, 1)))), *found->value_error + 0.1)
            << text;
        EXPECT_LE(*found->error_m, 2 * voxel_m) << text;
      }
    }
  }
  EXPECT_GT(hits, 150);
}

// A sheet of one voxel whose values are 1000, and 0 beside it. The field between voxels may be any that bends no more
// than the voxels do: trilinear, with the error of linear interpolation V t (1 - t) added or subtracted, or smooth
// (Catmull and Rom's spline). A jump of opacity at half of the value begins where 1 - t is half; the part in front of
// the place that hides a quarter is an eighth of a voxel thick (log(0.75) / log(0.1)).
TEST(CastVolume, AOneVoxelSheetIsBoundedByTheFieldsItMayBeOf) {
  constexpr int kSheet = 32;
  const auto store = *VolumeStore::make(
      [](size_t, const ReadProgress&) -> Result<Volume> {
        return make_volume<float>({kVoxels, kVoxels, kVoxels}, VoxelType::kF32,
                                  [](int, int, int k) { return k == kSheet ? 1000.0f : 0.0f; });
      },
      1, "sheet", {}, {}, [](const char*, double) {});
  const volume::Session& session = store->session();
  const glm::dmat4 to_index = session.grid.room_to_index();
  const double voxel_m = session.grid.unit_m();
  const glm::dvec3 eye(session.grid.index_to_room * glm::dvec4(33.2, 34.7, 90, 1)),
      down(session.grid.index_to_room * glm::dvec4(0, 0, -1, 0));
  const std::function<double(double)> fields[] = {
      [](double t) { return 1 - t; }, [](double t) { return (1 - t) * (1 + t); },
      [](double t) { return (1 - t) * (1 - t); }, [](double t) { return 1 - 2.5 * t * t + 1.5 * t * t * t; }};
  for (const double threshold : {0.3, 0.5, 0.8}) {
    const auto transfer = *volume::parse_transfer(fmt::format("{0}:#ffffff:0, {0}:#ffffff:0.9", 1000 * threshold), {});
    const auto found = store->cast(0, transfer, {}, {EpochId{1}, eye, glm::normalize(down)});
    ASSERT_TRUE(found && found->value && found->value_error) << threshold;
    ASSERT_TRUE(found->error_m) << threshold;
    const glm::dvec3 at(to_index * glm::dvec4(found->room, 1));
    const double deep = std::log(0.75) / std::log(0.1);
    EXPECT_NEAR(at.z, kSheet + 1 - threshold - deep, 1.0 / 16);
    EXPECT_LE(*found->error_m, 0.5 * voxel_m);
    for (const auto& field : fields) {
      double t = 1;
      while (field(t) < threshold) t -= 1e-4;
      const double place = kSheet + t - deep, value = 1000 * field(std::abs(t - deep));
      EXPECT_LE(std::abs(place - at.z) * voxel_m, *found->error_m) << threshold;
      EXPECT_LE(std::abs(value - *found->value), *found->value_error) << threshold;
    }
    // The stated error is no larger than these fields need.
    EXPECT_LE(
        *found->error_m,
        voxel_m * (std::max(std::sqrt(1 - threshold) - (1 - threshold), std::sqrt(threshold) - threshold) + 3.0 / 16))
        << threshold;
  }
}

TEST(CastVolume, WhatHidesTooLittleIsNoPlace) {
  const auto store = blob_store();
  const auto faint = *volume::parse_transfer("0:#ffffff:0.001", {});
  EXPECT_FALSE(store->cast(0, faint, {}, {EpochId{1}, {0, 0, 2}, {0, 0, -1}}));
  const auto solid = *volume::parse_transfer("0:#ffffff:0.5", {});
  const auto front = store->cast(0, solid, {}, {EpochId{1}, {0, 0, 2}, {0, 0, -1}});
  ASSERT_TRUE(front);
  // The volume begins at a cut.
  const auto cut = store->cast(0, solid, {{{{0, 0, -1}, 0}}}, {EpochId{1}, {0, 0, 2}, {0, 0, -1}});
  ASSERT_TRUE(cut);
  EXPECT_NEAR(cut->room.z, front->room.z - kRoom / 2, store->session().grid.unit_m());
  EXPECT_FALSE(store->cast(0, solid, {}, {EpochId{1}, {0, 0, 2}, {0, 0, 1}}));
}

}  // namespace
}  // namespace telesplat::data
