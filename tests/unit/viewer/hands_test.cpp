// Picking, measuring and clipping the points that a viewer holds, without a window, a session or a picture.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "client/viewer/hands/clip_list.h"
#include "client/viewer/hands/errands.h"
#include "client/viewer/hands/meaning.h"
#include "client/viewer/hands/pick.h"
#include "common/geometry/trajectory.h"
#include "common/image/normal.h"
#include "common/points/point_model.h"

namespace telesplat::viewer {
namespace {

// Two spheres of known depth, one before the other: the front one red, the back one blue.
struct Balls {
  struct Ball {
    glm::dvec3 centre;
    double radius;
    uint32_t colour;
  };
  std::vector<Ball> balls{{{0, 0, 0.15}, 0.1, 0xff0000}, {{0.05, 0.02, -0.15}, 0.2, 0x0000ff}};

  // Nearest ball on the ray through a pixel: its depth along the axis, place, normal and colour; nullopt: no ball.
  struct Hit {
    double depth;
    glm::dvec3 position, normal;
    uint32_t colour;
  };
  std::optional<Hit> trace(const geometry::Camera& c, double x, double y) const {
    const glm::dvec3 eye = c.pose.position_room, ray = c.unproject(x, y, 1) - eye;
    std::optional<Hit> best;
    for (const Ball& ball : balls) {
      const glm::dvec3 o = eye - ball.centre;
      const double a = glm::dot(ray, ray), b = glm::dot(ray, o), k = glm::dot(o, o) - ball.radius * ball.radius;
      if (b * b - a * k < 0) continue;
      const double t = (-b - std::sqrt(b * b - a * k)) / a;
      if (t < c.near_m || (best && best->depth < t)) continue;
      const glm::dvec3 p = eye + t * ray;
      best = Hit{t, p, (p - ball.centre) / ball.radius, ball.colour};
    }
    return best;
  }
  points::PointModel model() const {
    points::PointModel out({{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}, 5});
    uint64_t sequence = 0;
    for (const glm::dvec3& eye : {glm::dvec3(0, 0.1, 0.9), {0.6, 0.2, 0.6}, {-0.6, -0.1, 0.7}}) {
      const geometry::Camera c = geometry::make_camera(geometry::look_at(eye, glm::dvec3(0)), 50, 320, 240);
      image::DepthImage image(c.width, c.height);
      for (int y = 0; y < c.height; ++y)
        for (int x = 0; x < c.width; ++x)
          if (const auto hit = trace(c, x + 0.5, y + 0.5)) {
            const size_t at = size_t(y) * size_t(c.width) + size_t(x);
            image.depth[at] = image::encode_depth(hit->depth, c.near_m);
            image.colour[at] = hit->colour;
            image.normal[at] = image::encode_normal16(glm::vec3(hit->normal));
          }
      out.insert(points::prepare_patch(out.config(), Sequence{++sequence}, c, {0, 0, c.width, c.height}, image));
    }
    return out;
  }
};

geometry::Camera display(int width = 640, int height = 480) {
  return geometry::make_camera(geometry::look_at({0.1, 0.15, 0.85}, glm::dvec3(0)), 45, width, height);
}

TEST(Picking, FindsTheSurfaceUnderEachPixel) {
  const Balls balls;
  const auto model = balls.model();
  const geometry::Camera c = display();
  int picked = 0, missed = 0, edges = 0;
  for (double y = 3.5; y < c.height; y += 7)
    for (double x = 4.5; x < c.width; x += 9) {
      const auto truth = balls.trace(c, x, y);
      bool near_edge = false;  // within a splat of a silhouette: either answer is right
      for (const auto& [dx, dy] : {std::pair{6.0, 0.0}, {-6.0, 0.0}, {0.0, 6.0}, {0.0, -6.0}}) {
        const auto beside = balls.trace(c, x + dx, y + dy);
        near_edge |= beside.has_value() != truth.has_value() || (truth && beside->colour != truth->colour);
      }
      if (near_edge) {
        ++edges;
        continue;
      }
      splat::DrawList list;
      splat::select_view(model, pick_camera(c, x, y), {}, list);
      const auto found = pick_point(list, c, x, y);
      ASSERT_EQ(found.has_value(), truth.has_value()) << x << "," << y;
      if (!found) {
        ++missed;
        continue;
      }
      ++picked;
      EXPECT_EQ(found->colour, truth->colour) << x << "," << y;
      EXPECT_NEAR(found->depth_m, truth->depth, 1.5e-3) << x << "," << y;
      EXPECT_LT(glm::distance(found->position_room, truth->position), 2e-3);
      EXPECT_GT(glm::dot(found->normal_room, truth->normal), 0.98);
      EXPECT_LT(std::abs(found->depth_m - truth->depth), 3 * found->spacing_m) << "as exact as it says";
    }
  EXPECT_GT(picked, 500);
  EXPECT_GT(missed, 500);
  EXPECT_LT(edges, picked);
}

TEST(Picking, OfNothingFindsNothing) { EXPECT_FALSE(pick_point({}, display(), 10, 10)); }

// No point that a plane cuts away is drawn; all others are.
TEST(ClipList, KeepsThePointsInsideAndNoOthers) {
  const auto model = Balls().model();
  const geometry::Camera c = display();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> any(-1, 1);
  uint64_t kept = 0, cut = 0, whole = 0;
  for (int i = 0; i < 20; ++i) {
    geometry::Clip clip;
    for (unsigned n = 1 + random() % 3; n > 0; --n)
      clip.planes.push_back({glm::normalize(glm::dvec3(any(random), any(random), any(random))), 0.1 * any(random)});
    splat::DrawList list, all;
    splat::select_view(model, c, {}, all);
    splat::select_view(model, c, {}, list);
    clip_list(clip, list);
    const auto position = [](const splat::DrawItem& item, uint32_t n) {
      const geometry::Box& leaf = item.cluster->leaf_room;
      const double step = (double(leaf.hi.x) - double(leaf.lo.x)) / 65536;
      return glm::dvec3(leaf.lo) +
             (glm::dvec3(item.level.x[n], item.level.y[n], item.level.z[n]) + glm::dvec3(0.5)) * step;
    };
    const double step_m = 0.8 / 32 / 65536, tolerance_m = 2 * step_m;
    uint64_t listed = 0;
    for (const auto& item : list.items) {
      listed += item.level.count;
      whole += item.sequence.value != 0;
      for (uint32_t n = 0; n < item.level.count; ++n) ASSERT_TRUE(clip.keeps(position(item, n), tolerance_m));
    }
    uint64_t surely = 0, maybe = 0;
    for (const auto& item : all.items)
      for (uint32_t n = 0; n < item.level.count; ++n) {
        surely += clip.keeps(position(item, n), -tolerance_m);
        maybe += clip.keeps(position(item, n), tolerance_m);
      }
    EXPECT_EQ(listed, list.points);
    EXPECT_GE(listed, surely);
    EXPECT_LE(listed, maybe);
    kept += listed, cut += all.points - listed;
  }
  EXPECT_GT(kept, 10000u);
  EXPECT_GT(cut, 10000u);
  EXPECT_GT(whole, 100u) << "clusters that lie wholly inside are drawn as they are";
}

TEST(ClipList, WithoutPlanesChangesNothing) {
  const auto model = Balls().model();
  splat::DrawList list;
  splat::select_view(model, display(), {}, list);
  const uint64_t points = list.points;
  const size_t items = list.items.size();
  clip_list({}, list);
  EXPECT_EQ(list.points, points);
  EXPECT_EQ(list.items.size(), items);
}

// An opaque slab of a volume behind a thin veil.
TEST(Picking, OfAVolumeGoesToWhereItHidesEnough) {
  const volume::Grid grid{{40, 30, 16}, glm::dmat4(1)};
  const geometry::Camera c = geometry::make_camera({{19.5, 14.5, 60}, {1, 0, 0, 0}}, 50, 80, 60);
  volume::ShearFrame shear;
  shear.axis = 2, shear.direction = -1, shear.eye = c.pose.position_room;
  shear.width = 80, shear.height = 60;
  shear.u0 = c.left, shear.du = 1 / c.focal_x();
  shear.v0 = c.bottom, shear.dv = 1 / c.focal_y();
  shear.layers = {{12, 16, 13.5}, {8, 12, 9.5}, {0, 8, 3.5}};
  ASSERT_TRUE(volume::validate(shear, grid));
  const auto plain = [](int layer, uint32_t pixel) {
    return volume::SliceImage{layer, 0, 16, {0, 0, 80, 60}, std::vector<uint32_t>(80 * 60, pixel)};
  };
  // The front layer hides a tenth, the middle one nothing, the back one everything.
  const std::vector<volume::SliceImage> images{plain(0, 0x1a1a0000), plain(2, 0xff0000ff)};
  const auto frame = volume::make_volume_frame(grid, shear, images, {1}, {1}, 0);

  const auto veil = pick_volume(frame, c, 40, 30, 0.05);
  ASSERT_TRUE(veil);
  EXPECT_GE(veil->position_room.z, 11.5);
  EXPECT_LE(veil->position_room.z, 15.5);
  EXPECT_EQ(veil->colour, 0xff0000u);
  const auto wall = pick_volume(frame, c, 40, 30, 0.5);
  ASSERT_TRUE(wall);
  EXPECT_GE(wall->position_room.z, -0.5);
  EXPECT_LE(wall->position_room.z, 7.5);
  EXPECT_NEAR(wall->spacing_m, 4, 0.01) << "half of the layer";
  EXPECT_LT(veil->depth_m, wall->depth_m);

  const std::vector<volume::SliceImage> thin{plain(0, 0x1a1a0000)};
  EXPECT_FALSE(pick_volume(volume::make_volume_frame(grid, shear, thin, {1}, {1}, 0), c, 40, 30, 0.5));

  // Rays that run along the layers meet their planes at the largest finite distances.
  const double half = std::sqrt(0.5);
  for (const double lean : {1e-5, 1e-9, 1e-12, 1e-15, -1e-12}) {
    geometry::Camera along = geometry::make_camera({{-60, 14.5, 9.5}, {half, 0, -half + lean, 0}}, 50, 80, 60);
    for (double x = 36; x < 44; x += 0.25) (void)pick_volume(frame, along, x, 30, 0.5);
  }
}

scene::Colouring temperature() {
  return {.array = "temperature",
          .unit = "K",
          .lo = 250,
          .hi = 350,
          .origin = 0,
          .map = *colour::find_colour_map("viridis")};
}

// The colour map is inverted: the value lies within a narrow range that the pick states.
TEST(Values, AreFoundByTheirColours) {
  const scene::Colouring colouring = temperature();
  const auto table = scene::make_table(colouring);
  for (double value = 250.5; value < 350; value += 3.7) {
    const auto range = value_of_colour(colouring, table.at(float(value)));
    ASSERT_TRUE(range) << value;
    EXPECT_LE(range->lo, value + 0.05);
    EXPECT_GE(range->hi, value - 0.05);
    EXPECT_LT(range->hi - range->lo, 3);
  }
  EXPECT_FALSE(value_of_colour(colouring, 0xff00ff)) << "no colour of the map";
  EXPECT_FALSE(value_of_colour(colouring, table.colours.back())) << "a missing value";
}

SceneTerms millimetres() {
  SceneTerms out;
  out.placement =
      scene::placement_of(glm::dmat3(1), {{0, 0, 0}, {800, 800, 800}}, {{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}});
  out.placement.unit = "mm";
  return out;
}
class Errands : public testing::Test {
 protected:
  Result<std::string> order(const std::string& command, const std::map<std::string, std::string>& arguments) {
    return carry_out({1, command, arguments}, hands);
  }
  FrameHands hands{.camera = display(),
                   .head = display().pose,
                   .epoch = {3},
                   .terms = std::make_shared<const SceneTerms>(millimetres()),
                   .pick = [this](double x, double y, double o) -> std::optional<Pick> {
                     opacity = o;
                     if (x < 100) return std::nullopt;
                     Pick out;
                     out.position_room = {x / 10000, y / 10000, 0};
                     out.normal_room = {0, 0, 1};
                     out.colour = 0x102030;
                     return out;
                   },
                   .go = [this](const geometry::Pose& p) { return gone = p, true; },
                   .set = [this](const std::string& name, const std::string& value) -> Status {
                     if (value == "wrong") return Error{"it is wrong"};
                     return changed[name] = value, ok_status();
                   }};
  std::map<std::string, std::string> changed;
  double opacity = 0;
  geometry::Pose gone;
};

TEST_F(Errands, ASettingOfTheWindowIsChangedOrRefusedByItsName) {
  EXPECT_TRUE(order("splat", {{"value", "ewa"}}));
  EXPECT_EQ(changed["splat"], "ewa");
  EXPECT_TRUE(order("overlay", {{"name", "axes"}, {"on", "off"}}));
  EXPECT_EQ(changed["axes"], "off");
  EXPECT_EQ(order("stereo", {{"value", "wrong"}}).error().text, "stereo: it is wrong");
  EXPECT_FALSE(order("overlay", {{"name", "axes"}, {"on", "perhaps"}}));
  EXPECT_FALSE(order("clip", {{"value", "off"}})) << "the master's";
}

TEST_F(Errands, APickIsToldInTheDatasTerms) {
  const auto done = order("pick", {{"at", "200,100"}});
  ASSERT_TRUE(done) << done.error().text;
  const auto json = nlohmann::json::parse(*done);
  ASSERT_EQ(json["picks"].size(), 1u);
  const auto& pick = json["picks"][0];
  EXPECT_NEAR(pick["data"][0].get<double>(), 420, 1e-3);
  EXPECT_NEAR(pick["room"][1].get<double>(), 0.01, 1e-12);
  EXPECT_EQ(pick["unit"], "mm");
  EXPECT_EQ(pick["colour"], "#102030");
  EXPECT_EQ(json["epoch"], 3);
  EXPECT_EQ(opacity, kPickOpacity);
  // The viewer's own pick states no error bound, but it has the question to the data server.
  EXPECT_FALSE(pick.contains("error"));
  EXPECT_TRUE(pick.contains("estimate"));
  const auto probe = scene::probe_from(pick["probe"].get<std::map<std::string, std::string>>());
  ASSERT_TRUE(probe) << probe.error().text;
  EXPECT_EQ(probe->epoch, EpochId{3});
  EXPECT_TRUE(scene::placement_from_text(json["placement"].dump()));
  // Per cent of the display; two places and their distance.
  const auto two = order("pick", {{"at", "50%,50% 480,240"}, {"opacity", "0.9"}});
  ASSERT_TRUE(two);
  const auto both = nlohmann::json::parse(*two);
  EXPECT_NEAR(both["picks"][1]["data"][0].get<double>() - both["picks"][0]["data"][0].get<double>(), 16, 1e-3);
  EXPECT_EQ(opacity, 0.9);
  // A place without points.
  EXPECT_TRUE(nlohmann::json::parse(*order("pick", {{"at", "10,10"}}))["picks"][0].is_null());
}

TEST_F(Errands, BadOrdersAreRefused) {
  for (const char* place : {"", "1", "a,b", "1,2,3", "700,10", "-1,10", "nan,1", "101%,1", "1,1 2,2 3,3 4,4"})
    EXPECT_FALSE(order("pick", {{"at", place}})) << place;
  for (const char* bad : {"0", "1.5", "x", "nan"})
    EXPECT_FALSE(order("pick", {{"at", "1,1"}, {"opacity", bad}})) << bad;
  EXPECT_FALSE(order("fly", {}));
  for (const char* pose : {"", "1,2,3", "0,0,0,0,0,0,0", "1e9,0,0,1,0,0,0", "0,0,0,1,0,0,x"})
    EXPECT_FALSE(order("go", {{"pose", pose}})) << pose;
  hands.terms = nullptr;
  EXPECT_FALSE(order("pick", {{"at", "1,1"}}));
}

TEST_F(Errands, APictureTellsThatItHasNoDepth) {
  hands.pictures = true;
  const auto said = order("pick", {{"at", "200,100"}});
  ASSERT_FALSE(said);
  EXPECT_NE(said.error().text.find("no depth"), std::string::npos) << said.error().text;
}

TEST_F(Errands, WhereAndBackAgain) {
  const auto json = nlohmann::json::parse(*order("where", {}));
  EXPECT_NEAR(json["position"][2].get<double>(), 0.85, 1e-12);
  ASSERT_TRUE(order("go", {{"pose", "0.5,1,2,0.6,0,0.8,0"}}));
  EXPECT_EQ(gone.position_room, glm::dvec3(0.5, 1, 2));
  hands.go = [](const geometry::Pose&) { return false; };
  EXPECT_FALSE(order("go", {{"pose", "0.5,1,2,0.6,0,0.8,0"}}));
}

}  // namespace
}  // namespace telesplat::viewer
